"""``ocmm support``: pack a support bundle, after showing its contents."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from ocmm_cli.terminal import make_console, progress_line, say
from ocmm_core.errors import InputError

support_app = typer.Typer(no_args_is_help=True, help="Help from support: what to send along.")


@support_app.callback()
def _support() -> None:
    """Keep `bundle` a command of its own."""


@support_app.command()
def bundle(
    file: Annotated[Path, typer.Argument(help="Archive to write, .zip.")],
    *,
    without: Annotated[
        list[str] | None,
        typer.Option(
            "--without",
            help="Leave a part out; may be given several times: versions, settings, doctor, logs, "
            "records, recording.",
        ),
    ] = None,
    mask_names: Annotated[
        bool, typer.Option("--mask-names", help="Take names of people out.")
    ] = False,
    list_only: Annotated[
        bool, typer.Option("--list", help="Show what would be inside, and write nothing.")
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Write it without asking.")] = False,
) -> None:
    """Pack versions, settings, the doctor's report, logs and heads of records into a ZIP file.

    Shows what is inside before it is written. Nothing is sent. Passwords, tokens and private keys
    are never inside. The recording of the last 30 seconds is packed by the window, while it
    measures.
    """
    from ocmm_core.support import draft_bundle, site_of_this_user, write_bundle

    left_out = without or []
    with progress_line() as progress:
        draft = draft_bundle(site_of_this_user(), mask_names=mask_names, told=progress)
    draft.packed(left_out)
    console = make_console(soft_wrap=True, stderr=True)
    console.print(draft.contents(left_out, say), highlight=False)
    if list_only:
        return
    if not yes:
        if not sys.stdin.isatty():
            raise InputError(
                "support.nobody_to_ask",
                "Nobody can be asked here; nothing was written.",
                "Add --yes, or run it in a terminal.",
            )
        if not typer.confirm(say(f"Write {file}?"), err=True):
            console.print(say("Nothing was written."))
            return
    size = write_bundle(draft, file, left_out)
    make_console(soft_wrap=True).print(
        say(f"{file}: {size} bytes. Nothing was sent."), highlight=False
    )

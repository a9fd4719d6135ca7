"""``ocmm support``: changes of this version, and a bundle, packed after showing its contents."""

from __future__ import annotations

from pathlib import Path

import typer

from ocmm_cli.terminal import agrees, lead, make_console, progress_line, tr
from ocmm_core.build import build_version

support_app = typer.Typer(no_args_is_help=True, help="Help from support: what to send along.")


@support_app.callback()
def _support() -> None:
    """Keep `bundle` a command of its own."""


@support_app.command()
def whatsnew(*, since: str) -> None:
    """Print the changes of this version, newest first."""
    from ocmm_core.manual import changes_since

    typer.echo(f"{lead('Version ')}{build_version()}\n")
    for section in changes_since(since):
        typer.echo(section)


@support_app.command()
def bundle(
    file: Path, *, without: list[str] | None, mask_names: bool, list_only: bool, yes: bool
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
    console.print(draft.contents(left_out, tr))
    if list_only:
        return
    if not yes and not agrees(tr(f"Write {file}?")):
        console.show("Nothing was written.")
        return
    size = write_bundle(draft, file, left_out)
    make_console(soft_wrap=True).print(tr(f"{file}: {size} bytes. Nothing was sent."))

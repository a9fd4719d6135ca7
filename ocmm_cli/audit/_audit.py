"""``ocmm audit``: authors, times, steps and integrity of files."""

from __future__ import annotations

from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.terminal import lead, say, told
from ocmm_core.errors import OcmmError

if TYPE_CHECKING:
    from ocmm_core.export.audits import Audit

audit_app = typer.Typer(
    no_args_is_help=True,
    help="List who wrote files of this program, when, and whether they are unchanged.",
)

_SHOWN = 10


@audit_app.command()
def verify(
    *,
    paths: Annotated[
        list[Path],
        typer.Argument(
            readable=False,
            help="Any file or folder of this program: jobs, histories of calibrations, acceptance "
            "records, studies, the register of artefacts, plans, templates, settings, reports, "
            "certificates.",
        ),
    ],
    line: Annotated[
        str, typer.Option("--line", help="Text of the code on the report of a job.")
    ] = "",
    everything: Annotated[
        bool, typer.Option("--all", help=f"List all steps, not only the last {_SHOWN}.")
    ] = False,
) -> None:
    """Verify signatures, chains and hashes, and list who did what; nothing is written.

    Exit code 0 if everything is intact, 1 if something is suspect or adopted, 2 if something cannot
    be read.
    """
    from ocmm_core.export.audits import audit, files_to_audit

    worst = 0
    for path in chain.from_iterable(map(files_to_audit, paths)):
        try:
            found = audit(path, line)
        except OcmmError as error:
            typer.echo(told(error), err=True)
            worst = 2
            continue
        _print(found, everything=everything)
        worst = max(worst, 0 if found.intact else 1)
    raise typer.Exit(worst)


@audit_app.command()
def release(
    *,
    files: Annotated[
        list[Path], typer.Argument(readable=False, help="Templates or other documents (TOML).")
    ],
    who: Annotated[str, typer.Option("--by", help="Name of the person who answers for them.")],
    reason: Annotated[str, typer.Option("--reason", help="Why.")] = "",
) -> None:
    """Release documents by name: templates, artefacts, procedures, rigs; plans: ocmm plan release.

    The release is signed and kept next to the document (.release.json).
    """
    from ocmm_core.export.audits import document_kind
    from ocmm_core.seals import release_file

    for path in files:
        release_file(path, document_kind(path), who, reason)
        typer.echo(say(f"{path}: released by {who}."))


@audit_app.command()
def adopt(
    *,
    jobs: Annotated[list[Path], typer.Argument(readable=False, help="Job files (.ocmm).")],
    who: Annotated[str, typer.Option("--who", help="Name of the person who answers for them.")],
    reason: Annotated[str, typer.Option("--reason", help="Why.")],
) -> None:
    """Take over jobs that no station signed, or older copies if no newer one is left.

    The job keeps who did so, why, and what was suspect; it is ADOPTED from then on, never INTACT.
    Jobs of unknown stations, changed jobs, and jobs that contradict the memory of this station are
    refused.
    """
    from ocmm_core.storage import JobFile

    worst = 0
    for path in jobs:
        try:
            with JobFile.open(path) as job:
                job.adopt(who, reason)
        except OcmmError as error:
            typer.echo(told(error), err=True)
            worst = 2
        else:
            typer.echo(say(f"{path}: taken over by {who}."))
    raise typer.Exit(worst)


def _print(found: Audit, *, everything: bool) -> None:
    typer.echo(f"{_plain(str(found.path))}: {say(found.word)} ({found.kind.value})")
    signed = "ADOPTED" if found.adopted else found.signer.word.value
    typer.echo(say(f"  Signed   {signed}, by {found.signer.signer}"))
    for text in found.adopted:
        typer.echo(f"{lead('  Adopted  ')}{_plain(text)}")
    for fault in found.faults:
        typer.echo(f"{lead('  Fault    ')}{_plain(say(fault))}")
    for proof in found.proofs:
        typer.echo(f"{lead('  Proof    ')}{_plain(say(proof))}")
    if not found.rows:
        return
    first, last = found.rows[0], found.rows[-1]
    steps = f"{len(found.rows)} step{'s' if len(found.rows) > 1 else ''}"
    typer.echo(say(f"  Steps    {steps}, {first.utc[:19]} to {last.utc[:19]} UTC"))
    shown = found.rows if everything else found.rows[-_SHOWN:]
    for row in shown:
        typer.echo(f"  {row.utc[:19]}  {_plain(row.who) or '-'}  {_plain(row.what)}")


def _plain(text: str) -> str:
    """Replace characters that would control the terminal."""
    return "".join(sign if sign.isprintable() else "?" for sign in text)

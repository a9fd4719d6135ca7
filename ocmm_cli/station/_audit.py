"""``ocmm audit`` and ``ocmm key``: integrity, signers and trusted keys.

In: a job, a folder of records, the seal of a report; a public key. Out: sentences, and exit codes.

Authors, times, steps and integrity of files; the signing key of this station, and trusted keys of
others. Judgement is in `export.audits` and `seals`.
"""

from __future__ import annotations

from datetime import UTC, datetime
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.terminal import error_text, lead, tr
from ocmm_core.errors import OcmmError

if TYPE_CHECKING:
    from ocmm_core.export.audits import Audit
    from ocmm_core.seals import TokenPlace


audit_app = typer.Typer(
    no_args_is_help=True,
    help="List who wrote files of this program, when, and whether they are unchanged.",
)

_SHOWN = 10


@audit_app.command()
def verify(
    *, paths: Annotated[list[Path], typer.Argument(readable=False)], line: str, everything: bool
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
            typer.echo(error_text(error), err=True)
            worst = 2
            continue
        _print(found, everything=everything)
        worst = max(worst, 0 if found.intact else 1)
    raise typer.Exit(worst)


@audit_app.command()
def release(
    *, files: Annotated[list[Path], typer.Argument(readable=False)], who: str, reason: str
) -> None:
    """Release documents by name: templates, artefacts, procedures, rigs; plans: ocmm plan release.

    The release is signed and kept next to the document (.release.json).
    """
    from ocmm_core.export.audits import document_kind
    from ocmm_core.seals import release_file

    for path in files:
        release_file(path, document_kind(path), who, reason)
        typer.echo(tr(f"{path}: released by {who}."))


@audit_app.command()
def adopt(
    *, jobs: Annotated[list[Path], typer.Argument(readable=False)], who: str, reason: str
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
            typer.echo(error_text(error), err=True)
            worst = 2
        else:
            typer.echo(tr(f"{path}: taken over by {who}."))
    raise typer.Exit(worst)


def _print(found: Audit, *, everything: bool) -> None:
    typer.echo(f"{_plain(str(found.path))}: {tr(found.word)} ({found.kind.value})")
    signed = "ADOPTED" if found.adopted else found.signer.word.value
    typer.echo(tr(f"  Signed   {signed}, by {found.signer.signer}"))
    for text in found.adopted:
        typer.echo(f"{lead('  Adopted  ')}{_plain(text)}")
    for fault in found.faults:
        typer.echo(f"{lead('  Fault    ')}{_plain(tr(fault))}")
    for proof in found.proofs:
        typer.echo(f"{lead('  Proof    ')}{_plain(tr(proof))}")
    if not found.rows:
        return
    first, last = found.rows[0], found.rows[-1]
    steps = f"{len(found.rows)} step{'s' if len(found.rows) > 1 else ''}"
    typer.echo(tr(f"  Steps    {steps}, {first.utc[:19]} to {last.utc[:19]} UTC"))
    shown = found.rows if everything else found.rows[-_SHOWN:]
    for row in shown:
        typer.echo(f"  {row.utc[:19]}  {_plain(row.who) or '-'}  {_plain(row.what)}")


def _plain(text: str) -> str:
    """Replace characters that would control the terminal."""
    return "".join(sign if sign.isprintable() else "?" for sign in text)


key_app = typer.Typer(
    no_args_is_help=True,
    help="The key of this station, and the keys of other stations whose files are believed here.",
)


@key_app.command()
def show(*, x509: Path | None) -> None:
    """Print the public key of this station, making the key if there is none, and all known ones."""
    from ocmm_core.seals import KeyFolder, public_text, shown_key, write_station_certificate

    keys = KeyFolder()
    own = keys.station_key()
    typer.echo(f"{lead('This station  ')}{shown_key(own.fingerprint)}")
    typer.echo(f"{lead('  Public key  ')}{public_text(own.public)}")
    typer.echo(f"{lead('  Kept in     ')}{own.kept_in}")
    if x509 is not None:
        write_station_certificate(x509, keys)
        typer.echo(f"{lead('  X.509       ')}{x509}")
    for key in keys.known():
        until = f", replaced {key.until_utc[:10]}" if key.until_utc else ""
        typer.echo(
            tr(f"{key.name}  {shown_key(key.fingerprint)}, since {key.since_utc[:10]}{until}")
        )
        typer.echo(f"{lead('  By ')}{key.who}: {key.reason}")


@key_app.command()
def trust(*, public: str, name: str, who: str, reason: str) -> None:
    """Believe what another station signs. First compare its key by another way, e.g. a call."""
    from ocmm_core.seals import KeyFolder, public_from_text, shown_key

    key = KeyFolder().trust(public_from_text(public.strip()), name, who, reason, datetime.now(UTC))
    typer.echo(tr(f"{key.name} is believed from now on: key {shown_key(key.fingerprint)}."))


@key_app.command()
def replace(
    *, who: str, reason: str, token: str, module: Path | None, pin_file: Path | None, in_file: bool
) -> None:
    """Sign with a new key from now on. What the old one signed still verifies on this computer.

    The new key is made where the old one is: in a file, or in a token that never gives it away.
    """
    from ocmm_core.seals import KeyFolder, shown_key

    keys = KeyFolder()
    place = None if in_file else _place(token, module, pin_file) or keys.token_place()
    key = keys.replace(who, reason, datetime.now(UTC), place)
    typer.echo(tr(f"This station signs with key {shown_key(key.fingerprint)} from now on."))
    typer.echo(f"{lead('  Kept in     ')}{key.kept_in}")
    typer.echo(tr("Tell those who trust this station: ocmm key show prints the new public key."))


@key_app.command()
def restored(*, who: str, reason: str) -> None:
    """Accept the files that this key signed up to now without the memory of the station.

    After the key was brought to another computer or user, or the memory was lost. An end that was
    removed from such a file before is not noticed: check the last step of each on its report.
    """
    from ocmm_core.seals import KeyFolder, start_memory

    utc = start_memory(KeyFolder(), who, reason, datetime.now(UTC))
    typer.echo(tr(f"The memory of this station starts at {utc[:19]} UTC, by {who}."))


def _place(token: str, module: Path | None, pin_file: Path | None) -> TokenPlace | None:
    from ocmm_core.documents import read_bytes
    from ocmm_core.errors import InputError
    from ocmm_core.seals import TokenPlace

    if not token and module is None and pin_file is None:
        return None
    if not token or module is None:
        raise InputError(
            "key.place",
            "A token is named by its label and by the library of its maker.",
            "Give both: --token LABEL --module LIBRARY",
        )
    if pin_file is None:
        pin: str = typer.prompt(tr(f"PIN of token {token}"), hide_input=True)
    else:
        pin = read_bytes(pin_file).decode("utf-8", "replace").strip()
    return TokenPlace(module=str(module.absolute()), label=token, pin=pin)

"""``ocmm artefact``: the register of spheres, bars, gauge blocks and parts."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.terminal import heads, lead, make_console, print_grid, tr, tr_word

if TYPE_CHECKING:
    from ocmm_core.acceptance import ArtefactEntry

artefact_app = typer.Typer(
    no_args_is_help=True,
    help="Keep the calibrated artefacts: certificate, U, form, expansion, due date.",
)


@dataclass(frozen=True, slots=True)
class TypedArtefact:
    """Options of an `ArtefactEntry`."""

    id: str
    kind: str
    name: str
    maker: str
    serial: str
    laboratory: str
    certificate: str
    certificate_file: Path | None
    due_utc: str
    sizes: list[float] | None
    expanded: float
    expanded_per_length: float
    form: float
    expansion: float
    expansion_sigma: float
    supports: str

    def entry(self) -> ArtefactEntry:
        from ocmm_core.acceptance import ARTEFACT_KINDS, ARTEFACT_SCHEMA, ArtefactEntry
        from ocmm_core.documents import digest
        from ocmm_core.errors import InputError

        if self.kind not in ARTEFACT_KINDS:
            raise InputError(
                "artefact.kind",
                f"--kind is {self.kind!r}.",
                f"Give one of: {', '.join(ARTEFACT_KINDS)}.",
            )
        named = asdict(self)
        file = named.pop("certificate_file")
        named.update(name=self.name or self.id, sizes=tuple(self.sizes or ()))
        sha256 = "" if file is None else digest(file)
        return ArtefactEntry(schema=ARTEFACT_SCHEMA, unit="mm", certificate_sha256=sha256, **named)


@artefact_app.command()
def add(
    *, file: Path | None, typed: TypedArtefact, replace: bool, who: str, folder: Path | None
) -> None:
    """Add an artefact from a document, or as it is typed."""
    from ocmm_core.acceptance import ArtefactRegister, load_artefact

    entry = typed.entry() if file is None else load_artefact(file)
    ArtefactRegister(folder, restarts=replace).add(entry, who, datetime.now(UTC), replace=replace)
    make_console().print(
        tr(f"Added    {entry.id}: {entry.name}, serial {entry.serial}"), highlight=True
    )


@artefact_app.command(name="list")
def list_command(*, folder: Path | None) -> None:
    """List the artefacts with their due dates."""
    from ocmm_core.acceptance import ArtefactRegister

    console, now = make_console(), datetime.now(UTC)
    register = ArtefactRegister(folder)
    entries, faults = register.entries, register.faults()
    if not entries:
        console.show("No artefacts yet. Add one: ocmm artefact add FILE")
        return
    rows = []
    for one in entries.values():
        due = datetime.fromisoformat(one.used().use.due_utc)
        word = due.date().isoformat()
        if due <= now:
            word += f" {tr_word('EXPIRED')}"
        if one.id in faults:
            word += f" {tr_word('NOT SIGNED')}"
        rows.append(
            (one.id, one.kind, one.serial, f"{1e3 * one.expanded:.2f}", one.certificate, word)
        )
    columns = heads("Id", "Kind", "Serial", "U (k = 2), µm", "Certificate no.", "Due")
    print_grid(console, columns, rows)


@artefact_app.command()
def show(*, name: str, folder: Path | None) -> None:
    """Print everything that is known of an artefact."""
    from ocmm_core.acceptance import ArtefactRegister

    console, entry = make_console(), ArtefactRegister(folder).entry(name)
    for field in entry.__struct_fields__:
        console.print(f"{field:20} {getattr(entry, field)}")


@artefact_app.command()
def read(*, name: str, folder: Path | None) -> None:
    """Read thermometers by their sources, and print what is doubtful.

    Exit code 0: all readings may be used.
    """
    from ocmm_core.acceptance import thermometer_log

    console = make_console(soft_wrap=True)
    found = thermometer_log(name, datetime.now(UTC), folder).sample()
    for one in found:
        if one.sample is not None:
            words = f"{one.id:12} {one.sample.celsius:.3f} °C, U {one.expanded:g} K (k = 2)"
            console.print(f"{words}, {one.sample.utc:%Y-%m-%d %H:%M:%S%z}")
    for doubt in dict.fromkeys(one.doubt for one in found if one.doubt):
        console.show(doubt)
    raise typer.Exit(1 if any(one.doubt for one in found) else 0)


@artefact_app.command()
def remove(*, name: str, who: str, folder: Path | None) -> None:
    """Take an artefact out of the register; what was said of it stays in its file."""
    from ocmm_core.acceptance import ArtefactRegister

    ArtefactRegister(folder).remove(name, who, datetime.now(UTC))
    make_console().print(f"{lead('Removed  ')}{name}")

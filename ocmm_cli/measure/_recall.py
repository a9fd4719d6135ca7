"""``ocmm recall`` and ``ocmm archive recall``: later findings applied to older jobs.

Verdicts of jobs after their calibration was found wrong, and of all archived jobs.
"""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from ocmm_cli import terminal
from ocmm_cli.measure._pages import print_pages
from ocmm_cli.options import ComputingSite
from ocmm_cli.terminal import PlainConsole
from ocmm_core.cleanup import scratch_folder
from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.wording import Speech

if TYPE_CHECKING:
    from ocmm_core.inspection.finished import RecallRecord


_JOBS = Path("ocmm-out")
_STYLES = {"HOLDS": "green", "CHANGES": "bold red", "UNKNOWN": "yellow"}
"""By the name of the outcome."""


def recall_command(
    *, jobs: list[Path] | None, calibrations: Path | None, probes: Path | None, who: str,
    artefact: str | None,
    since: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d", "%Y-%m-%dT%H:%M"])],
    json_file: Path | None, pdf_file: Path | None, site: ComputingSite,
) -> None:  # fmt: skip
    """Recalculate the jobs that are in doubt because their calibration failed later.

    Every job is recomputed from its raw spots with the calibration in force now; what the spots
    exclude decides which of both counts. Verdicts CHANGE, HOLD, or CANNOT BE KNOWN. Job files are
    not written to. Ends with 0 where all verdicts hold, else with 1.
    """
    from ocmm_core.calibration.records import default_folder
    from ocmm_core.inspection.recall import KeptPlaces, decide, recall

    console = terminal.make_console()
    folder = calibrations if calibrations is not None else default_folder()
    if artefact is not None or since is not None:
        _let_fall(console, folder, artefact, since, who)
    places = KeptPlaces(tuple(jobs or [_JOBS]), folder, probes)
    with terminal.progress_line() as tell:
        record = recall(places, datetime.now(UTC), tell, site=site)
    if who and record.jobs:
        record = decide(record, places, who, datetime.now(UTC))
    _conclude(console, record, json_file, pdf_file)


def _let_fall(
    console: PlainConsole, folder: Path, artefact: str | None, since: datetime | None, who: str
) -> None:
    from ocmm_core.inspection.recall import artefact_wrong

    if artefact is None or since is None or not who:
        raise InputError(
            "recall.artefact",
            (
                "Reporting a wrong artefact needs its serial number, the date since when, "
                "and your name."
            ),
            "Give --artefact, --since and --by.",
        )
    fallen = artefact_wrong(folder, artefact, since.astimezone(UTC), who, datetime.now(UTC))
    for one in fallen:
        console.print(
            terminal.tr(
                f"Invalid {one.kind} of rig {one.rig}, {one.made_utc[:16]} UTC, calibration "
                f"{one.calibration[:12]}"
            )
        )
    if not fallen:
        console.print(
            terminal.tr(f"Everything based on artefact {artefact} was already invalidated."),
            highlight=True,
        )


def _conclude(
    console: PlainConsole, record: RecallRecord, json_file: Path | None, pdf_file: Path | None
) -> None:
    """Print a recall, write it sealed and its pages if requested; exit 1 unless all holds."""
    from ocmm_core.calibration.records import seal_signed
    from ocmm_core.inspection.finished import Outcome
    from ocmm_core.seals import Signed

    show_recall(console, record)
    if json_file is not None:
        _write(json_file, seal_signed(record, Signed.RECALL))
        console.print(f"{terminal.lead('Recall  ')}{json_file}")
    if pdf_file is not None:
        _print_pages(record, pdf_file)
        console.print(f"{terminal.lead('Recall  ')}{pdf_file}")
    if record.count(Outcome.CHANGES) + record.count(Outcome.UNKNOWN) or record.unread:
        raise typer.Exit(1)


def show_recall(console: PlainConsole, record: RecallRecord) -> None:
    from ocmm_core.inspection.recall import (
        COLUMNS,
        decided,
        headline,
        job_line,
        not_judged,
        rests_on,
        row,
        totals,
        worst_first,
    )

    speech = Speech(terminal.language(os.environ))
    console.print(headline(record, speech), style="bold")
    for sentence in not_judged(record):
        console.print(terminal.tr(sentence), style="yellow")
    if not record.jobs:
        return
    for sentence in (*totals(record), decided(record)):
        console.print(terminal.tr(sentence))
    if not record.made_by:
        console.print(terminal.tr("--by NAME releases the points whose verdicts hold."))
    rows = []
    for job in worst_first(record.jobs):
        name = job.label
        for one in job.characteristics:
            cells = (name, *row(one, speech))
            rows.append([Text(terminal.shown(cell), _STYLES[one.outcome.name]) for cell in cells])
            name = ""
    terminal.print_grid(console, terminal.heads(*COLUMNS), rows)
    for job in worst_first(record.jobs):
        console.print(f"{job_line(job, speech)} {terminal.tr(rests_on(job))}")


def _print_pages(record: RecallRecord, path: Path) -> None:
    from ocmm_core.calibration.records import seal

    with scratch_folder("recall") as folder:
        sealed = folder / "recall.json"
        sealed.write_bytes(seal(record))
        print_pages(
            "ocmm_gui.reports._recall",
            [[str(sealed), str(path), "--language", terminal.language(os.environ)]],
            "recall.pdf",
            "The recall report was not written",
            "The decision is stored; write the pages again.",
        )


def _write(path: Path, content: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomic(path, content)
    except OSError as error:
        raise StorageError(
            "recall.unwritable",
            f"{path}: the recall cannot be written ({error.strerror}).",
            "Give another file; the decision is stored.",
        ) from error


def recall_archived(
    *, archive: str | None, calibrations: list[Path] | None, probes: Path | None, who: str,
    artefact: str, tip: str, calibration: str,
    since: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d", "%Y-%m-%dT%H:%M"])],
    json_file: Path | None, pdf_file: Path | None, site: ComputingSite,
) -> None:  # fmt: skip
    """Recall the archived jobs that a finding touches, wherever they were measured.

    Jobs of calibrations in doubt by the histories given are recomputed; jobs that used a wrong
    artefact, tip or calibration whose history is not here CANNOT BE KNOWN. Ends with 0 where all
    verdicts hold, else with 1.
    """
    from ocmm_core.calibration.records import default_folder
    from ocmm_shop.archive.stores import open_archive
    from ocmm_shop.archiving import required_place
    from ocmm_shop.recalls import ArchiveFinding, ShopPlaces, decide_archived, recall_archive

    place = required_place(archive)
    named = {"artefact": artefact, "tip": tip, "calibration": calibration}
    given = [(kind, identity) for kind, identity in named.items() if identity]
    if len(given) > 1 or bool(given) != (since is not None):
        raise InputError(
            "recall.finding",
            "A finding is one artefact, tip or calibration, and since when it was wrong.",
            "Give one of --artefact, --tip and --calibration with --since.",
        )
    finding = None
    if given and since is not None:
        finding = ArchiveFinding(*given[0], since.astimezone(UTC))
    places = ShopPlaces(
        place.address, tuple(calibrations or [default_folder()]), probes, place.password
    )
    console = terminal.make_console()
    with terminal.progress_line() as tell:
        record = recall_archive(places, datetime.now(UTC), tell, site, finding)
    if who and record.jobs:
        with open_archive(place.address, password=place.password) as opened:
            record, _ = decide_archived(opened, record, who, datetime.now(UTC))
    _conclude(console, record, json_file, pdf_file)

"""``ocmm archive recall``: a later finding applied to all archived jobs."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from ocmm_cli.measure._recall import show_recall, write_recall
from ocmm_cli.terminal import computing, make_console, progress_line
from ocmm_core.cluster import Site
from ocmm_core.errors import InputError


@computing
def recall_archived(
    *,
    archive: Annotated[
        str | None,
        typer.Option(
            "--archive",
            help="local, a file, or postgresql://USER@SERVER/DB. Default: the settings.",
        ),
    ] = None,
    calibrations: Annotated[
        list[Path] | None,
        typer.Option(
            "--calibrations",
            help="Calibration folder of a station; repeat it for each. Default: that of this user.",
        ),
    ] = None,
    probes: Annotated[
        Path | None,
        typer.Option("--probes", help="Probe record folder. Default: that of this user."),
    ] = None,
    who: Annotated[
        str,
        typer.Option(
            "--by",
            help="Your name: stores the recall; jobs whose verdicts do not hold are held back at "
            "every station. Without it, nothing is stored.",
        ),
    ] = "",
    artefact: Annotated[
        str, typer.Option("--artefact", help="Serial number of an artefact found wrong.")
    ] = "",
    tip: Annotated[str, typer.Option("--tip", help="Name or hash of a tip found wrong.")] = "",
    calibration: Annotated[
        str, typer.Option("--calibration", help="Hash of a calibration found wrong.")
    ] = "",
    since: Annotated[
        datetime | None,
        typer.Option(
            "--since", help="Since when it was wrong.", formats=["%Y-%m-%d", "%Y-%m-%dT%H:%M"]
        ),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the recall to this file, sealed.")
    ] = None,
    pdf_file: Annotated[
        Path | None, typer.Option("--pdf", help="Write the recall report to this file.")
    ] = None,
    site: Site,
) -> None:
    """Recall the archived jobs that a finding touches, wherever they were measured.

    Jobs of calibrations in doubt by the histories given are recomputed; jobs that used a wrong
    artefact, tip or calibration whose history is not here CANNOT BE KNOWN. Ends with 0 where all
    verdicts hold, else with 1.
    """
    from ocmm_core.calibration.records import default_folder
    from ocmm_core.inspection.archive import Outcome
    from ocmm_shop.archive.stores import open_archive
    from ocmm_shop.archiving import archive_place
    from ocmm_shop.recalls import ArchiveFinding, ShopPlaces, decide_archived, recall_archive

    place = archive_place(archive)
    if place is None:
        raise InputError(
            "archive.off",
            "The archive is off.",
            "Turn it on: ocmm settings set archive.address local, or give --archive.",
        )
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
    console = make_console()
    with progress_line() as tell:
        record = recall_archive(places, datetime.now(UTC), tell, site, finding)
    if who and record.jobs:
        with open_archive(place.address, password=place.password) as opened:
            record, _ = decide_archived(opened, record, who, datetime.now(UTC))
    show_recall(console, record)
    write_recall(console, record, json_file, pdf_file)
    if record.count(Outcome.CHANGES) + record.count(Outcome.UNKNOWN) or record.unread:
        raise typer.Exit(1)

"""``ocmm calibrate boards``, ``bundle`` and ``pictures``; `ocmm.commands` names first and last."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.calibrate._setup import ProbeChoice

if TYPE_CHECKING:
    from collections.abc import Callable

    from ocmm_boards import Board, BoardViews, Recordings
    from ocmm_cli.calibrate._run import TerminalSite
    from ocmm_core.calibration.guided import Shot
    from ocmm_core.calibration.probe_design import Temperature


@dataclass(frozen=True, slots=True)
class BundleChoice:
    """Options that name recordings next to the views of a board."""

    bar: Path | None
    sweep: Path | None
    placements: Path | None
    shots: Path | None


def calibrate_boards(
    *,
    patterns: Annotated[list[str], typer.Argument()],
    board: Path,
    corners: Path | None,
    pictures: Path | None,
    rig: Path,
    calibrations: Path | None,
    who: str,
    temperature: float | None,
    temperature_u: str,
    valid_days: int,
    decision: bool | None,
    overrule: str,
) -> None:
    """Calibrate the cameras of a rig from nothing, with pictures of a board in unknown poses.

    Give one pattern of names for each camera, in the order of the rig. The text matched by * is
    the view; pictures of one view were taken at the same moment. The rig document states sensors,
    nominal focal lengths and rough places. Without a certificate of the board the scale is not
    traceable: relocate with a certified bar afterwards.
    """
    from ocmm_boards import detect_corners, load_board, read_corners
    from ocmm_cli.calibrate import open_site
    from ocmm_cli.terminal import progress_line
    from ocmm_core.acceptance import read_temperature
    from ocmm_core.calibration.records import let_pass
    from ocmm_core.errors import InputError

    site, now = open_site(rig, calibrations), datetime.now(UTC)
    warm = read_temperature(temperature, temperature_u, now)
    known = load_board(board, warm)
    # Nothing but the date: no permissible error limits the uncertainty of a board.
    let_pass(known.artefact.judge(0.0, math.inf, now, warm), force=False)
    if (corners is None) == (pictures is None):
        raise InputError(
            "boards.input",
            "Neither or both of a table of corners and a folder of pictures were given.",
            "Give --corners FILE or --pictures FOLDER.",
        )
    cameras = site.design.cameras
    if corners is not None:
        views = read_corners(corners, patterns, cameras, len(known.corners))
    else:
        assert pictures is not None  # noqa: S101 - one of both, checked above
        with progress_line() as tell:
            views = detect_corners(pictures, patterns, cameras, known, _searched(tell))
    _calibrate(site, known, views, None, now, warm, who, valid_days, decision, overrule)


def calibrate_bundle(
    *, views: Annotated[Path, typer.Argument()], board: Path, recorded: BundleChoice,
    choice: ProbeChoice, rig: Path, calibrations: Path | None, who: str,
    temperature: float | None, temperature_u: str, valid_days: int, decision: bool | None,
    overrule: str,
) -> None:  # fmt: skip
    """Calibrate the cameras with a board, a waved probe and a length bar in one adjustment.

    Give the corners that an earlier 'calibrate boards' kept, or a folder of pictures
    VIEW-SERIAL.png. Nothing may have moved between pictures and recordings. A certified bar makes
    the scale traceable without new pictures.
    """
    from ocmm_boards import Recordings, kept_views, load_board, views_in
    from ocmm_cli.calibrate import open_site
    from ocmm_cli.calibrate._steps import body_in_use_of
    from ocmm_cli.terminal import print_table_account, progress_line
    from ocmm_core.acceptance import read_temperature
    from ocmm_core.calibration.guided import load_shots
    from ocmm_core.calibration.records import let_pass, load_bar
    from ocmm_core.errors import InputError

    if recorded.sweep is None and recorded.placements is None and recorded.shots is None:
        raise InputError(
            "boards.recordings",
            "No recording and no table of shots was given.",
            "Give --sweep, --placements or --shots; a board alone: 'ocmm calibrate boards'.",
        )
    site, now = open_site(rig, calibrations), datetime.now(UTC)
    warm = read_temperature(temperature, temperature_u, now)
    known, body = load_board(board, warm), body_in_use_of("simulated", choice)
    bar = None if recorded.bar is None else load_bar(recorded.bar)
    for artefact in (known.artefact, *(() if bar is None else (bar.artefact,))):
        let_pass(artefact.judge(0.0, math.inf, now, warm), force=False)
    shots: tuple[Shot, ...] = ()
    if recorded.shots is not None:
        table = load_shots(recorded.shots, site.design, body.n_leds)
        print_table_account(table.account)
        shots = table.shots
    if views.is_dir():
        with progress_line() as tell:
            corners = views_in(views, site.design, known, _searched(tell))
    else:
        corners = kept_views(views, site.design, known)
    recordings = Recordings(body, bar, recorded.sweep, recorded.placements, shots)
    _calibrate(site, known, corners, recordings, now, warm, who, valid_days, decision, overrule)


def _searched(tell: Callable[[str, float], None]) -> Callable[[int, int], None]:
    """Return what shows the progress of the search for corners."""
    from ocmm_cli.terminal import tr

    return lambda done, of: tell(tr(f"Searched {done:d} of {of:d} pictures"), done / of)


def _calibrate(
    site: TerminalSite, board: Board, views: BoardViews, recordings: Recordings | None,
    now: datetime, temperature: Temperature | None, who: str, valid_days: int,
    decision: bool | None, overrule: str,
) -> None:  # fmt: skip
    """Calibrate, print the result, accept it if decided so, and exit with 1 if not."""
    from ocmm_boards import run_session
    from ocmm_cli.calibrate import is_yes, print_calibration, print_status
    from ocmm_cli.terminal import lead, make_console

    console = make_console()
    for sentence in views.left_out:
        console.show(sentence)
    session = run_session(
        site.design, site.store, board, views, now, who=who, temperature=temperature,
        valid_days=valid_days, force=bool(overrule),
        kept=lambda path: console.print(f"{lead('Session  ')}{path}"), recordings=recordings,
    )  # fmt: skip
    found, outcome = session.found, session.outcome
    print_calibration(console, outcome)
    console.show(
        f"{found.views:d} views; corners scatter by {found.sigma_px:.3f} px, and U grows by "
        f"{100.0 * (found.together**0.5 - 1.0):.0f} % because corners of one picture err "
        "together.",
        highlight=True,
    )
    accepted = decision
    if accepted is None and console.is_terminal:
        console.show("Accept it? [y/n] ", end="", highlight=True)
        accepted = is_yes(console.input())
    if accepted:
        session.accept(site.store, who, now, overrule)
    elif accepted is None:
        console.show("Not accepted: give --accept to put this calibration in force.")
    print_status(console, site.document, site.calibrations, now)
    if not accepted:
        raise typer.Exit(1)


def take_pictures(
    *, folder: Annotated[Path, typer.Argument()], source: str, rig: Path, views: int, every: float,
    board: Path | None,
) -> None:  # fmt: skip
    """Take pictures of a calibration board with all cameras at the same moment.

    The cameras are those of a source genicam:SERIAL,SERIAL, with a common clock (PTP). Each view
    becomes a file VIEW-SERIAL.png for each camera; a folder with views is continued. With --board,
    the corners that were found in each picture are told. Hold the board still at the end of each
    countdown. Ctrl-C ends; all pictures so far are kept.
    """
    import numpy as np

    from ocmm_boards import corner_finder, genicam_source, load_board, next_view, write_view
    from ocmm_cli.terminal import DeferredInterrupt, make_console, progress_line, tr
    from ocmm_core.camera import load_rig

    console = make_console()
    design = load_rig(rig)
    known = None if board is None else load_board(board)
    find = None if known is None else corner_finder(known)
    cameras = genicam_source(source, design)
    first = next_view(folder)
    interrupt = DeferredInterrupt(tr("All pictures so far are kept."))
    try:
        cameras.open()
        for number in range(first, first + views):
            with progress_line() as tell:
                begun = time.monotonic()
                while (left := begun + every - time.monotonic()) > 0.0:
                    # Read meanwhile: a silent camera is told at once, and no image waits.
                    cameras.read()
                    tell(tr(f"View {number:d}: hold the board still"), 1.0 - left / every)
                    if interrupt.check():
                        return
            pictures = cameras.pictures(2.0)
            said = []
            for camera, picture in zip(design.cameras, pictures, strict=True):
                count = 0 if find is None else int(np.isfinite(find(picture)[:, 0]).sum())
                found = "" if find is None else tr(f", {count:d} corners")
                said.append(f"{camera.name}{found}")
            write_view(folder, number, design, pictures)
            console.show(f"View {number:d}: {', '.join(said)}", highlight=True)
    finally:
        cameras.close()
        interrupt.close()
    console.show(f"{views:d} views are in {folder}.")

"""Results of a calibration or verification on the terminal."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from ocmm_cli.calibrate._tip_report import print_passed, print_term
from ocmm_cli.terminal import PlainConsole, error_text, heads, lead, print_grid, tr, tr_word
from ocmm_core.calibration.guided import (
    CalibrationComparison,
    CalibrationOutcome,
    VerificationOutcome,
)
from ocmm_core.calibration.records import (
    CalibrationStatus,
    CalibrationStore,
    RecordStore,
    VerificationRecord,
    judge,
    open_calibration,
    store_folder,
)
from ocmm_core.camera import load_rig


def print_calibration(console: PlainConsole, outcome: CalibrationOutcome) -> None:
    record = outcome.record
    rows = []
    for camera, left in zip(record.cameras, outcome.residuals, strict=True):
        rms = float(np.sqrt(np.mean(left.residuals_px[left.used] ** 2)))
        rows.append((
            camera.name, str(camera.serial), f"{camera.focal:.4f}", f"{camera.u0_px:.2f}",
            f"{camera.v0_px:.2f}", f"{rms:.4f}", str(len(left.used)), str(int((~left.used).sum())),
        ))  # fmt: skip
    columns = heads("Camera", "Serial", "f", "u0", "v0", "RMS px", "Spots", "Left out")
    print_grid(console, columns, rows, f"{record.rig}: {record.method}")
    console.show_line(
        f"Residuals {record.rms_px:.4f} px RMS, chi-square {record.chi2_per_dof:.2f} per "
        f"degree of freedom, {record.points} points or poses."
    )
    if record.outliers:
        shown = ", ".join(record.outliers[:5])
        more = tr(f" and {len(record.outliers) - 5:d} more") if len(record.outliers) > 5 else ""
        console.show_line(f"Left out: {shown}{more}.")
    if len(outcome.errors_world):
        x, y, z = 1e3 * np.sqrt(np.mean(outcome.errors_world**2, axis=0))
        console.show_line(
            f"Errors at {len(outcome.errors_world)} control places: {x:.1f}, {y:.1f}, {z:.1f} "
            "um RMS per axis."
        )
    for warning in outcome.warnings:
        console.print(error_text(warning), style="yellow")
    if outcome.comparison is not None:
        _print_comparison(console, outcome.comparison)


def print_verification(console: PlainConsole, outcome: VerificationOutcome) -> None:
    record = outcome.record
    rows = []
    for index, check in enumerate(record.checks):
        rows.append((
            check.name, f"{check.certified_mm:.4f}", f"{check.measured_mm:.4f}",
            f"{1e3 * check.error_mm:+.1f}", f"{1e3 * check.expanded_mm:.1f}",
            f"{1e3 * check.limit_mm:.1f}",
            Text(tr_word("FAILED"), "bold red") if index in outcome.failed else "",
        ))  # fmt: skip
    columns = heads("Check", "Certified", "Measured", "E um", "U um", "Limit um")
    print_grid(console, (*columns, ""), rows, tr_word("Verification"))
    if outcome.failed:
        console.show_line(f"Failed   {len(outcome.failed)} of {len(record.checks)} checks")
    for old in record.superseded:
        console.show_line(
            f"First    {old.name}: E = {1e3 * old.error_mm:+.1f} um, limit "
            f"{1e3 * old.limit_mm:.1f} um; repeated."
        )
    worst = record.checks[outcome.largest]
    where = tr("Farthest beyond") if outcome.failed else tr("Nearest to")
    console.show_line(
        f"{where} its limit: {worst.name}, E = {1e3 * worst.error_mm:+.1f} um, "
        f"U = {1e3 * worst.expanded_mm:.1f} um, limit {1e3 * worst.limit_mm:.1f} um."
    )
    console.print_line(f"{tr_word('Rule')}: {tr(record.rule)}.")
    _print_session(console, record)
    for warning in outcome.warnings:
        console.print(error_text(warning), style="yellow")
    if record.passed and outcome.due_utc:
        print_term(console, outcome.due_utc)
    print_passed(console, passed=record.passed)


def _print_session(console: PlainConsole, record: VerificationRecord) -> None:
    reached = sum(one.reached for one in record.corners)
    console.show_line(f"Corners  {reached} of {len(record.corners)} reached")
    for corner in record.corners:
        if not corner.reached:
            why = corner.reason or tr("no reason given")
            console.print_line(f"         {corner.name}: {tr('not reached')}, {why}")
    for seat in record.repeats:
        shift = 1e3 * float(np.linalg.norm(seat.shift_mm))
        console.show_line(
            f"Repeat   {seat.place} moved by {shift:.1f} um: normalised square "
            f"{seat.square:.1f}, limit {seat.limit:.1f}"
        )
    for note in record.notes:
        console.print_line(f"{lead('Note     ')}{tr(note)}")
    if record.arose is not None:
        console.print_line(f"{lead('Since    ')}{tr(record.arose.sentence)}")
    for one in record.objections:
        console.print(error_text(one), style="bold red")


def print_status(console: PlainConsole, document: Path, folder: Path, now: datetime) -> bool:
    """Print the calibration in force and its state; return whether it may be used."""
    in_use = open_calibration(document, folder)
    design = load_rig(document)
    cameras = ", ".join(f"{one.name} (serial {one.serial})" for one in design.cameras)
    console.print_line(f"{lead('Rig      ')}{design.name}: {cameras}")
    console.print_line(f"{lead('         by ')}{document}")
    console.print_line(f"{lead('Folder   ')}{store_folder(folder, design.name)}")
    view = judge(in_use, now)
    console.print_line(f"{lead('State    ')}{tr_word(view.word.value)}")
    for sentence in (*([str(view.blocker)] if view.blocker else []), *view.warnings):
        console.print_line(f"         {tr(sentence)}")
    if view.since_utc:
        console.show_line(f"         Points since {view.since_utc[:19]} UTC are suspect.")
    record, store = view.record, in_use.store
    if record is not None and store is not None:
        console.show_line(
            f"Record   {store.active_hash}\n         {record.method}, {record.made_utc[:19]} "
            f"UTC by {record.made_by}, valid until {record.valid_until_utc[:10]}"
        )
        if view.word is not CalibrationStatus.UNUSABLE:
            console.print_line(f"{lead('Evidence ')}{evidence_words(store)}")
    return view.blocker is None


def evidence_words(store: RecordStore[Any], about: str | None = None) -> str:
    """Return the counts of verified files, in words."""
    wanted = store.wanted(about)
    n_events, n_records = len(store.events), sum(one.is_record for one in wanted)
    n_sessions = len(wanted) - n_records
    lost = sum(len(event.lost) for event in store.events)
    before = f"; {lost} lost earlier, see the history" if lost else ""
    events = tr(f"{n_events:d} event{'' if n_events == 1 else 's'}")
    records = tr(f"{n_records:d} record{'' if n_records == 1 else 's'}")
    sessions = tr(f"{n_sessions:d} session{'' if n_sessions == 1 else 's'}")
    return tr(f"whole: history of {events}, {records}, {sessions}{before}")


def print_history(console: PlainConsole, store: CalibrationStore) -> None:
    rows = []
    for event in store.events:
        lost = tr(f" Lost before: {', '.join(event.lost)}.") if event.lost else ""
        rows.append((
            event.utc[:19], event.calibration[:12], event.kind.value, event.who,
            f"{event.reason}{lost}",
        ))  # fmt: skip
    columns = heads("UTC", "Calibration", "What", "Who", "Reason")
    print_grid(console, columns, rows, tr_word("History"))


def _print_comparison(console: PlainConsole, found: CalibrationComparison) -> None:
    console.show_line(
        f"Against the active calibration: the frame moved by {found.moved_mm:.2f} mm and "
        f"rotated by {np.degrees(found.turned_rad):.3f} degrees."
    )
    for camera in found.cameras:
        console.show_line(
            f"  {camera.name}: additionally {camera.shift_mm:.3f} mm and "
            f"{np.degrees(camera.turn_rad):.4f} degrees, f {1e3 * camera.focal_mm:+.1f} um."
        )
    largest = 1e3 * float(np.linalg.norm(found.differences_world, axis=1).max())
    console.show_line(
        f"  With the old one, points in the volume would be up to {largest:.0f} um off; "
        f"U of a length (k = 2): {2e3 * found.length_sigma_after_mm:.1f} um "
        f"(before: {2e3 * found.length_sigma_before_mm:.1f} um)."
    )

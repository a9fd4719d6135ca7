"""Parts of a batch: one job file per part, all by the same plan, in one folder."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import files_of_folder
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.inspection.archive._stored_documents import about
from ocmm_core.inspection.session import NOT_GIVEN, header_of
from ocmm_core.names import normal_name
from ocmm_core.storage import read_summary

_LAST_NUMBER = re.compile(r"(\d+)(?!.*\d)")
SUFFIX = ".ocmm"


@dataclass(frozen=True, slots=True)
class BatchPart:
    path: Path
    serial: str
    batch: str
    operator: str
    created_utc: str
    """ISO 8601."""
    plan_identity: str
    """SHA-256."""
    points: int


def parts_of_batch(
    folder: Path, batch: str, passed_over: Callable[[OcmmError], object] = lambda fault: None
) -> tuple[BatchPart, ...]:
    """Return the parts of a batch in a folder, oldest first, also running ones.

    ``passed_over`` gets the fault of each unreadable file: a list must never prevent measuring.
    """
    found, batch = [], normal_name(batch)
    paths: list[Path] = []
    try:
        paths = files_of_folder(folder, SUFFIX)
    except OcmmError as fault:
        passed_over(fault)
    for path in paths:
        try:
            seen = read_summary(path)
            header = header_of(seen.head, seen.events)
        except OcmmError as fault:
            passed_over(about(fault, path))
            continue
        if header.batch == batch:
            found.append(
                BatchPart(
                    path,
                    header.serial,
                    header.batch,
                    header.operator,
                    seen.head.created_utc,
                    seen.head.plan_identity,
                    seen.n_points,
                )
            )
    return tuple(sorted(found, key=lambda part: part.created_utc))


def next_serial(serial: str) -> str:
    """Return the serial number with its last number incremented; InputError without one."""
    match = _LAST_NUMBER.search(serial)
    if match is None:
        raise InputError(
            "batch.serial",
            f"{serial!r} has no number to increment.",
            "Give the serial number of every part.",
        )
    digits = match.group(1)
    counted = str(int(digits) + 1).zfill(len(digits))
    return f"{serial[: match.start()]}{counted}{serial[match.end() :]}"


def require_new_serial(
    folder: Path,
    batch: str,
    serial: str,
    passed_over: Callable[[OcmmError], object] = lambda fault: None,
) -> None:
    """Raise InputError if the batch has this serial number: it would count twice in statistics.

    ``passed_over`` gets the faults of unreadable files.
    """
    if not batch or serial == NOT_GIVEN:
        return
    for part in parts_of_batch(folder, batch, passed_over):
        if part.serial == serial:
            raise InputError(
                "batch.repeated",
                f"Serial number {serial} of batch {batch} is already measured: {part.path}.",
                "Give the serial number of this part, or resume that job (Continue).",
            )

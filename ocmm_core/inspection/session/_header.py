"""Operator, serial number, order and batch: asked for before the first point."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from ocmm_core.errors import InputError
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.inspection.plan import NAME_PATTERN
from ocmm_core.storage import JobEvent, JobHead, event_value

HEADER_EVENT = "header"
"""Kind of the event that holds what the head of a job file has no place for."""

NOT_GIVEN = "-"


class _Written(msgspec.Struct, frozen=True):
    order: str = ""
    batch: str = ""


def check_header(header: JobHeader) -> None:
    """Raise InputError where a name of the header is not one that every export takes.

    Names reach other programs (`inspection.plan.NAME_PATTERN`): no formula, macro or path may hide
    in one. Only an order and a batch may be missing; ``-`` stands for an unknown serial number.
    """
    fields = {
        "operator": header.operator,
        "part": header.part,
        "serial number": header.serial,
        "order": header.order,
        "batch": header.batch,
    }
    for field, name in fields.items():
        missing = name == NOT_GIVEN or (name == "" and field in ("order", "batch"))
        if not missing and not NAME_PATTERN.fullmatch(name):
            raise InputError(
                "header.name",
                f"The {field} is {name!r}, which other programs may not accept.",
                "Use 1 to 60 letters from A to Z, digits, spaces, '_', '.' or '-', starting "
                "with a letter, a digit or '_'.",
            )


def header_text(header: JobHeader) -> str:
    """Return the text of the event: order and batch."""
    return msgspec.json.encode(_Written(header.order, header.batch)).decode()


def header_of(head: JobHead, events: Sequence[JobEvent]) -> JobHeader:
    """Return the header of a job file; StorageError where the event of it cannot be read."""
    texts = [event.text for event in events if event.kind == HEADER_EVENT]
    beside = event_value(HEADER_EVENT, texts[-1], _Written) if texts else _Written()
    return JobHeader(head.operator, head.part, head.serial, beside.order, beside.batch)

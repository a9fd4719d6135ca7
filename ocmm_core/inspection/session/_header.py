"""Operator, serial number, order and batch, entered before the first point."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.names import label_fault
from ocmm_core.storage import JobEvent, JobHead, event_value

HEADER_EVENT = "header"
"""Event for fields that the head of a job file lacks."""

NOT_GIVEN = "-"


class _Written(msgspec.Struct, frozen=True):
    order: str = ""
    batch: str = ""


def check_header(header: JobHeader) -> None:
    """Raise InputError if a name of the header is no label (`names.label_fault`).

    Only order and batch may be missing; ``-`` is an unknown serial number.
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
        if not missing and (fault := label_fault(name)):
            raise InputError(
                "header.name", f"The {field} {shortened(name)} {fault}.", f"Correct the {field}."
            )


def header_text(header: JobHeader) -> str:
    return msgspec.json.encode(_Written(header.order, header.batch)).decode()


def header_of(head: JobHead, events: Sequence[JobEvent]) -> JobHeader:
    """Return the header of a job file; StorageError if its event cannot be read."""
    texts = [event.text for event in events if event.kind == HEADER_EVENT]
    beside = event_value(HEADER_EVENT, texts[-1], _Written) if texts else _Written()
    return JobHeader(head.operator, head.part, head.serial, beside.order, beside.batch)

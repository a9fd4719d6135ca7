"""JSON values in the texts of events."""

from __future__ import annotations

from typing import TypeVar

import msgspec

from ocmm_core.documents import decode_json
from ocmm_core.errors import StorageError

T = TypeVar("T")


def event_value(kind: str, text: str, form: type[T]) -> T:
    """Return the value in the text of an event; StorageError if malformed."""
    try:
        return decode_json(text, form)
    except msgspec.MsgspecError as error:
        raise bad_event(kind, str(error)) from error


def bad_event(kind: str, why: str) -> StorageError:
    return StorageError(
        "job.event",
        f"The event '{kind}' in the job cannot be read: {why}.",
        "Open the job with the program version that wrote it.",
    )

"""Sentences on ambient readings given with a report; those in the job have priority."""

from __future__ import annotations

from collections.abc import Set as AbstractSet

from ocmm_core.export.template._template import Particulars
from ocmm_core.surroundings import QUANTITIES, reading_of

_SAID = {
    "room": lambda reading: f"Room {reading}.",
    "humidity": lambda reading: f"Humidity {reading}.",
    "pressure": lambda reading: f"Air pressure {reading}.",
}
"""Sentence of each quantity, by its field."""


def surroundings(given: Particulars, known: AbstractSet[str] = frozenset()) -> tuple[str, ...]:
    """Return the ambient readings, a sentence each, without missing ones.

    `known`: fields in a record, which override the given ones. Raises InputError if a field is no
    reading, has another unit, or an implausible number.
    """
    asked = [one for one in QUANTITIES if one.field not in known]
    read = [(one.field, reading_of(one, getattr(given, one.field))) for one in asked]
    return tuple(_SAID[field](found.words) for field, found in read if found is not None)

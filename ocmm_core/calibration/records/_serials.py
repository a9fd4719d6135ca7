"""Compare serial numbers of artefacts."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.calibration.records._records import ArtefactUse


def same_serial(one: str, other: str) -> bool:
    """Return whether serial numbers agree, ignoring case, blanks and punctuation; empty: False."""
    bare = _bare(one)
    return bool(bare) and bare == _bare(other)


def rests_on(artefacts: Sequence[ArtefactUse], serial: str) -> bool:
    """Return whether a result rests on an artefact with this serial number."""
    return any(same_serial(one.serial, serial) for one in artefacts)


def _bare(serial: str) -> str:
    return "".join(letter for letter in serial.casefold() if letter.isalnum())

"""Whether two serial numbers are that of the same artefact."""

from __future__ import annotations

from collections.abc import Sequence

from ocmm_core.calibration.records._records import ArtefactUse


def same_serial(one: str, other: str) -> bool:
    """Return whether two people wrote down the same serial number.

    Case, blanks and punctuation do not count. Without a letter or digit it is no serial number,
    and is the same as no other.
    """
    bare = _bare(one)
    return bool(bare) and bare == _bare(other)


def rests_on(artefacts: Sequence[ArtefactUse], serial: str) -> bool:
    """Return whether an artefact with a serial number is among those that a result rests on."""
    return any(same_serial(one.serial, serial) for one in artefacts)


def _bare(serial: str) -> str:
    return "".join(letter for letter in serial.casefold() if letter.isalnum())

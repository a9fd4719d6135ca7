"""Whether two serial numbers are that of the same artefact."""

from __future__ import annotations

import pytest

from ocmm_core.calibration.records import ArtefactUse, rests_on, same_serial


@pytest.mark.parametrize("other", ["B-400-1", "b-400-1", " B 400 1 ", "B4001", "b_400/1"])
def test_a_serial_number_may_be_written_otherwise(other: str) -> None:
    assert same_serial("B-400-1", other)
    assert same_serial(other, "B-400-1")
    bar = ArtefactUse(
        name="bar", serial="B-400-1", certificate="", certificate_sha256="", due_utc=""
    )
    assert rests_on((bar,), other)
    assert not rests_on((), other)


@pytest.mark.parametrize(
    ("one", "other"), [("B-400-1", "B-400-2"), ("B-400-1", "B-400"), ("", ""), ("-", "-")]
)
def test_another_artefact_or_none(one: str, other: str) -> None:
    assert not same_serial(one, other)

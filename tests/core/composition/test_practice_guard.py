"""Practice records are refused by real cameras, and every report of them reads PRACTICE."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest

from ocmm_core.calibration.records import (
    CalibrationStatus,
    CalibrationStore,
    ProbeStore,
    is_practice,
    judge,
    practice_name,
    require_real_name,
)
from ocmm_core.composition import (
    RECOMMENDED_RIG,
    STANDARD_PROBE,
    StationRequest,
    checked_for_replay,
    choose_calibration,
    choose_probe,
)
from ocmm_core.composition._calibration_choice import probe_without_practice
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.export import certificate
from ocmm_core.export.template import plain_paper
from ocmm_sim.practice import PRACTICE_TIP, Practice, practice_folder

NOW = datetime(2026, 11, 26, 8, 0, tzinfo=UTC)
_REAL, _VIRTUAL = "ethercat:eth0", "simulated"


@pytest.fixture
def practice(tmp_path: Path) -> Practice:
    made = Practice(StationRequest(resource("plans", "demo.toml"), tmp_path / "out"), tmp_path)
    made.prepare(NOW)
    return made


def test_a_calibration_of_practice_is_refused_by_real_cameras(practice: Practice) -> None:
    folder = practice.folder / "calibrations"
    virtual = choose_calibration(_VIRTUAL, RECOMMENDED_RIG, folder, uncalibrated=False)
    assert virtual.fault is None
    assert judge(virtual, NOW).word is CalibrationStatus.VALID
    real = choose_calibration(_REAL, RECOMMENDED_RIG, folder, uncalibrated=False)
    assert real.fault is not None
    word, why = real.fault
    assert word is CalibrationStatus.UNUSABLE
    assert "PRACTICE" in why.what
    view = judge(real, NOW)
    assert view.blocker is not None, "no point is taken with it"
    # Recorded frames of real cameras are as real.
    assert checked_for_replay(virtual, "EtherCAT on eth0").fault is not None
    assert checked_for_replay(virtual, "simulated (recommended, seed 3)").fault is None


def test_a_tip_of_practice_is_refused_by_a_real_probe(practice: Practice) -> None:
    folder = practice.folder / "probes"
    virtual = choose_probe(_VIRTUAL, STANDARD_PROBE, folder, None, uncalibrated=False)
    assert virtual.fault is None
    assert virtual.tip == PRACTICE_TIP
    real = choose_probe(_REAL, STANDARD_PROBE, folder, None, uncalibrated=False)
    assert real.fault is not None
    assert "PRACTICE" in real.fault[1].what


def test_a_practised_qualification_of_a_real_probe_is_refused_too(practice: Practice) -> None:
    folder = practice.folder / "probes"
    found = choose_probe(_VIRTUAL, STANDARD_PROBE, folder, None, uncalibrated=False)
    assert found.records is not None
    real = msgspec.structs.replace(found.records.calibration, made_by="Ann")
    mixed = replace(found, records=replace(found.records, calibration=real))
    assert probe_without_practice(mixed).fault is not None


def test_its_papers_say_practice(practice: Practice) -> None:
    paper = plain_paper()
    for folder, tip, calibration in (
        (practice.cameras, "", False), (practice.cameras, "", True),
        (practice.probe, PRACTICE_TIP, False),
    ):  # fmt: skip
        made = certificate.certificate_of_folder(folder, paper, tip, calibration=calibration)
        assert made.title.startswith("PRACTICE: ")
        facts = " ".join(str(fact) for fact in certificate.certificate_facts(made))
        assert "valid for nothing" in facts


def test_practice_has_folders_of_its_own_and_prepares_them_once(practice: Practice) -> None:
    assert "practice" in str(practice_folder())
    cameras, probe = CalibrationStore(practice.cameras), ProbeStore(practice.probe)
    count = len(cameras.events), len(probe.events)
    practice.prepare(NOW)
    assert (len(CalibrationStore(practice.cameras).events),
            len(ProbeStore(practice.probe).events)) == count  # fmt: skip
    assert all(is_practice(event.who) for event in (*cameras.events, *probe.events))


@pytest.mark.parametrize("who", ["PRACTICE: Ann", "practice", "  Practice of Ann "])
def test_nobody_signs_for_practice_by_mistake(who: str) -> None:
    assert is_practice(who)
    with pytest.raises(InputError, match="stands for practice"):
        require_real_name(who)
    assert practice_name(who) == who.strip()
    assert practice_name("Ann") == "PRACTICE: Ann"
    assert practice_name("  ") == ""
    assert require_real_name("Ann Practice") == "Ann Practice"

"""The conformance test: it passes the good camera and finds every bug that firmware could have."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ocmm_bench.conform import (
    RULES,
    CameraOutcome,
    ConformanceReport,
    RuleVerdict,
    conform,
    conformance_page,
    conformance_text,
    find_place,
)
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.device import PRODUCT_CODE, REVISION, CameraIdentity, Firmware
from ocmm_sim.bus import Unit
from ocmm_sim.firmware import maker_key
from ocmm_sim.slave import TestPattern
from tests.core.fieldbus.conform_lines import TimedLine, software_line
from tests.core.fieldbus.firmware_bugs import BUGS, Bug

SERIAL = 1001
CODES = [rule.code for rule in RULES]


def good_unit() -> Unit:
    return Unit(0, CameraIdentity("left", SERIAL, 7), TestPattern())


def new_firmware() -> bytes:
    content = np.random.default_rng(3).bytes(3000)
    return Firmware("3.1.0", PRODUCT_CODE, (REVISION, REVISION), content).signed(maker_key())


@pytest.fixture(scope="module")
def good() -> ConformanceReport:
    return conform(software_line(good_unit()), firmware=new_firmware())


def test_the_good_camera_is_green(good: ConformanceReport) -> None:
    broken = [(each.code, each.complaints) for each in good.results if each.complaints]
    assert not broken
    assert good.outcome is CameraOutcome.GREEN
    assert [each.code for each in good.results] == CODES
    assert all(each.checked for each in good.results)
    assert (good.serial, good.alias, good.firmware) == (SERIAL, 7, "3.1.0")


@pytest.mark.parametrize("code", CODES)
def test_the_good_camera_passes_each_rule_on_its_own(code: str) -> None:
    # Otherwise state left by the previous rule could reveal the bug.
    rules = tuple(rule for rule in RULES if rule.code == code)
    report = conform(software_line(good_unit()), firmware=new_firmware(), rules=rules)
    assert report.outcome is CameraOutcome.GREEN, report.results[0].complaints


@pytest.mark.parametrize("bug", BUGS, ids=lambda bug: bug.name)
def test_a_bug_of_the_firmware_is_found_by_its_rule(bug: Bug) -> None:
    unit = good_unit()
    bug.plant(unit.camera)
    rules = tuple(rule for rule in RULES if rule.code == bug.rule)
    report = conform(software_line(unit), firmware=new_firmware(), rules=rules)
    (result,) = report.results
    late = [sheet.name for sheet in report.timings if not sheet.kept]
    assert report.outcome is CameraOutcome.RED
    assert result.complaints or late


def test_there_are_enough_bugs_and_each_rule_finds_one() -> None:
    assert len({bug.name for bug in BUGS}) == len(BUGS) >= 50
    assert {bug.rule for bug in BUGS} == set(CODES)


def test_without_firmware_the_test_is_incomplete_and_says_so() -> None:
    rules = tuple(rule for rule in RULES if rule.section == "Firmware")
    report = conform(software_line(good_unit()), rules=rules)
    assert report.outcome is CameraOutcome.INCOMPLETE
    (left_out,) = [each for each in report.results if each.verdict is RuleVerdict.NOT_TESTED]
    assert "--firmware" in left_out.complaints[0]
    assert report.firmware == "3.0.0"


def test_the_report_is_text_json_and_a_page(good: ConformanceReport) -> None:
    text, page = conformance_text(good), conformance_page(good)
    content = json.loads(good.to_json())
    assert content["outcome"] == "GREEN"
    assert content["format"] == "ocmm.conformance/1"
    assert len(content["results"]) == len(RULES)
    for each in good.results:
        assert each.code in text
        assert each.code in page
    for sheet in good.timings:
        assert sum(sheet.counts) == sheet.count
        assert sheet.name in text
        assert sheet.name in page
    # The report must be complete in a mail or an archive.
    assert "http" not in page


def test_what_a_camera_says_cannot_become_markup() -> None:
    unit = good_unit()
    unit.camera.coe.set_value(0x100A, 0, b"<b>1")
    unit.camera.coe.set_value(0x9010, 1, b"<b>1")
    rules = tuple(rule for rule in RULES if rule.code == "object.identity")
    page = conformance_page(conform(software_line(unit), rules=rules))
    assert "<b>1" not in page
    assert "&lt;b&gt;1" in page


def test_the_camera_is_found_by_its_serial_number() -> None:
    line = software_line(good_unit())
    assert find_place(line, 0) == find_place(line, SERIAL) == 0
    with pytest.raises(BusError, match="serial numbers on the bus: 1001"):
        find_place(line, 4711)


def test_what_breaks_while_the_computer_pauses_is_tried_again() -> None:
    rules = tuple(rule for rule in RULES if rule.code == "eeprom.identity")
    unit = good_unit()
    unit.camera.esc._sii[28:32] = bytes(4)  # noqa: SLF001 - a bug
    line = software_line(unit)
    # Asked before and after each try; the last one is popped first.
    line.pauses_ns = [0, 0, 30_000_000, 0]
    report = conform(line, rules=rules)
    assert report.outcome is CameraOutcome.RED
    line.pauses_ns = [30_000_000, 0, 30_000_000, 0, 30_000_000, 0]
    (result,) = conform(line, rules=rules).results
    assert result.verdict is RuleVerdict.NOT_TESTED
    assert result.complaints[0].startswith("This computer paused for 30 ms")


def test_a_camera_that_stops_answering_ends_the_test_in_a_sentence() -> None:
    unit, frames = good_unit(), [0]
    whole = software_line(unit)

    def process(frame: bytearray, now_ns: int) -> bool:
        frames[0] += 1
        return frames[0] < 3000 and whole._process(frame, now_ns)  # noqa: SLF001 - the same camera

    with pytest.raises(BusError, match="No camera answers"):
        conform(TimedLine(process, whole._idle))  # noqa: SLF001 - the same camera

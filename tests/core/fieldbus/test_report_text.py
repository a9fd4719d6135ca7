"""The report of the bus in words: shares that add up, the wire, and a text for support."""

from __future__ import annotations

from datetime import UTC, datetime

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocmm_core.build import build_version
from ocmm_core.fieldbus.report import (
    EDGES_US,
    Alarm,
    BusEvent,
    BusPhase,
    BusReport,
    CameraReport,
    Histogram,
    Link,
    microseconds,
    pace_words,
    report_text,
    shares,
    trouble_words,
    wire_picture,
    within_us,
)

NOON = datetime(2026, 3, 4, 12, 0, 0, tzinfo=UTC)
NONE = Histogram(edges_us=EDGES_US, counts=(0,) * 12)


def camera(name: str, position: int, state: str = "OP") -> CameraReport:
    serial = 1000 + len(name)
    return CameraReport(name=name, serial=serial, alias=1, position=position, state=state)


def report(*cameras: CameraReport, **changes: object) -> BusReport:
    plain = BusReport(
        interface="eth1", phase=BusPhase.OPERATION, cameras=cameras, cycle_period_ns=1_000_000,
        frame_period_ns=125_000, lateness=NONE, round_trip=NONE,
    )  # fmt: skip
    return msgspec.structs.replace(plain, **changes)


def test_only_a_virtual_bus_has_a_pace_and_a_slow_one_says_so() -> None:
    assert pace_words(None) == pace_words(1.0) == pace_words(0.95) == ""
    slow = "Virtual bus at 0.40 of real time: this computer is too slow for 1.0."
    assert pace_words(0.4) == slow
    real = report_text(report(camera("left", 1)), rig="thesis", written=NOON)
    assert "pace" not in real
    virtual = report_text(report(camera("left", 1), pace=0.4), rig="thesis", written=NOON)
    assert f"pace       {0.4:>12.2f}  of real time" in virtual
    assert "waits for this computer, so no cycle is late" in virtual


def test_a_bus_of_which_nothing_is_known_yet_has_counted_nothing() -> None:
    told = report_text(report(), rig="thesis", written=NOON)
    assert "drift of the bus clock   +0.00 ppm" in told
    begun = report()
    assert (begun.elapsed, begun.good, begun.late, begun.lost, begun.bad) == (0,) * 5
    assert (begun.stray_answers, begun.recoveries, begun.clock_phase_ns) == (0,) * 3


@given(st.lists(st.integers(0, 10**12), min_size=1, max_size=6), st.integers(0, 4))
def test_shares_add_up_and_are_nearly_right(counts: list[int], decimals: int) -> None:
    given_shares = shares(counts, decimals)
    total = sum(counts)
    expected = 100 * 10**decimals if total else 0
    assert sum(round(share * 10**decimals) for share in given_shares) == expected
    for share, count in zip(given_shares, counts, strict=True):
        # The method of the largest remainder is less than one step off.
        assert abs(share - (100.0 * count / total if total else 0.0)) < 1.001 * 10.0**-decimals


def test_the_wire_is_drawn_in_the_order_of_the_wire() -> None:
    wire = wire_picture(report(camera("a", 2), camera("bb", 1)))
    assert [c.name for c in wire.cameras] == ["bb", "a"]
    assert wire.links == (Link.WHOLE, Link.WHOLE)
    assert wire.redundancy is None


@pytest.mark.parametrize(
    ("cameras", "links", "words"),
    [
        (
            (camera("a", 1), camera("b", 0, "-"), camera("c", 0, "-")),
            (Link.WHOLE, Link.BROKEN, Link.UNKNOWN),
            "Broken behind 'a': 'b' and 'c' do not answer.",
        ),
        (
            (camera("a", 0, "-"), camera("b", 0, "-")),
            (Link.BROKEN, Link.UNKNOWN),
            "Broken behind eth1: no camera answers.",
        ),
        (
            # Its place is remembered, and those behind it answer over the second cable.
            (camera("a", 1, "-"), camera("b", 2)),
            (Link.BROKEN, Link.BROKEN),
            "Broken behind eth1: 'a' does not answer.",
        ),
    ],
)
def test_a_broken_wire(
    cameras: tuple[CameraReport, ...], links: tuple[Link, ...], words: str
) -> None:
    wire = wire_picture(report(*cameras, phase=BusPhase.RECOVERING, alarm="bus.camera_missing"))
    assert wire.links == links
    assert wire.words == words


def test_before_the_first_look_nothing_is_called_broken() -> None:
    wire = wire_picture(report(camera("a", 0, "-"), phase=BusPhase.SCAN))
    assert wire.links == (Link.UNKNOWN,)
    assert "looking for cameras" in wire.words
    assert "roken" not in wire.words


@pytest.mark.parametrize("broken", [False, True])
def test_the_ring(broken: bool) -> None:
    wire = wire_picture(
        report(camera("a", 1), redundant_interface="eth2", redundancy_broken=broken)
    )
    assert wire.redundancy is (Link.BROKEN if broken else Link.WHOLE)
    assert ("open" if broken else "closed") in wire.words


def test_the_trouble_has_the_remedy_of_its_event_or_of_its_kind() -> None:
    assert trouble_words(report()) == ("", "")
    missing = report(phase=BusPhase.RECOVERING, alarm="bus.camera_missing", message="No 'a'.")
    assert trouble_words(missing) == ("No 'a'.", Alarm.CAMERA_MISSING.spec.remedy)
    told = BusEvent(
        number=1, utc_ns=0, cycle=0, code="bus.camera_missing", camera="a", what="", remedy="Look."
    )
    assert trouble_words(msgspec.structs.replace(missing, events=(told,)))[1] == "Look."
    assert trouble_words(report(phase=BusPhase.CLOCKS)) == ("Bus: setting clocks.", "")
    assert trouble_words(report(alarm="not.known", message="Odd."))[1] == ""


def test_the_edge_below_which_most_values_lie() -> None:
    counts = (0, 990, 9, 0, 0, 0, 0, 0, 0, 0, 0, 1)
    histogram = Histogram(edges_us=EDGES_US, counts=counts, worst_us=20_000.0)
    assert within_us(histogram, 0.99) == 10.0
    assert within_us(histogram, 0.999) == 20.0
    assert within_us(histogram, 1.0) is None
    assert within_us(NONE, 0.5) is None
    assert (microseconds(1000.0), microseconds(62.5)) == ("1 ms", "62.5 µs")


def test_the_text_says_everything_in_a_hundred_columns() -> None:
    event = BusEvent(
        number=7, utc_ns=1_763_712_000_250_000_000, cycle=77, code="bus.frozen", camera="left",
        what="Camera 'left' repeats old data: " + "which is told at length, " * 5,
        remedy="Switch it off and on.", cycles=3,
    )  # fmt: skip
    left = msgspec.structs.replace(
        camera("left", 1, "SAFEOP"), al_code=0x1B, al_text="watchdog", clock_offset_ns=-12,
        temperature_c=41.25, firmware="2.1", frames_lost=5,
    )  # fmt: skip
    text = report_text(
        report(
            left, camera("right", 0, "-"), elapsed=3000, good=2990, late=4, lost=5, bad=1,
            phase=BusPhase.DISTURBED, alarm="bus.frozen", message="Camera 'left' repeats old data.",
            events=(event,), events_dropped=2, notes=("No priority.",), clock_drift_ppm=-3.5,
            lateness=Histogram(edges_us=EDGES_US, counts=(3000, *(0,) * 11), worst_us=4.0),
        ),
        rig="cell 4",
        written=NOON,
    )  # fmt: skip
    assert text.endswith("\n")
    assert max(len(line) for line in text.splitlines()) <= 100
    for part in (
        f"Written        2026-03-04 12:00:00+00:00 by OCMM {build_version()}",
        "Rig            cell 4",
        "Interface      eth1",
        "Phase          disturbed",
        "Trouble        Camera 'left' repeats old data. [bus.frozen]",
        "What to do     Switch it off and on.",
        "[eth1] --- [1 left SAFEOP] -X- [right -]",
        "good, late, lost and bad add up to elapsed",
        "  lost                  5     0.167 %",
        "state SAFEOP, AL code 0x001B watchdog, firmware 2.1",
        "clock offset -12 ns, temperature 41.2 C",
        "drift of the bus clock   -3.50 ppm",
        "  <=    5 µs         3000  ########################################",
        "   7  2025-11-21 08:00:00.250  bus.frozen left  cycle 77, seen in 3",
        "  2 older ones were dropped",
        "No priority.",
    ):
        assert part in text, part


def test_cycles_without_a_verdict_are_not_hidden() -> None:
    text = report_text(report(elapsed=10, good=9), rig="r", written=NOON)
    assert "ATTENTION: 1 cycles have no verdict" in text
    assert "add up" not in text

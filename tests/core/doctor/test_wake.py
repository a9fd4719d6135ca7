"""What wake-up times and frames over a virtual cable mean, and how they are measured."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import msgspec
import pytest

from ocmm_core.doctor import (
    Light,
    LoopTimes,
    NotAskedError,
    answer_of,
    judge_loop,
    part,
    wake_check,
)
from ocmm_core.doctor._wake import WakeTimes, judge_wakes, wake_command
from tests.core.doctor.fake_computer import good_computer
from tests.host import HANG_S, on_linux_only

GOOD = WakeTimes(
    cycles=60_000, missed=30, p50_us=30.0, p99_us=60.0, p999_us=500.0, max_us=99_000.0,
    real_time=True, core=3,
)  # fmt: skip
FAST = LoopTimes(
    cycles=10_000, late=3, lost=2, p50_us=80.0, p999_us=300.0, max_us=900.0, real_time=True
)


@pytest.mark.parametrize(
    ("changes", "light", "code"),
    [
        ({}, Light.GREEN, ""),
        # Of 60,000 cycles 0.05 % are 30, and 2 % are 1200.
        ({"missed": 31}, Light.AMBER, "wake.late"),
        ({"missed": 1200}, Light.AMBER, "wake.late"),
        ({"missed": 1201}, Light.RED, "wake.very_late"),
        ({"p999_us": 500.1}, Light.AMBER, "wake.late"),
        # The watchdog of a camera.
        ({"max_us": 100_000.1}, Light.RED, "wake.very_late"),
        # Good, but so few cycles show nothing.
        ({"cycles": 9999, "missed": 0}, Light.AMBER, "wake.short"),
        # Good, but not as the bus would run.
        ({"real_time": False}, Light.AMBER, "wake.ordinary"),
    ],
)
def test_wake_ups_are_judged_by_what_they_cost(
    changes: dict[str, float], light: Light, code: str
) -> None:
    answer = judge_wakes(msgspec.structs.replace(GOOD, **changes))
    assert (answer.light, answer.code) == (light, code)
    assert bool(answer.remedy) is (light is not Light.GREEN)


@pytest.mark.parametrize(
    ("changes", "light"),
    [
        ({}, Light.GREEN),
        ({"late": 4}, Light.AMBER),
        ({"lost": 3}, Light.AMBER),
        ({"cycles": 9999, "late": 0, "lost": 0}, Light.AMBER),
        ({"late": 200}, Light.RED),
    ],
)
def test_frames_are_judged_by_how_many_missed_their_cycle(
    changes: dict[str, int], light: Light
) -> None:
    assert judge_loop(msgspec.structs.replace(FAST, **changes)).light is light


def test_parts_of_ordered_times() -> None:
    times = list(range(1000, 1_001_000, 1000))
    assert (part(times, 0.0), part(times, 0.5), part(times, 0.999)) == (1.0, 501.0, 1000.0)
    assert part(times, 1.0) == 1000.0
    assert part([7000], 0.5) == 7.0


@on_linux_only
def test_this_computer_is_measured_in_a_process_of_its_own(tmp_path: Path) -> None:
    answer = wake_check(0.2).check(good_computer(tmp_path))
    assert answer.figures["cycles"] == 200.0
    assert 0.0 < answer.figures["p50_us"] <= answer.figures["p999_us"] <= answer.figures["max_us"]


def test_it_is_measured_by_the_program_that_is_the_bus_process() -> None:
    granted = ["/opt/python-ocmm", "-I", "-m", "ocmm_core.acquisition.bus_process._start"]
    asked = ["-m", "ocmm_core.doctor._wake", "2.0", "3"]
    assert wake_command(granted, 2.0, 3) == ["/opt/python-ocmm", "-I", *asked]
    assert wake_command([sys.executable, "-I", "-m", "x"], 2.0, 3) == [sys.executable, *asked]
    # Installed from a package, which contains no modules.
    installed = "/opt/ocmm/ocmm-acq"
    assert wake_command([installed], 2.0, -1) == [installed, "--wake", "2.0", "-1"]


@on_linux_only
def test_who_measures_has_memory_left_when_all_of_it_is_locked() -> None:
    """A minute of times needs more memory than most computers allow to lock."""
    program = (
        "from ocmm_core.doctor._wake import measure_wakes\n"
        "measure_wakes(0.05, -1)\n"
        "print(len(bytearray(64 << 20)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=HANG_S, check=False
    )
    assert done.stdout.strip() == str(64 << 20), done.stderr


def test_what_is_not_measured_says_so(tmp_path: Path) -> None:
    with pytest.raises(NotAskedError, match="Not measured"):
        wake_check(0.0).check(good_computer(tmp_path))


@pytest.mark.parametrize(
    "program",
    [
        "print('{}')",
        "print('x' * 100000)",
        "import sys; sys.stdout.buffer.write(bytes(range(256)))",
        "import sys; sys.exit('no \x1b[2J such thing')",
        "import os; os.kill(os.getpid(), 9)",
    ],
)
def test_a_process_that_answers_nothing_sensible_is_not_believed(program: str) -> None:
    with pytest.raises(NotAskedError, match="could not be measured") as told:
        answer_of([sys.executable, "-I", "-c", program], 1.0, WakeTimes)
    assert told.value.what.isprintable()

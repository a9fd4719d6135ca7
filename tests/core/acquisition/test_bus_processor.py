"""The bus process stays on one processor: the last one, or that on which it was started."""

from __future__ import annotations

import os

import pytest

from ocmm_core.acquisition.bus_process._rights import take_processor


@pytest.mark.parametrize(
    ("allowed", "online", "moved_to", "said"),
    [
        ({0, 1, 2, 3}, 4, [3], None),
        # isolcpus=3 and no service: isolated processors are left to explicitly placed programs.
        ({0, 1, 2, 4, 5}, 6, [5], None),
        # isolcpus=3, and CPUAffinity=3 of the service.
        ({3}, 4, None, None),
        ({0, 1}, 2, None, "no dedicated processor: this computer has only 2"),
        ({0}, 1, None, "no dedicated processor: this computer has only 1"),
    ],
)
def test_where_the_bus_process_stays(
    monkeypatch: pytest.MonkeyPatch,
    allowed: set[int],
    online: int,
    moved_to: list[int] | None,
    said: str | None,
) -> None:
    moved: list[list[int]] = []
    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: allowed)
    monkeypatch.setattr(os, "sched_setaffinity", lambda _pid, cores: moved.append(list(cores)))
    monkeypatch.setattr(os, "cpu_count", lambda: online)
    assert take_processor() == said
    assert moved == ([] if moved_to is None else [moved_to])


def test_a_processor_that_was_asked_for_is_taken_or_named(monkeypatch: pytest.MonkeyPatch) -> None:
    moved: list[list[int]] = []

    def move(_pid: int, cores: list[int]) -> None:
        if cores == [9]:
            raise OSError(22, "Invalid argument")
        moved.append(list(cores))

    monkeypatch.setattr(os, "sched_getaffinity", lambda _pid: {0, 1})
    monkeypatch.setattr(os, "sched_setaffinity", move)
    # Also one that is isolated, and on a computer with few of them.
    assert take_processor(3) is None
    assert moved == [[3]]
    assert take_processor(9) == "processor 9 cannot be used; the bus process runs on 0, 1"


def test_the_processor_of_this_computer_is_really_taken() -> None:
    before = os.sched_getaffinity(0)
    try:
        chosen = max(before)
        assert take_processor(chosen) is None
        assert os.sched_getaffinity(0) == {chosen}
        assert take_processor(1 << 40) is not None
        assert os.sched_getaffinity(0) == {chosen}
    finally:
        os.sched_setaffinity(0, before)

"""The bus process stays on one processor: the last one, or that on which it was started."""

from __future__ import annotations

import os

import pytest

from ocmm_core.acquisition.bus_process._realtime import take_processor


@pytest.mark.parametrize(
    ("allowed", "online", "moved_to", "said"),
    [
        ({0, 1, 2, 3}, 4, [3], None),
        # isolcpus=3 and no service: what is isolated is left to whoever is put there.
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

"""A ring with a redundancy cable: tolerated breaks, and messages about the others."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.host import HANG_S, private_network

# Two processes must answer each other within a millisecond: not in parallel with other tests.
pytestmark = pytest.mark.timing

_PROGRAM = Path(__file__).with_name("ring_scenarios.py")
_ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def played() -> dict[str, Any]:
    prefix = private_network()
    done = subprocess.run(
        [*prefix, sys.executable, "-W", "error", str(_PROGRAM)],
        capture_output=True,
        text=True,
        timeout=HANG_S,
        check=False,
        env={**os.environ, "PYTHONPATH": str(_ROOT)},
    )
    assert done.returncode == 0, done.stderr
    seen: dict[str, Any] = json.loads(done.stdout)
    return seen


@pytest.mark.parametrize("name", ["whole", "repaired", "both whole", "whole again"])
def test_a_whole_ring_measures(played: dict[str, Any], name: str) -> None:
    seen = played[name]
    assert seen["operation"], seen["message"]
    assert seen["frames"] > 0
    assert seen["wrong"] == 0
    assert not seen["broken"]


@pytest.mark.parametrize("name", ["first cable", "second cable"])
def test_a_broken_cable_at_an_end_is_survived_and_reported(
    played: dict[str, Any], name: str
) -> None:
    seen = played[name]
    assert seen["operation"], seen["message"]
    assert seen["frames"] > 0
    assert seen["wrong"] == 0
    assert seen["broken"]
    assert "bus.redundancy" in seen["reported"]


def test_a_break_between_cameras_stops_and_names_the_cable(played: dict[str, Any]) -> None:
    # Their clocks cannot be kept together, so frames would be joined wrongly.
    seen = played["between the cameras"]
    assert not seen["operation"]
    assert (seen["frames"], seen["wrong"]) == (0, 0)
    assert "behind camera 1" in seen["message"]

"""``ocmm bus watch``: the report of a whole virtual bus, on the terminal and in a file."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.host import HANG_S, private_network

# The bus must keep its cycle to be in operation at the end.
pytestmark = pytest.mark.timing


def watch(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "ocmm_cli", "bus", "watch", *arguments],
        capture_output=True, text=True, timeout=HANG_S, check=False,
    )  # fmt: skip


def test_it_prints_what_it_writes(tmp_path: Path) -> None:
    private_network()
    path = tmp_path / "report.txt"
    done = watch(
        "--source", "ethercat:virtual", "--seconds", "4", "--every", "1", "--out", str(path)
    )
    assert done.returncode == 0, done.stderr
    text = path.read_text(encoding="utf-8")
    assert text.startswith("OCMM bus report\n")
    assert text in done.stdout
    assert done.stdout.count("OCMM bus report") >= 2
    assert "[1 left OP] --- [2 right OP]" in text
    assert "good, late, lost and bad add up to elapsed" in text
    assert "bus.operation" in text


def test_a_bus_that_does_not_start_is_reported_too() -> None:
    done = watch("--source", "ethercat:nope0", "--seconds", "5")
    assert done.returncode == 2
    assert "Phase          failed" in done.stdout
    assert "nope0" in done.stderr
    assert "Traceback" not in done.stderr


def test_what_is_no_bus_has_no_report() -> None:
    done = watch("--source", "simulated")
    assert done.returncode == 2
    assert "is not a camera bus" in done.stderr

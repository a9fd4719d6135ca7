"""The next part is measured only after a person asked for it."""

from __future__ import annotations

import io

import pytest

from ocmm_cli.measure import await_part
from ocmm_cli.terminal import PlainConsole
from ocmm_core.errors import MeasuringError


def ask(said: str, monkeypatch: pytest.MonkeyPatch, *, replayed: bool = False) -> str:
    monkeypatch.setattr("sys.stdin", io.StringIO(said))
    console = PlainConsole(file=io.StringIO(), width=200)
    await_part(console, 2, 5, "[A]-02", replayed=replayed)
    shown = console.file
    assert isinstance(shown, io.StringIO)
    return shown.getvalue()


def test_enter_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = ask("\n", monkeypatch)
    assert "Part 2 of 5 is next, serial [A]-02. Put it in place" in shown
    assert "Enter: measure it" in shown
    assert "restarts from the beginning" in ask("\n", monkeypatch, replayed=True)


@pytest.mark.parametrize("said", ["q\n", " Q \n", "no\n", "Nein\n", ""])
def test_anything_that_means_no_ends_here(said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(MeasuringError) as caught:
        ask(said, monkeypatch)
    assert caught.value.code == "measure.parts_left"
    assert "--serial [A]-02 --parts 4" in caught.value.remedy

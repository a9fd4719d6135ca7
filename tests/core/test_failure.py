"""The boundary itself: expected errors pass, all others are named and logged."""

from __future__ import annotations

import ast
import re
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from psygnal import Signal

from ocmm_core.errors import InputError, InternalError, OcmmError
from ocmm_core.failure import MOST_LOGS, ThreadNet, contained, described, log_folder
from ocmm_core.wording import load_translation
from tests.sources import parsed_with


def _raised(error: Exception) -> Exception:
    try:
        raise error
    except Exception as caught:
        return caught


def test_what_is_expected_passes_unchanged() -> None:
    error = InputError("x", "The plan is empty.", "Add a feature.")
    assert contained(error, "The part") is error


def test_what_nobody_foresaw_is_named_with_its_place_and_written_down() -> None:
    told = contained(_raised(ValueError("bad\n  shape.")), "The part", "Nothing is lost.")
    assert isinstance(told, InternalError)
    assert re.fullmatch(
        r"The part failed: ValueError: bad shape \(test_failure.py, line \d+\)\.", told.what
    )
    found = re.fullmatch(r"Nothing is lost\. Try again\. Log for support: (.+)", told.remedy)
    assert found is not None
    path = Path(found[1])
    assert path.parent == log_folder()
    assert "Traceback (most recent call last)" in path.read_text("utf-8")
    assert contained(told, "Another boundary") is told


def test_a_description_writes_nothing() -> None:
    before = set(log_folder().glob("*"))
    described(_raised(ValueError("x")), "The part")
    assert set(log_folder().glob("*")) == before


def test_a_listener_is_not_taken_for_who_emitted() -> None:
    class Emitter:
        heard = Signal(int)

    def listener(number: int) -> None:
        raise LookupError("no such place")

    emitter = Emitter()
    emitter.heard.connect(listener)
    with pytest.raises(Exception, match="no such place") as caught:
        emitter.heard.emit(1)
    told = contained(caught.value, "A listener")
    assert told.what.startswith("A listener failed: LookupError: no such place (test_failure.py")


class _MuteError(Exception):
    def __str__(self) -> str:
        msg = "no words"
        raise RuntimeError(msg)


@pytest.mark.parametrize("error", [MemoryError(), _MuteError()])
def test_an_exception_without_words_is_told_all_the_same(error: Exception) -> None:
    assert type(error).__name__ in contained(_raised(error), "The part").what


def test_a_disk_that_takes_nothing_is_told_and_raises_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    told = contained(_raised(ValueError("x")), "The part")
    assert "The log could not be written" in told.remedy


def test_old_logs_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    for number in range(MOST_LOGS + 3):
        last = contained(_raised(ValueError(f"number {number}")), "The part")
    kept = list(log_folder().glob("*"))
    assert len(kept) == MOST_LOGS
    assert last.remedy.rpartition(": ")[2] in map(str, kept)


def test_a_thread_without_a_boundary_is_caught() -> None:
    told: list[OcmmError] = []
    before = threading.excepthook
    with ThreadNet(told.append) as net:
        thread = threading.Thread(target=lambda: 1 // 0, name="lonely")
        thread.start()
        thread.join()
    assert threading.excepthook is before
    assert [error.what.partition(" (")[0] for error in told] == [
        "The thread lonely failed: ZeroDivisionError: integer division or modulo by zero"
    ]
    assert net.caught == told


_PLACES = {"contained": 1, "described": 1, "_tell_failure": 1, "run_tasks": 2, "side_by_side": 3}


def _parts(tree: ast.AST) -> Iterator[ast.expr]:
    """Yield the names of failed parts: they enter the log."""
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name | ast.Attribute):
            called = call.func.id if isinstance(call.func, ast.Name) else call.func.attr
            place = _PLACES.get(called)
            if place is not None and len(call.args) > place:
                yield call.args[place]
            if called != "format":
                yield from (one.value for one in call.keywords if one.arg in ("named", "part"))


def test_the_log_names_what_failed_in_english_whatever_the_language() -> None:
    found, said = 0, []
    for path, tree in parsed_with(*(f"{name}(" for name in _PLACES), "named=", "part="):
        for part in _parts(tree):
            found += 1
            words = {one.id for one in ast.walk(part) if isinstance(one, ast.Name)}
            if words & {"tr_word", "lead", "error_text", "tr"}:
                said.append(f"{path}, line {part.lineno}")
    # The two of `ocmm report` and `ocmm study coverage` are among them.
    assert found > 10
    assert not said


def test_a_failure_in_reading_is_not_taken_for_the_progress_of_a_reading() -> None:
    told = "The reading of a.ocmm failed: KeyError: 'x' (b.py, line 3)."
    german = load_translation("de").translate(told)
    assert german == "Das Lesen von a.ocmm ist fehlgeschlagen: KeyError: 'x' (b.py, line 3)."

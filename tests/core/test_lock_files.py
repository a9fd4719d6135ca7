"""The lock files pin everything by hash, name no place, and agree with the list of licences."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

_REPOSITORY = Path(__file__).resolve().parents[2]
_LOCKS = ["requirements.lock", "requirements-dev.lock"]
_PIN = re.compile(
    r"^([a-z0-9-]+)==([^\s;]+)(?:[^\n]*\\\n)((?: +--hash=sha256:[0-9a-f]{64}.*\n?)*)", re.M
)


def _pins(lock: str) -> dict[str, tuple[str, int]]:
    """Return version and number of hashes by package."""
    text = (_REPOSITORY / lock).read_text()
    return {name: (version, hashes.count("--hash")) for name, version, hashes in _PIN.findall(text)}


@pytest.mark.parametrize("lock", _LOCKS)
def test_every_line_is_a_pin_or_its_hash(lock: str) -> None:
    lines = (_REPOSITORY / lock).read_text().splitlines()
    pins = _pins(lock)
    assert len(pins) == sum(bool(re.match(r"[^\s#]", line)) for line in lines)
    assert min(count for _, count in pins.values()) >= 1


@pytest.mark.parametrize("lock", _LOCKS)
def test_no_place_is_named(lock: str) -> None:
    assert not re.search(r"://| @ |file:|--index|--find-links", (_REPOSITORY / lock).read_text())


def test_development_set_holds_the_runtime_set_in_the_same_versions() -> None:
    runtime, development = (_pins(lock) for lock in _LOCKS)
    assert runtime.items() <= development.items()


def test_licences_are_listed_for_what_is_locked() -> None:
    listed = dict(
        re.findall(
            r"^\| ([a-z0-9-]+) \| (\S+) \|",
            (_REPOSITORY / "THIRD_PARTY_LICENCES.md").read_text(),
            re.M,
        )
    )
    listed.pop("package", None)
    assert listed == {
        name: version for name, (version, _) in _pins("requirements-dev.lock").items()
    }

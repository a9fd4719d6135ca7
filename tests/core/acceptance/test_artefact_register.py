from __future__ import annotations

import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import pytest

from ocmm_core.acceptance import ArtefactEntry, ArtefactRegister, load_artefact
from ocmm_core.documents import resource
from ocmm_core.errors import OcmmError
from tests.commands import Ocmm

_NOW = datetime(2026, 11, 25, tzinfo=UTC)


def _entry(**changes: object) -> ArtefactEntry:
    entry = load_artefact(resource("artefacts", "acceptance_sphere.toml"))
    return msgspec.structs.replace(entry, **changes)


def test_artefacts_are_kept_replaced_and_removed(tmp_path: Path) -> None:
    register = ArtefactRegister(tmp_path)
    register.add(_entry(), "me", _NOW)
    register.add(_entry(id="bar", kind="bar", sizes=(0.0, 100.0)), "me", _NOW)
    assert list(ArtefactRegister(tmp_path).entries) == ["virtual-sphere-25", "bar"]
    with pytest.raises(OcmmError, match="already"):
        register.add(_entry(), "me", _NOW)
    register.add(_entry(certificate="C-2"), "me", _NOW, replace=True)
    assert register.entry("virtual-sphere-25").certificate == "C-2"
    register.remove("bar", "me", _NOW)
    with pytest.raises(OcmmError, match="no artefact 'bar'"):
        register.remove("bar", "me", _NOW)
    used = register.entry("virtual-sphere-25").used()
    assert used.role == "sphere"
    assert used.sizes == (25.0,)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("id", ""),
        ("id", "../up"),
        ("serial", "-"),
        ("certificate", " "),
        ("sizes", ()),
        ("sizes", (-25.0,)),
        ("sizes", (25.0, 30.0)),
        ("expanded", 0.0),
        ("expanded", float("nan")),
        ("expanded", 2.0),
        ("expanded_per_length", -1e-6),
        ("form", -0.001),
        ("expansion", 11.5),
        ("expansion_sigma", -1e-6),
        ("temperatures", (25.0, 15.0)),
        ("due_utc", "soon"),
    ],
)
def test_a_field_that_cannot_be_meant_is_refused(field: str, value: object, tmp_path: Path) -> None:
    register = ArtefactRegister(tmp_path)
    with pytest.raises(OcmmError, match=field):
        register.add(_entry(**{field: value}), "me", _NOW)
    assert not register.path.exists()


def test_an_expired_artefact_does_not_come_in(tmp_path: Path) -> None:
    with pytest.raises(OcmmError, match="expired on 2026-11-24"):
        ArtefactRegister(tmp_path).add(_entry(due_utc="2026-11-24T00:00:00"), "me", _NOW)


def test_two_programs_that_write_lose_nothing(tmp_path: Path) -> None:
    one, other = ArtefactRegister(tmp_path), ArtefactRegister(tmp_path)
    one.add(_entry(id="a"), "me", _NOW)
    other.add(_entry(id="b"), "me", _NOW)  # read before the first one wrote
    one.add(_entry(id="c"), "me", _NOW)
    with pytest.raises(OcmmError, match="already"):
        other.add(_entry(id="c"), "me", _NOW)
    assert sorted(ArtefactRegister(tmp_path).entries) == ["a", "b", "c"]


def test_a_changed_line_is_noticed(tmp_path: Path) -> None:
    register = ArtefactRegister(tmp_path)
    register.add(_entry(), "me", _NOW)
    content = register.path.read_bytes()
    register.path.write_bytes(content.replace(b"25.0", b"26.0", 1))
    with pytest.raises(OcmmError, match="changed"):
        ArtefactRegister(tmp_path)


def test_the_register_from_the_command_line(ocmm_here: Ocmm, tmp_path: Path) -> None:
    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return ocmm_here("artefact", *words, "--folder", tmp_path)

    typed = run(
        "add", "--id", "block-20", "--kind", "gauge block", "--serial", "GB-20",
        "--laboratory", "Lab", "--certificate", "C-7", "--due", "2099-06-30", "--size", "20",
        "--U", "0.00008",
    )  # fmt: skip
    assert typed.returncode == 0, typed.stderr
    assert "block-20" in run("list").stdout
    assert "GB-20" in run("show", "block-20").stdout
    wrong = run("add", "--id", "x", "--kind", "cube")
    assert wrong.returncode == 2
    assert run("remove", "block-20").returncode == 0
    assert "No artefacts" in run("list").stdout


@pytest.mark.parametrize("empty", [False, True])
def test_reports_a_lost_register_until_it_is_entered_again(
    empty: bool, ocmm_here: Ocmm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next register keeps the loss in its first line."""
    for name in ("DATA", "STATE"):
        monkeypatch.setenv(f"XDG_{name}_HOME", str(tmp_path / name))
    path = ArtefactRegister().path
    ArtefactRegister().add(_entry(), "me", _NOW)
    path.unlink()
    if empty:
        path.touch()
    for arguments in (["list"], ["show", "virtual-sphere-25"], ["remove", "virtual-sphere-25"]):
        said = ocmm_here("artefact", *arguments)
        assert said.returncode == 2
        assert "last changed on 2026-11-25, is missing" in said.stderr
    file = str(resource("artefacts", "acceptance_sphere.toml"))
    assert ocmm_here("artefact", "add", file).returncode == 2
    again = ocmm_here("artefact", "add", file, "--replace", "--who", "A. Example")
    assert again.returncode == 0, again.stderr
    (change,) = ArtefactRegister().changes
    assert change[2].endswith("in place of the lost register of 2026-11-25")


def test_an_older_register_of_another_history_is_refused(tmp_path: Path) -> None:
    """Reading alone makes a register the newest; an older one never counts again."""
    register = ArtefactRegister()
    register.add(_entry(), "me", _NOW)
    aside = register.path.rename(tmp_path / "aside")
    later = ArtefactRegister(restarts=True)
    later.add(_entry(id="b"), "me", _NOW + timedelta(days=1))
    newest = register.path.read_bytes()
    aside.replace(register.path)
    with pytest.raises(OcmmError, match="older than the one that this station used last"):
        ArtefactRegister()
    # A register in a folder that was given, e.g. a copy for reading, is not compared.
    assert ArtefactRegister(register.path.parent).entries
    register.path.write_bytes(newest)
    assert list(ArtefactRegister().entries) == ["b"]

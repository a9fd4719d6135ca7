"""No licence in OCMM conflicts, and the stated licences are those of the packages."""

from __future__ import annotations

import ast
import re
from fnmatch import fnmatch
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import license_expression
import msgspec
import pytest

from installer.licences import Licences, Stated, licences, surprise
from installer.locks import (
    BOARDS,
    DEVELOPMENT,
    DOCS,
    OPCUA,
    PACKAGE,
    ROOT,
    RUNTIME,
    SCREEN,
    SENSORS,
    SHOP,
    STEP,
    read_lock,
)

_SHIPPED = read_lock(RUNTIME) | read_lock(STEP)
_OTHERS = (SHOP, SENSORS, BOARDS, SCREEN, OPCUA, DEVELOPMENT, PACKAGE, DOCS)
_ALL = {name: pin for lock in _OTHERS for name, pin in read_lock(lock).items()} | _SHIPPED


def test_licences_are_listed_for_what_is_locked() -> None:
    text = (ROOT / "THIRD_PARTY_LICENCES.md").read_text(encoding="utf-8")
    listed = dict(re.findall(r"^\| ([a-z0-9-]+) \| (\S+) \|", text, re.M))
    listed.pop("package")
    assert listed == {name: pin.version for name, pin in _ALL.items()}
    assert set(licences().packages) == set(_ALL)


@pytest.mark.parametrize("name", _ALL)
def test_its_licence_fits(name: str) -> None:
    assert licences().refusals(name, shipped=name in _SHIPPED) == ()


@pytest.mark.parametrize("name", _ALL)
def test_the_package_states_what_we_state(name: str) -> None:
    assert surprise(name, _ALL[name].version) == ""


def test_a_version_or_a_licence_that_we_do_not_know_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert "is locked" in surprise("numpy", "0.0")
    changed = {**licences().packages, "rich": Stated("GPL-3.0-only")}
    monkeypatch.setattr(
        "installer.licences.licences", lambda: msgspec.structs.replace(licences(), packages=changed)
    )
    assert "'MIT'" in surprise("rich", _ALL["rich"].version)


@pytest.mark.parametrize(
    ("name", "licence", "shipped", "fits"),
    [
        ("rich", "GPL-3.0-only", True, False),
        ("rich", "GPL-3.0-only", False, False),
        ("rich", "AGPL-3.0-or-later", False, False),
        ("rich", "LGPL-3.0-only", True, False),  # of Qt it fits
        ("shiboken6", "LGPL-3.0-only", True, True),
        ("shiboken6", "GPL-3.0-only", True, False),
        ("rich", "MIT OR GPL-3.0-only", True, True),  # MIT is chosen
        ("rich", "MIT AND GPL-3.0-only", True, False),
        ("rich", "(MIT OR GPL-3.0-only) AND (GPL-2.0-only OR ISC)", True, True),
        ("rich", "GPL-2.0-only WITH eCos-exception-2.0", True, False),  # of pysoem it fits
        ("pysoem", "GPL-2.0-only", True, False),  # without its exception it does not
        ("rich", "MPL-2.0", True, False),
        ("rich", "MPL-2.0", False, True),
    ],
)
def test_what_fits_and_what_does_not(name: str, licence: str, shipped: bool, fits: bool) -> None:
    known = msgspec.structs.replace(licences(), packages={name: Stated(licence)}, holds=())
    assert (known.refusals(name, shipped=shipped) == ()) is fits


def test_what_a_package_holds_must_fit_too_and_no_package_may_be_missing() -> None:
    known = licences()
    without = msgspec.structs.replace(
        known, fits=tuple(one for one in known.fits if "pysoem" not in one.packages)
    )
    assert without.refusals("pysoem", shipped=True) == ("GPL-2.0-only WITH eCos-exception-2.0",)
    assert known.refusals("no-such-package", shipped=True)


def test_every_licence_is_one_of_spdx_and_is_needed() -> None:
    known: Licences = licences()
    allowed = {*known.shipped, *known.development, *(one.licence for one in known.fits)}
    spdx = license_expression.get_spdx_licensing()
    used = set()
    for text in (*(one.licence for one in known.packages.values()),
                 *(part.licence for part in known.holds)):  # fmt: skip
        used |= set(re.split(r" AND | OR ", text))
    for text in allowed | used:
        assert not spdx.validate(text, strict=True).errors, text
    # Of alternatives those that are not chosen need not be allowed.
    assert allowed <= used
    named = [*(one.packages for one in known.fits), *(part.packages for part in known.holds)]
    assert set().union(*named) <= set(_ALL)


def test_shared_libraries_beside_a_package_are_known() -> None:
    """Those of the extra are not, when it is installed: its wheel holds twenty more (see there)."""
    for name in read_lock(RUNTIME):
        folder = Path(str(distribution(name).locate_file(f"{name.replace('-', '_')}.libs")))
        patterns = [pattern for part in licences().parts_of(name) for pattern in part.files]
        for file in folder.glob("*"):
            assert any(fnmatch(file.name, pattern) for pattern in patterns), file
        for pattern in patterns:
            assert any(folder.glob(pattern)), f"{name} has no {pattern} any more"


def test_only_modules_of_qt_under_the_lgpl_are_used() -> None:
    used = set()
    for path in (ROOT / "ocmm_gui").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_bytes())):
            names: list[str] = []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module]
                if node.module == "PySide6":
                    names = [f"PySide6.{one.name}" for one in node.names]
            elif isinstance(node, ast.Import):
                names = [one.name for one in node.names]
            used |= {name for name in names if name.split(".")[0] == "PySide6"}
    assert used <= {"PySide6", "PySide6.QtCore", "PySide6.QtGui", "PySide6.QtWidgets"}
    assert used


def test_pysoem_is_the_one_whose_soem_we_know() -> None:
    """SOEM 2 is under GPL-3.0: a pysoem with it must not come in by an upgrade."""
    assert "pysoem>=1.1.13,<1.2" in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    try:
        held = distribution("pysoem")
    except PackageNotFoundError:
        pytest.fail("pysoem is part of the run-time set")
    assert held.version.startswith("1.1.")

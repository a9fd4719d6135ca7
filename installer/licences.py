"""Licences of what the lock files name, and whether they may be in OCMM (`licences.toml`).

Licences are SPDX expressions. Of alternatives (OR) one must be allowed, of what holds together
(AND) everything; a licence with an exception is one of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from importlib.metadata import PackageMetadata, PackageNotFoundError, metadata
from pathlib import Path

import license_expression
import msgspec

from ocmm_core.documents import read_bytes

_LICENCES = Path(__file__).with_name("licences.toml")


class Fitting(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A copyleft licence that fits in the packages named, and only there."""

    licence: str
    packages: tuple[str, ...]
    reason: str


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Somebody else's code in the binaries of packages.

    Attributes
    ----------
    packages
        Whose binaries hold it.
    name
        What it is called.
    licence
        Its licence.
    files
        Patterns of its shared libraries beside the package; none where it is linked in.
    """

    packages: tuple[str, ...]
    name: str
    licence: str
    files: tuple[str, ...] = ()


class Stated(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The licence of a package.

    Attributes
    ----------
    licence
        As an SPDX expression.
    states
        What its metadata say, where that is not the expression.
    purpose
        What OCMM needs it for, or which package does.
    """

    licence: str
    states: str = ""
    purpose: str = ""


class Licences(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All of `licences.toml`; its comments explain the tables."""

    shipped: dict[str, str]
    fits: tuple[Fitting, ...]
    development: dict[str, str]
    holds: tuple[Part, ...]
    packages: dict[str, Stated]

    def parts_of(self, package: str) -> tuple[Part, ...]:
        """Return the foreign parts in the binaries of a package."""
        return tuple(part for part in self.holds if package in part.packages)

    def refusals(self, package: str, *, shipped: bool) -> tuple[str, ...]:
        """Return the licences of a package, or of its parts, that are forbidden in OCMM."""
        if package not in self.packages:
            return ("no licence is stated",)
        expressions = (
            self.packages[package].licence,
            *(part.licence for part in self.parts_of(package)),
        )
        allowed = {
            *self.shipped,
            *(one.licence for one in self.fits if package in one.packages),
            *(() if shipped else self.development),
        }
        return tuple(text for text in expressions if not _is_allowed(text, allowed))


@cache
def licences() -> Licences:
    """Return the content of `licences.toml`."""
    return msgspec.toml.decode(read_bytes(_LICENCES), type=Licences)


def surprise(package: str, version: str) -> str:
    """Return what an installed package says otherwise than we; empty where it is not installed.

    Parameters
    ----------
    package
        Its name.
    version
        What the lock file says.
    """
    try:
        installed = metadata(package)
    except PackageNotFoundError:
        return ""
    if installed["Version"] != version:
        return f"version {installed['Version']} is installed, {version} is locked"
    known = licences().packages[package]
    # The file of the licence alone states it with some packages.
    stated = _stated(installed) or "none"
    if stated != (known.states or known.licence):
        return f"its metadata state the licence {stated!r}"
    return ""


def _stated(installed: PackageMetadata) -> str:
    # The second field holds the whole text with some packages.
    for field in ("License-Expression", "License"):
        for text in installed.get_all(field) or ():
            if "\n" not in text and text != "UNKNOWN":
                return str(text)
    return "; ".join(
        one.split(" :: ")[-1]
        for one in installed.get_all("Classifier") or ()
        if one.startswith("License")
    )


def _is_allowed(expression: str, allowed: set[str]) -> bool:
    parsed = _spdx().parse(expression, validate=True, strict=True)
    return any(all(one in allowed for one in choice) for choice in _choices(parsed))


def _choices(parsed: license_expression.LicenseExpression) -> Iterator[tuple[str, ...]]:
    """Yield every set of licences under which the whole may be used."""
    dnf = _spdx().dnf(parsed)
    for choice in dnf.args if isinstance(dnf, _spdx().OR) else (dnf,):
        yield tuple(map(str, choice.args)) if isinstance(choice, _spdx().AND) else (str(choice),)


@cache
def _spdx() -> license_expression.Licensing:
    return license_expression.get_spdx_licensing()

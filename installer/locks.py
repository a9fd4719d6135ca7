"""The lock files: packages, versions and hashes."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError

ROOT = Path(__file__).resolve().parents[1]
RUNTIME, STEP, SHOP, SENSORS, BOARDS, SCREEN, OPCUA, DEVELOPMENT, PACKAGE, DOCS = (
    ROOT / f"requirements{kind}.lock"
    for kind in (
        "",
        "-step",
        "-shop",
        "-sensors",
        "-boards",
        "-screen",
        "-opcua",
        "-dev",
        "-package",
        "-docs",
    )
)

_NAME = re.compile(r"([a-z0-9][a-z0-9-]*)==([^\s;]+)(?: ; [^\\]+)? \\")
_HASH = re.compile(r"    --hash=sha256:([0-9a-f]{64})(?: \\)?")
_COMMENT = re.compile(r"    #(?: via)?(?: +(.+))?")
_OURS = re.compile(r"ocmm \(pyproject\.toml(?::[a-z]+)?\)")


@dataclass(frozen=True, slots=True)
class Pin:
    """One package of a lock file.

    Attributes
    ----------
    name
        As the index writes it: lower case, with hyphens.
    version
        The one version that may be installed.
    hashes
        SHA-256 of every file that may be installed, in hexadecimal digits.
    needed_by
        The packages that ask for it; "" is OCMM itself.
    """

    name: str
    version: str
    hashes: tuple[str, ...]
    needed_by: frozenset[str]


def read_lock(path: Path) -> dict[str, Pin]:
    """Return the packages of a lock file by name.

    Raises
    ------
    InputError
        A line is neither a package with a version, nor a hash, nor a comment.
    """
    pins: dict[str, Pin] = {}
    name = version = ""
    hashes: list[str] = []
    needed_by: set[str] = set()

    def ended() -> None:
        if name:
            pins[name] = Pin(name, version, tuple(hashes), frozenset(needed_by))

    for number, line in enumerate(read_bytes(path).decode("utf-8").splitlines(), 1):
        if begun := _NAME.fullmatch(line):
            ended()
            name, version = begun.groups()
            hashes, needed_by = [], set()
        elif name and (digits := _HASH.fullmatch(line)):
            hashes.append(digits[1])
        elif name and (comment := _COMMENT.fullmatch(line)):
            if comment[1] and not comment[1].startswith("-c "):
                needed_by.add("" if _OURS.fullmatch(comment[1]) else comment[1])
        elif not line.startswith("#"):
            raise InputError(
                "lock.line",
                f"{path}: line {number} is neither a pinned package nor a hash of one.",
                "Make the lock files again: ./run lock",
            )
    ended()
    for pin in pins.values():
        if not pin.hashes:
            raise InputError(
                "lock.hash",
                f"{path}: {pin.name} has no hash.",
                "Make the lock files again: ./run lock",
            )
    return pins


def normalised(name: str) -> str:
    """Return the name of a package as lock files write it."""
    return re.sub(r"[-_.]+", "-", name).lower()

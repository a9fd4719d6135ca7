"""Checks of expiry dates, signing key, and program version.

Reads dates only and writes nothing, so it is always safe to run; ``ocmm calibrate status`` reports
whether a calibration may be used.
"""

from __future__ import annotations

import stat
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from platform import python_version

import msgspec

from ocmm_core import __version__
from ocmm_core.calibration.records import PROBE_SCHEMA, SCHEMA, TIP_SCHEMA
from ocmm_core.doctor._computer import Computer, NotAskedError
from ocmm_core.doctor._result import Answer, amber, green, red
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.seals import KEY_IN_FORCE, key_lost, memory_file, memory_folder

DUE_BEFORE = timedelta(days=14)
"""As in the records: DUE within this time before the end."""
_HASH_DIGITS = 64
_LARGEST = 8 << 20
_WORDS = {
    SCHEMA: "The calibration of the cameras of",
    PROBE_SCHEMA: "The calibration of the probe of",
    TIP_SCHEMA: "The qualification of the tip of",
}


class _Artefact(msgspec.Struct, frozen=True):
    name: str
    serial: str
    due_utc: str


class _Dates(msgspec.Struct, frozen=True):
    schema: str
    made_utc: str
    valid_until_utc: str = ""
    tip: str = ""
    artefacts: tuple[_Artefact, ...] = ()


class _File(msgspec.Struct, frozen=True):
    content: _Dates


def calibrations(computer: Computer) -> Answer:
    """Return the expiry of the latest calibrations of all rigs and probes."""
    ends = [
        (_moment(one.valid_until_utc), f"{_WORDS[one.schema]} '{name}'")
        for name, one in _newest(computer)
        if one.schema in _WORDS
    ]
    if not ends:
        return amber(
            "calibrations.none",
            f"No calibration of real cameras is stored for {computer.user}.",
            "Calibrate: ocmm calibrate cameras, then ocmm calibrate probe.",
        )
    until, what = min(ends)
    expired = red(
        "calibrations.expired", f"{what} expired on {until:%Y-%m-%d}.",
        "Calibrate again; until then every verdict is NOT PROVEN.",
    )  # fmt: skip
    due = amber(
        "calibrations.due", f"{what} ends on {until:%Y-%m-%d}.", "Calibrate before that day."
    )
    return _by_date(computer, until, expired, due, len(ends))


def certificates(computer: Computer) -> Answer:
    """Return the expiry of the certificates of artefacts used by the calibrations."""
    newest: dict[tuple[str, str], datetime] = {}
    for _, record in _newest(computer):
        for one in record.artefacts:
            key = one.name, one.serial
            # After a recalibration the later certificate counts.
            newest[key] = max(newest.get(key, _moment(one.due_utc)), _moment(one.due_utc))
    if not newest:
        raise NotAskedError(
            "No stored calibration names an artefact with a certificate.",
            "Calibrate with a certified artefact.",
        )
    (name, serial), until = min(newest.items(), key=lambda one: one[1])
    what = f"The certificate of '{name}' (serial {serial})"
    expired = red(
        "certificates.expired", f"{what} expired on {until:%Y-%m-%d}.",
        "Have it calibrated: no calibration or verification with it is accepted.",
    )  # fmt: skip
    due = amber(
        "certificates.due", f"{what} ends on {until:%Y-%m-%d}.", "Send it to be calibrated."
    )
    return _by_date(computer, until, expired, due, len(newest))


def key(computer: Computer) -> Answer:
    """Return whether the station has a key unreadable by others."""
    folder = computer.data / "keys"
    # A key in a token takes precedence over one in a file, see `seals`.
    in_token = computer.place(folder / "token.json").exists()
    path = folder / ("token.json" if in_token else "station.key")
    try:
        found = computer.place(path).lstat()
        around = computer.place(path.parent).stat()
    except FileNotFoundError:
        memory = computer.state / memory_folder().name / memory_file(KEY_IN_FORCE).name
        if computer.has(memory):
            lost = key_lost(folder)
            return red(lost.code, lost.what, lost.remedy)
        return amber(
            "key.missing",
            f"{computer.user} has no station key yet; the first record or job makes it.",
            "Make it now: ocmm key show",
        )
    except OSError as error:
        raise NotAskedError(f"{path} cannot be looked at ({error.strerror}).") from error
    if not stat.S_ISREG(found.st_mode):
        return red("key.no_file", f"{path} is no file.", "Restore it from a backup.")
    # Not repaired by --fix: an exposed key may have been copied.
    if found.st_mode & 0o077:
        return red(
            "key.readable",
            f"Other users can read the key of this station (mode {found.st_mode & 0o777:04o}).",
            f"Type chmod 600 {path}, then replace the key: ocmm key replace",
        )
    if around.st_mode & 0o022:
        return red(
            "key.folder",
            f"Other users can exchange the key of this station ({path.parent}, mode "
            f"{around.st_mode & 0o777:04o}).",
            f"Type chmod 700 {path.parent}, then compare the key: ocmm key show",
        )
    return green(
        "In a token, and nobody else can read its PIN."
        if in_token
        else "Present, and nobody else can read it."
    )


def program(computer: Computer) -> Answer:
    """Return the running version, and whether all files belong to it."""
    try:
        installed = version("ocmm")
    except PackageNotFoundError:
        installed = __version__
    if installed != __version__:
        return red(
            "program.mixed",
            f"The program files are of version {__version__}, the installation of {installed}.",
            "Install OCMM again; an upgrade was not finished.",
        )
    return green(f"OCMM {__version__}, Python {python_version()}.")


def _by_date(
    computer: Computer, until: datetime, expired: Answer, due: Answer, count: int
) -> Answer:
    """Return the answer for objects of which the first expires at `until`."""
    now = computer.calls.now()
    if now >= until:
        return expired
    if now >= until - DUE_BEFORE:
        return due
    return green(f"{count} in force, the first one until {until:%Y-%m-%d}.")


def _newest(computer: Computer) -> list[tuple[str, _Dates]]:
    """Return the newest record of each rig, probe and tip, with its folder name."""
    newest: dict[tuple[str, str, str], _Dates] = {}
    for name, record in _records(computer):
        key_ = name, record.schema, record.tip
        before = newest.get(key_)
        if before is None or _moment(before.made_utc) < _moment(record.made_utc):
            newest[key_] = record
    return [(name, record) for (name, _, _), record in newest.items()]


def _records(computer: Computer) -> Iterator[tuple[str, _Dates]]:
    for kind in ("calibrations", "probes"):
        above = computer.data / kind
        if not computer.has(above):
            continue
        for name in computer.names(above):
            folder = above / name
            if not computer.place(folder).is_dir():
                continue
            files = [
                one for one in computer.names(folder)
                if one.endswith(".json") and len(one) == _HASH_DIGITS + len(".json")
            ]  # fmt: skip
            for file in files:
                yield name, _read(computer, folder / file)


def _read(computer: Computer, path: Path) -> _Dates:
    try:
        return msgspec.json.decode(read_bytes(computer.place(path), _LARGEST), type=_File).content
    except (InputError, msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise NotAskedError(
            f"The record {path.name[:12]} of '{path.parent.name}' cannot be read.",
            "Restore it from a backup; ocmm audit verify says what else is wrong.",
        ) from error


def _moment(text: str) -> datetime:
    try:
        when = datetime.fromisoformat(text)
    except ValueError as error:
        raise NotAskedError(
            f"A record holds no date where one should be ({text[:40]!r})."
        ) from error
    return when if when.tzinfo else when.replace(tzinfo=UTC)

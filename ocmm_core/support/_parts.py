"""Parts of a support bundle: one function each, whose failure is contained."""

from __future__ import annotations

import importlib.metadata
import json
import os
import platform
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core.acquisition.recording import FrameHistory
from ocmm_core.build import build_version
from ocmm_core.errors import OcmmError
from ocmm_core.failure import log_folder
from ocmm_core.settings import SETTINGS, LoadedSettings, SettingsStore, text_of
from ocmm_core.side_files import OversizeError, open_guarded, read_guarded

SECRET_SETTINGS = ("stream.token", "stream.key", "archive.password")
"""Settings that name a file with a secret: neither the file nor its path is packed."""
NAME_SETTINGS = ("job.operator", "job.operators", "report.signatures", "report.contact")
NEWEST_LOGS = 20
MOST_LOG_BYTES = 256 << 10
MOST_RECORDS = 200
MOST_RECORD_BYTES = 8 << 20
_TEXT_AT_MOST = 400
"""Characters of one value in the head of a record."""


@dataclass(frozen=True, slots=True)
class SupportSite:
    """Sources of a bundle."""

    store: SettingsStore
    logs: Path
    records: tuple[Path, ...]
    """Folders of records of cameras and probes."""
    history: FrameHistory | None = None
    """The last raw frames; None unless measuring."""
    extra: dict[str, str] = field(default_factory=dict)
    """Additional texts of the caller by file name, such as the log of the window."""
    doctor: Callable[[], str] = lambda: doctor_text()
    environment: dict[str, str] = field(default_factory=lambda: dict(os.environ))
    people: tuple[str, ...] = ()
    """Additional names, such as the current operator."""


@dataclass(frozen=True, slots=True)
class RawItem:
    """A file as found."""

    name: str
    content: bytes
    is_text: bool = True


@dataclass(frozen=True, slots=True)
class PartSpec:
    name: str
    title: str
    """`name`, `title`: For scripts, and for people."""
    about: str
    take: Callable[[SupportSite, LoadedSettings], Iterator[RawItem]]


def _versions(site: SupportSite, loaded: LoadedSettings) -> Iterator[RawItem]:
    packages = sorted(
        {f"{one.metadata['Name']} {one.version}" for one in importlib.metadata.distributions()},
        key=str.casefold,
    )
    lines = [
        f"ocmm {build_version()}",
        f"Python {platform.python_version()} ({sys.implementation.name})",
        platform.platform(),
        f"{platform.machine()}, {os.cpu_count()} processors",
        "",
        *packages,
    ]
    yield RawItem("versions.txt", "\n".join(lines).encode())


def _settings(site: SupportSite, loaded: LoadedSettings) -> Iterator[RawItem]:
    lines = ["* differs from the default"]
    for spec in SETTINGS:
        value = text_of(loaded.values[spec.key])
        mark = "*" if loaded.differs(spec.key) else " "
        if spec.key in SECRET_SETTINGS:
            lines.append(f"{mark} {spec.key} is {'set' if value else 'not set'}")
            continue
        lines.append(f"{mark} {spec.key} = {value or '-'}  ({loaded.origins[spec.key].value})")
    lines += [f"{note.what} {note.remedy}" for note in loaded.notes]
    yield RawItem("settings.txt", "\n".join(lines).encode())


def _doctor(site: SupportSite, loaded: LoadedSettings) -> Iterator[RawItem]:
    yield RawItem("doctor.json", site.doctor().encode())


def doctor_text() -> str:
    """Return the report of the doctor without long measurements, as JSON."""
    from ocmm_core.doctor import examine, this_computer

    report, _ = examine(this_computer())
    return msgspec.json.format(msgspec.json.encode(report), indent=1).decode()


def _logs(site: SupportSite, loaded: LoadedSettings) -> Iterator[RawItem]:
    for name, text in sorted(site.extra.items()):
        yield RawItem(f"logs/{name}", text.encode()[-MOST_LOG_BYTES:])
    for path in sorted(site.logs.glob("*.log"))[-NEWEST_LOGS:]:
        if path.is_file() and not path.is_symlink():
            yield RawItem(f"logs/{path.name}", _end_of(path, MOST_LOG_BYTES))


def _records(site: SupportSite, loaded: LoadedSettings) -> Iterator[RawItem]:
    count = 0
    for folder in site.records:
        for path in sorted(folder.rglob("*.json")):
            if count >= MOST_RECORDS or not path.is_file() or path.is_symlink():
                continue
            count += 1
            name = f"records/{folder.name}/{path.relative_to(folder).as_posix()}"
            yield RawItem(name, head_of(path).encode())


def _recording(site: SupportSite, loaded: LoadedSettings) -> Iterator[RawItem]:
    history = site.history
    if history is None or not (blocks := history.blocks()):
        return
    with tempfile.TemporaryDirectory(prefix="ocmm-support-") as folder:
        path = Path(folder) / "frames.ocmr"
        history.write(path, blocks)
        content = read_guarded(path, 1 << 30)
        yield RawItem("recording/last_seconds.ocmr", content, is_text=False)


def head_of(path: Path) -> str:
    """Return the head of a record, without measured data."""
    try:
        found = json.loads(read_guarded(path, MOST_RECORD_BYTES))
    except OversizeError:
        return f"{path.name}: too large to be looked at"
    except (OSError, ValueError, RecursionError) as error:
        return f"{path.name}: cannot be read ({type(error).__name__})"
    return json.dumps(_plain(found, 2), indent=1, ensure_ascii=False)


def _plain(value: Any, depth: int) -> Any:
    if isinstance(value, dict):
        if not depth:
            return f"({len(value)} entries)"
        return {str(key)[:_TEXT_AT_MOST]: _plain(one, depth - 1) for key, one in value.items()}
    if isinstance(value, list):
        return f"({len(value)} values)"
    return value[:_TEXT_AT_MOST] if isinstance(value, str) else value


def _end_of(path: Path, most: int) -> bytes:
    try:
        with open(open_guarded(path), "rb") as stream:  # noqa: PTH123 - the guard opens it
            stream.seek(max(stream.seek(0, os.SEEK_END) - most, 0))
            return stream.read(most)
    except OSError as error:
        return f"cannot be read ({error.strerror})".encode()


PARTS = (
    PartSpec(
        "versions", title="Versions",
        about="OCMM, Python, system and packages, without names of computers", take=_versions,
    ),
    PartSpec(
        "settings", title="Settings",
        about="all settings; of passwords, tokens and keys only whether they are set",
        take=_settings,
    ),
    PartSpec("doctor", title="Doctor", about="what the doctor says of this computer", take=_doctor),
    PartSpec(
        "logs", title="Logs", about="messages of the window and logs of failures", take=_logs,
    ),
    PartSpec(
        "records", title="Record heads",
        about="of calibrations and tips: dates, identities, states; no coordinates", take=_records,
    ),
    PartSpec(
        "recording", title="Last 30 seconds", about="raw spots of the cameras, no pictures",
        take=_recording,
    ),
)  # fmt: skip
"""In the order of the page."""


def names_of(loaded: LoadedSettings, site: SupportSite) -> tuple[str, ...]:
    """Return the names of people: settings, records, logged-in user."""
    found: dict[str, None] = {}
    for key in NAME_SETTINGS:
        value = loaded.values[key]
        for text in value if isinstance(value, tuple) else (str(value or ""),):
            for one in text.replace("<", ";").replace(">", ";").split(";"):
                found.setdefault(one.strip())
    for folder in site.records:
        for path in sorted(folder.rglob("*.json"))[:MOST_RECORDS]:
            for name in _operators(path):
                found.setdefault(name)
    for name in site.people:
        found.setdefault(name.strip())
    for name in ("USER", "LOGNAME", "SUDO_USER", "USERNAME"):
        found.setdefault(site.environment.get(name, ""))
    found.setdefault(Path.home().name)
    found.pop("", None)
    return tuple(found)


_NAMED = ("made_by", "who", "operator", "by", "user", "name_of_operator", "inspector")
"""Fields of records that hold the name of a person."""


def _operators(path: Path) -> Iterator[str]:
    try:
        pending = [json.loads(read_guarded(path, MOST_RECORD_BYTES))]
    except (OSError, ValueError, RecursionError):
        return
    while pending:
        value = pending.pop()
        if isinstance(value, dict):
            for key, one in value.items():
                if isinstance(one, str):
                    if key in _NAMED:
                        # Practice runs are signed "PRACTICE: name".
                        yield one.rpartition(":")[2].strip()
                elif isinstance(one, dict):
                    pending.append(one)


def site_of_this_user(
    store: SettingsStore | None = None,
    history: FrameHistory | None = None,
    extra: dict[str, str] | None = None,
    people: tuple[str, ...] = (),
) -> SupportSite:
    from ocmm_core.calibration.records import default_folder, default_probe_folder

    settings = store or SettingsStore.of_this_user()
    chosen = settings.load().settings
    records = (
        chosen.instrument_calibrations or default_folder(),
        chosen.instrument_probes or default_probe_folder(),
    )
    return SupportSite(settings, log_folder(), records, history, extra or {}, people=people)


def secret_texts(loaded: LoadedSettings) -> Iterator[str]:
    """Yield the contents of the secret files named by the settings."""
    for key in SECRET_SETTINGS:
        path = loaded.values[key]
        if isinstance(path, Path):
            try:
                with open(open_guarded(path), "rb") as stream:  # noqa: PTH123 - the guard opens it
                    yield stream.read(1 << 16).decode("utf-8", errors="backslashreplace")
            except OSError:
                continue


def taken(
    spec: PartSpec, site: SupportSite, loaded: LoadedSettings
) -> tuple[tuple[RawItem, ...], str]:
    """Return the files of a part, and why there are none or not all."""
    found: list[RawItem] = []
    try:
        found.extend(spec.take(site, loaded))
    except OcmmError as error:
        return tuple(found), error.what
    except Exception as error:
        # Bundles are made when something is broken: a failure here is part of the answer.
        return tuple(found), f"This part cannot be read ({type(error).__name__})."
    return tuple(found), "" if found else "Nothing there."

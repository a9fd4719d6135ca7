"""One settings document: tolerant reading, safe changes, its text.

Unusable documents are ignored with a note and kept. The first change renames a damaged or foreign
one; documents of later versions are never written. Unusable values are ignored one by one, and
unknown ones are kept: a newer program may have written them.
"""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import time
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import date, datetime
from datetime import time as time_of_day
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ocmm_core.documents import LARGEST_DOCUMENT, read_text, shortened, write_atomic
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.host import HOST
from ocmm_core.settings._settings_seal import (
    SEAL,
    changes_verdict,
    is_older,
    note_sealed,
    sealed_table,
    signer_of,
    verdict_entries,
    was_sealed,
)
from ocmm_core.settings._specs import SETTINGS, Value, spec_of
from ocmm_core.settings._values import checked, plain

if TYPE_CHECKING:
    from ocmm_core.seals import SealState


SETTINGS_SCHEMA = "ocmm.settings/1"
_FAMILY = "ocmm.settings/"
MEASURED = ("temperature.part_c", "temperature.probe_c")
"""Values that expire after some hours."""
STAMP_END = "_utc"
"""Suffix of the entry with the time when the value was typed."""
_STAMPS = tuple(key + STAMP_END for key in MEASURED)
_WAIT_S = 5.0
_MOST_ASIDE = 100
_CONFIRM = "Check them in Settings, then confirm them by name: ocmm settings confirm."
_NO_RIGHTS = "Give this user the right to write there, or change the settings of this user instead."


@dataclass(frozen=True, slots=True)
class Note:
    """An ignored entry and its consequence or remedy, a sentence each."""

    what: str
    remedy: str


@dataclass(frozen=True, slots=True)
class Contents:
    """Contents of a document."""

    values: Mapping[str, Value] = field(default_factory=dict)
    """Usable values by key."""
    entries: Mapping[str, Any] = field(default_factory=dict)
    """All entries, also unknown ones."""
    notes: tuple[Note, ...] = ()
    state: str = "good"
    """``good``, ``missing``, ``unusable`` (damaged or foreign) or ``future``."""
    stamps: Mapping[str, str] = field(default_factory=dict)
    """When the values of `MEASURED` were typed, by key."""


class SettingsFile:
    """Settings document at a path; the file may be missing."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> Contents:
        """Return the usable contents; never raises, problems are in the notes."""
        found = self._read()
        # Another program may have signed a later version since the file was read.
        return self._read() if self._older() in found.notes else found

    def _read(self) -> Contents:
        try:
            if not os.path.lexists(self.path):
                return Contents(notes=self._missing(), state="missing")
            data = tomllib.loads(read_text(self.path, LARGEST_DOCUMENT))
        except OcmmError as error:
            return self._unusable(error.what)
        except (ValueError, RecursionError, OSError) as error:
            return self._unusable(f"{self.path}: the file is not valid TOML ({error}).")
        schema = data.get("schema")
        if isinstance(schema, str) and schema.startswith(_FAMILY) and schema != SETTINGS_SCHEMA:
            note = Note(
                f"{self.path}: these settings are of another version ({shortened(schema)}), "
                "and are not used.",
                "Update OCMM, or move that file away. It is left as it is.",
            )
            return Contents(notes=(note,), state="future")
        if schema != SETTINGS_SCHEMA:
            return self._unusable(
                f"{self.path}: field 'schema' is {shortened(schema)}, so this is no settings file."
            )
        return self._usable(data)

    def change(
        self,
        changes: Mapping[str, Value],
        *,
        stamp: str = "",
        keep_defaults: frozenset[str] = frozenset(),
    ) -> tuple[Note, ...]:
        """Set values and return side effects; None or the default removes a value.

        The document is reread under a lock and written as a whole: concurrent changes of other
        programs survive. ``stamp``: current time, ISO 8601, stored next to a temperature that is
        set; ``keep_defaults``: keys to write even if they have the default: another document would
        win. InputError for unusable keys or values; StorageError if the document is of a later
        version, another program holds it, or it cannot be written.
        """
        wanted = {
            key: None if value is None else checked(spec_of(key), value)
            for key, value in changes.items()
        }
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with _held(self.path.parent):
                return self._write(wanted, stamp, keep_defaults)
        except OSError as error:
            raise StorageError(
                "settings.read_only",
                f"{self.path}: the settings cannot be written ({error.strerror or error}).",
                _NO_RIGHTS,
            ) from error

    def _write(
        self, wanted: Mapping[str, Value], stamp: str, keep_defaults: frozenset[str]
    ) -> tuple[Note, ...]:
        now = self.read()
        if now.state == "future":
            raise StorageError("settings.version", now.notes[0].what, now.notes[0].remedy)
        notes: tuple[Note, ...] = ()
        if now.state == "unusable":
            aside = self._set_aside()
            notes = (
                Note(
                    f"{self.path} could not be used. It was renamed to {aside.name}.",
                    "Copy what you need from it.",
                ),
            )
        entries: dict[str, Any] = {"schema": SETTINGS_SCHEMA}
        for name, items in now.entries.items():
            entries[name] = dict(items) if isinstance(items, Mapping) else items
        for key, value in wanted.items():
            spec = spec_of(key)
            found = entries.get(spec.section)
            table: dict[str, Any] = found if isinstance(found, dict) else {}
            entries[spec.section] = table
            if value is None or (value == spec.default and key not in keep_defaults):
                table.pop(spec.name, None)
                table.pop(spec.name + STAMP_END, None)
            else:
                table[spec.name] = plain(value)
            if stamp and key in MEASURED and value is not None:
                table[spec.name + STAMP_END] = stamp
            if not table:
                del entries[spec.section]
        sealed = entries.get(SEAL)
        if any(map(changes_verdict, wanted)):
            notes += self._sealed(entries, now.entries)
        write_atomic(self.path, toml_text(entries).encode("utf-8"))
        if entries.get(SEAL) != sealed:
            note_sealed(self.path, entries)
        return notes

    def signer(self) -> SealState:
        """Return the state of the signature; InputError if the document is unusable or older."""
        entries = self._good_entries()
        if is_older(self.path, entries):
            entries = self._good_entries()
        if is_older(self.path, entries):
            note = self._older()
            raise InputError("settings.older", note.what, note.remedy)
        return signer_of(entries)

    def _good_entries(self) -> Mapping[str, Any]:
        now = self.read()
        if now.state != "good":
            raise InputError(
                "settings.unusable",
                f"{self.path}: the settings cannot be used ({now.state}).",
                "Correct the file, or change a setting.",
            )
        return now.entries

    def confirm(self, who: str) -> None:
        """Sign the settings that change a verdict by name; errors as `signer` and `change`."""
        self._good_entries()  # A missing folder cannot be locked.
        with _held(self.path.parent):
            found = self._good_entries()
            entries = {**found, SEAL: sealed_table(self.path, found, who)}
            write_atomic(self.path, toml_text(entries).encode("utf-8"))
            note_sealed(self.path, entries)

    def _sealed(self, entries: dict[str, Any], before: Mapping[str, Any]) -> tuple[Note, ...]:
        """Sign ``entries`` unless that would vouch for edits by other means."""
        lost = was_sealed(self.path, before)
        fresh = SEAL not in before and not verdict_entries(before) and not lost
        try:
            if fresh or (signer_of(before).sound and not is_older(self.path, before)):
                entries[SEAL] = sealed_table(self.path, entries)
                return ()
        except StorageError as error:
            return (Note(f"The settings could not be signed. {error.what}", error.remedy),)
        if SEAL not in before and not lost:
            return ()
        return (Note(f"{self.path}: the settings stay without a valid signature.", _CONFIRM),)

    def _set_aside(self) -> Path:
        for number in range(1, _MOST_ASIDE):
            aside = self.path.with_name(f"{self.path.stem}-unusable-{number}{self.path.suffix}")
            if not os.path.lexists(aside):
                HOST.rename_new(self.path, aside)
                return aside
        raise OSError(0, f"{_MOST_ASIDE} unusable files are beside it", str(self.path))

    def _missing(self) -> tuple[Note, ...]:
        if not was_sealed(self.path, {}):
            return ()
        what = f"{self.path}: the settings that this station signed are missing. Defaults are used."
        return (Note(what, f"Restore the file from a backup, or set them again. {_CONFIRM}"),)

    def _unusable(self, what: str) -> Contents:
        note = Note(
            f"{what} Defaults are used instead of these settings.",
            "Correct the file, or change a setting: the file is then renamed and a new one begun.",
        )
        return Contents(notes=(note,), state="unusable")

    def _usable(self, data: dict[str, Any]) -> Contents:
        values: dict[str, Value] = {}
        stamps: dict[str, str] = {}
        notes: list[Note] = []
        known = {(spec.section, spec.name): spec for spec in SETTINGS}
        for section, items in data.items():
            if section in ("schema", SEAL):
                continue
            if not isinstance(items, dict):
                notes.append(self._unknown(section))
                continue
            for name, value in items.items():
                spec = known.get((section, name))
                if spec is None:
                    if f"{section}.{name}" not in _STAMPS:
                        notes.append(self._unknown(f"{section}.{name}"))
                    elif isinstance(value, str):
                        stamps[f"{section}.{name}".removesuffix(STAMP_END)] = value[:40]
                    continue
                try:
                    values[spec.key] = checked(spec, value)
                except InputError as error:
                    notes.append(
                        Note(
                            f"{self.path}: {error.what} The default is used.",
                            f"Correct {spec.key} there, or set it again in Settings.",
                        )
                    )
        try:
            if (SEAL in data or was_sealed(self.path, data)) and not signer_of(data).sound:
                notes.append(
                    Note(
                        f"{self.path}: settings that change verdicts were edited outside this "
                        "program, or signed by an unknown station.",
                        _CONFIRM,
                    )
                )
            elif is_older(self.path, data):
                notes.append(self._older())
        except StorageError as error:
            notes.append(Note(error.what, error.remedy))
        return Contents(values, data, tuple(notes), stamps=stamps)

    def _older(self) -> Note:
        return Note(
            f"{self.path}: these settings are older than the last ones that this station signed.",
            _CONFIRM,
        )

    def _unknown(self, key: str) -> Note:
        return Note(
            f"{self.path}: {shortened(key)} is not a setting of this version. It is kept.",
            "Check its name.",
        )


@contextlib.contextmanager
def _held(folder: Path) -> Iterator[None]:
    """Lock a folder against other programs."""
    descriptor = HOST.open_to_lock(folder)
    try:
        until = time.monotonic() + _WAIT_S
        while True:
            try:
                HOST.lock(descriptor)
                break
            except BlockingIOError:
                if time.monotonic() > until:
                    raise StorageError(
                        "settings.busy",
                        f"{folder}: another program is changing the settings.",
                        "End it, and try again.",
                    ) from None
                time.sleep(0.02)
            except OSError:
                # File system without locks: the change is still written as a whole.
                break
        yield
    finally:
        os.close(descriptor)


_BARE = re.compile(r"[A-Za-z0-9_-]+")


def toml_text(data: Mapping[str, Any]) -> str:
    """Return the TOML text of a document, tables last; TypeError for types that TOML lacks."""
    lines = [
        f"{_key(key)} = {_value(value)}"
        for key, value in data.items()
        if not isinstance(value, Mapping)
    ]
    for key, value in data.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{_key(key)}]"]
            lines += [f"{_key(name)} = {_value(item)}" for name, item in value.items()]
    return "\n".join(lines) + "\n"


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else _string(key)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else str(value)
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, datetime | date | time_of_day):
        return value.isoformat()
    if isinstance(value, list | tuple):
        return f"[{', '.join(_value(item) for item in value)}]"
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    raise TypeError(f"TOML has no {type(value).__name__}")


def _string(text: str) -> str:
    # A JSON string is a TOML basic string, except for the control character DEL.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")

"""Signature of the settings that change a verdict, in table ``[seal]`` of a settings document.

The program signs again after its own changes. Edits by other means invalidate the seal until a
person confirms the settings by name. Signatures are imported late, because the window reads
settings before it loads anything large.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from ocmm_core.errors import StorageError

if TYPE_CHECKING:
    from ocmm_core.seals import KnownEnd, SealState

SEAL = "seal"
_RELEASED = "released-only"
_VERDICT = (
    "instrument.", "temperature.", "job.released_only", "report.accreditation", "report.template",
)  # fmt: skip


class SettingsSeal(msgspec.Struct, frozen=True, kw_only=True):
    """The table; ``who`` confirmed the settings, empty if the program changed them."""

    who: str = ""
    utc: str = ""
    key: str = ""
    value: str = ""


def changes_verdict(key: str) -> bool:
    return key.startswith(_VERDICT)


def sealed_table(entries: Mapping[str, Any], who: str = "") -> dict[str, str]:
    """Return the table that signs ``entries``; StorageError if the key cannot be used."""
    from ocmm_core.seals import KeyFolder, Signed, sign

    utc = datetime.now(UTC).isoformat(timespec="seconds")
    made = sign(KeyFolder().station_key(), Signed.SETTINGS, _content(entries, who, utc))
    return {"who": who, "utc": utc, "key": made.key, "value": made.value}


def note_sealed(path: Path, entries: Mapping[str, Any]) -> None:
    """Make the station remember the time of the seal, and whether plans must be released.

    Call it after the document is written: a failed write must not make the former one an older one.
    """
    from ocmm_core.seals import KnownEnd, remember

    link = _RELEASED if entries.get("job", {}).get("released_only") is True else ""
    utc = str(entries[SEAL]["utc"])
    remember(KnownEnd(name=f"settings {path}", count=1, link=link, moment=utc), sync=False)


def is_older(path: Path, entries: Mapping[str, Any]) -> bool:
    """Return whether a later document with a seal was here, e.g. before a backup was restored."""
    seen = _remembered(path) if SEAL in entries else None
    return seen is not None and _seal_of(entries).utc < seen.moment


def remembers_released_only(path: Path) -> bool:
    """Return whether the last sealed document demanded released plans, also if it is lost now."""
    seen = _remembered(path)
    return seen is not None and seen.link == _RELEASED


def was_sealed(path: Path, entries: Mapping[str, Any]) -> bool:
    """Return whether this document was sealed, and lost its seal or is missing."""
    if SEAL in entries:
        return False
    try:
        return _remembered(path) is not None
    except StorageError:
        return True


def _remembered(path: Path) -> KnownEnd | None:
    """Return the memory of a sealed document; StorageError if it is damaged."""
    from ocmm_core.seals import memory_file, recall

    # Most settings are not sealed: signatures are then not even imported.
    if not os.path.lexists(memory_file(f"settings {path}")):
        return None
    return recall(f"settings {path}")


def signer_of(entries: Mapping[str, Any]) -> SealState:
    """Return the state of the signature; StorageError if the key ring cannot be read."""
    from ocmm_core.seals import KeyFolder, Signature, Signed, judge_signature

    seal = _seal_of(entries)
    signature = Signature(seal.key, seal.value) if SEAL in entries else None
    content = _content(entries, seal.who, seal.utc)
    return judge_signature(KeyFolder(), Signed.SETTINGS, content, signature)


def _seal_of(entries: Mapping[str, Any]) -> SettingsSeal:
    with contextlib.suppress(msgspec.ValidationError):
        return msgspec.convert(entries.get(SEAL, {}), SettingsSeal)
    return SettingsSeal()


def verdict_entries(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that can change a verdict, by key."""
    return {
        f"{section}.{name}": value
        for section, items in entries.items()
        if isinstance(items, Mapping)
        for name, value in items.items()
        if changes_verdict(f"{section}.{name}")
    }


def _content(entries: Mapping[str, Any], who: str, utc: str) -> bytes:
    content = {"settings": verdict_entries(entries), "who": who, "utc": utc}
    return msgspec.json.encode(content, order="sorted")

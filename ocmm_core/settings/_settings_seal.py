"""Signature of the settings that change a verdict, in table ``[seal]`` of a settings document.

The program signs again after its own changes. Edits by other means invalidate the seal until a
person confirms the settings by name. Versions of a document have its identity and a number: an
older one is recognised in any folder. Signatures are imported late, because the window reads
settings before it loads anything large.
"""

from __future__ import annotations

import contextlib
import os
import uuid
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
    id: str = ""
    number: int = 0
    """`id`, `number`: Identity of the document and number of its version; empty in older ones."""


def changes_verdict(key: str) -> bool:
    return key.startswith(_VERDICT)


def sealed_table(path: Path, entries: Mapping[str, Any], who: str = "") -> dict[str, Any]:
    """Return the table that signs ``entries`` as the next version of the document at a path.

    StorageError: the key cannot be used, or the memory is damaged.
    """
    from ocmm_core.seals import KeyFolder, Signed, sign

    here, before = _last_at(path), _seal_of(entries)
    known = None if here is None else _version(here.link)
    same = (known and known.first) or before.id or uuid.uuid4().hex
    last = _version(same)
    seal = SettingsSeal(
        who=who, utc=datetime.now(UTC).isoformat(), id=same,
        number=1 + (min(max(before.number, 0), 1 << 53) if last is None else last.count),
    )  # fmt: skip
    made = sign(KeyFolder().station_key(), Signed.SETTINGS, _content(entries, seal))
    return msgspec.structs.asdict(msgspec.structs.replace(seal, key=made.key, value=made.value))


def note_sealed(path: Path, entries: Mapping[str, Any]) -> None:
    """Make the station remember the time of the seal, and whether plans must be released.

    Call it after the document is written: a failed write must not make the former one an older one.
    """
    from ocmm_core.seals import KnownEnd, remember

    link = _RELEASED if entries.get("job", {}).get("released_only") is True else ""
    seal = _seal_of(entries)
    here = KnownEnd(name=_name_at(path), count=1, link=seal.id, moment=seal.utc)
    version = KnownEnd(
        name=f"settings {seal.id}", count=seal.number, link=link, first=seal.id, place=str(path)
    )
    for seen in (version, here):
        remember(seen, sync=False)


def is_older(path: Path, entries: Mapping[str, Any]) -> bool:
    """Return whether a later version has a seal, here or in another folder."""
    if SEAL not in entries:
        return False
    seal, here = _seal_of(entries), _last_at(path)
    version = _version(seal.id)
    if version is not None and seal.number < version.count:
        return True
    if here is None or (seal.id and seal.id == here.link):
        return False
    # A document without identity, or another one than the last one here.
    return seal.utc < here.moment


def remembers_released_only(path: Path, entries: Mapping[str, Any]) -> bool:
    """Return whether the last sealed document demanded released plans, also if it is lost now."""
    here = _last_at(path)
    last = "" if here is None else here.link
    versions = (_version(last), _version(_seal_of(entries).id))
    # Version 0.2 remembered the demand with the path.
    return last == _RELEASED or any(one is not None and one.link == _RELEASED for one in versions)


def was_sealed(path: Path, entries: Mapping[str, Any]) -> bool:
    """Return whether this document was sealed, and lost its seal or is missing."""
    if SEAL in entries:
        return False
    try:
        return _last_at(path) is not None
    except StorageError:
        return True


def _name_at(path: Path) -> str:
    return f"settings {path.absolute()}"


def _last_at(path: Path) -> KnownEnd | None:
    """Return the memory of the last sealed document here; StorageError if it is damaged.

    Its link is the identity of the document.
    """
    from ocmm_core.seals import memory_file, recall

    # Most settings are not sealed: signatures are then not even imported.
    name = _name_at(path)
    return recall(name) if os.path.lexists(memory_file(name)) else None


def _version(identity: str) -> KnownEnd | None:
    """Return the memory of the last version of a document, with its number as count."""
    from ocmm_core.seals import recall

    return recall(f"settings {identity}") if identity else None


def signer_of(entries: Mapping[str, Any]) -> SealState:
    """Return the state of the signature; StorageError if the key ring cannot be read."""
    from ocmm_core.seals import KeyFolder, Signature, Signed, judge_signature

    seal = _seal_of(entries)
    signature = Signature(seal.key, seal.value) if SEAL in entries else None
    content = _content(entries, seal)
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


def _content(entries: Mapping[str, Any], seal: SettingsSeal) -> bytes:
    content: dict[str, Any] = {
        "settings": verdict_entries(entries), "who": seal.who, "utc": seal.utc,
    }  # fmt: skip
    content |= {"id": seal.id, "number": seal.number} if seal.id else {}
    return msgspec.json.encode(content, order="sorted")

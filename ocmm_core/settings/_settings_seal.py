"""Signature on the settings that change a verdict, in table ``[seal]`` of a settings document.

A change by the program signs them again. Settings that somebody edited by other means keep the old
seal, which then does not fit, until a person confirms them by name.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import msgspec

if TYPE_CHECKING:
    from ocmm_core.seals import SealState

SEAL = "seal"
"""Name of the table."""
_VERDICT = (
    "instrument.", "temperature.", "job.released_only", "report.accreditation", "report.template",
)  # fmt: skip


class SettingsSeal(msgspec.Struct, frozen=True, kw_only=True):
    """The table: who signed when, and the signature."""

    who: str = ""
    """Who confirmed them; empty if the program changed them."""
    utc: str = ""
    key: str = ""
    value: str = ""


def changes_verdict(key: str) -> bool:
    """Return whether a setting can change a verdict."""
    return key.startswith(_VERDICT)


def seal_in(entries: Mapping[str, Any]) -> SettingsSeal | None:
    """Return the seal in the entries of a document; None without one, an empty one if damaged."""
    if SEAL not in entries:
        return None
    try:
        return msgspec.convert(entries[SEAL], SettingsSeal)
    except msgspec.ValidationError:
        return SettingsSeal()


def sealed_table(entries: Mapping[str, Any], who: str = "") -> dict[str, str]:
    """Return the table that signs the entries of a document.

    Raises
    ------
    StorageError
        The key of this station cannot be used.
    """
    # Here, because the window reads settings before it loads anything large.
    from ocmm_core.seals import KeyFolder, Signed, sign

    utc = datetime.now(UTC).isoformat(timespec="seconds")
    signature = sign(KeyFolder().station_key(), Signed.SETTINGS, _content(entries, who, utc))
    return {"who": who, "utc": utc, "key": signature.key, "value": signature.value}


def signer_of(entries: Mapping[str, Any]) -> SealState:
    """Return the state of the signature on the entries of a document.

    Raises
    ------
    StorageError
        The ring of known keys cannot be read.
    """
    from ocmm_core.seals import (
        KeyFolder,
        SealState,
        SealWord,
        Signature,
        Signed,
        judge_signature,
    )

    seal = seal_in(entries)
    if seal is None:
        return SealState(SealWord.NOT_SIGNED)
    content = _content(entries, seal.who, seal.utc)
    return judge_signature(KeyFolder(), Signed.SETTINGS, content, Signature(seal.key, seal.value))


def verdict_entries(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Return the entries that can change a verdict, by key."""
    return {
        f"{section}.{name}": value
        for section, items in entries.items()
        if isinstance(items, Mapping) and section != SEAL
        for name, value in items.items()
        if changes_verdict(f"{section}.{name}")
    }


def _content(entries: Mapping[str, Any], who: str, utc: str) -> bytes:
    content = {"settings": verdict_entries(entries), "who": who, "utc": utc}
    return msgspec.json.encode(content, order="sorted")

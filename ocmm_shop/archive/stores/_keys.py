"""Keys of stations, by proof of possession, regardless of rows."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.seals import KeptKeys, SealWord, Signature, Signed, judge_signature
from ocmm_shop.archive.records import station_claim
from ocmm_shop.archive.stores._interface import Archive


def verifies(what: Signed, content: bytes, key: str, signature: str) -> bool:
    """Return whether a key signed this, trusted or not."""
    nobody = KeptKeys(Path("/nonexistent"))
    state = judge_signature(nobody, what, content, Signature(key, signature))
    return state.word is SealWord.UNKNOWN_KEY


def stations_by_key(archive: Archive) -> dict[str, set[str]]:
    """Return the stations that proved possession of a key, by key."""
    found: dict[str, set[str]] = {}
    rows = archive.ask("SELECT station, key, proof FROM archive_station_key").rows
    for station, key, proof in rows:
        if verifies(Signed.STATION, station_claim(str(station)), str(key), str(proof)):
            found.setdefault(str(key), set()).add(str(station))
    return found

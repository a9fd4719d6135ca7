"""Signatures of this station and their state; the signed bytes name their kind."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from enum import StrEnum

import msgspec

from ocmm_core.errors import InputError
from ocmm_core.seals._key import KeyFolder, StationKey
from ocmm_core.seals._public import (
    fingerprint_of,
    public_from_text,
    public_text,
    shown_key,
    verifies,
)


class Signed(StrEnum):
    """Kinds of content; the kind is part of the signed bytes."""

    HISTORY = "history"
    JOB = "job"
    REPORT = "report"
    CERTIFICATE = "certificate"
    STATION = "station"
    """Proof to an archive that a key is its own."""
    DELIVERY = "delivery"
    """Job under its number in an outbox."""
    ACCEPTANCE = "acceptance"
    """Record of an acceptance test."""
    TEST = "acceptance session"
    """Steps of an acceptance test, a line each."""
    INTERIM = "interim checks"
    STUDY = "study"
    """Study of a calibrated part (MSA)."""
    ARTEFACTS = "artefacts"
    """Register of artefacts."""
    RECALL = "recall"
    PLAN = "plan"
    TEMPLATE = "template"
    DOCUMENT = "document"
    """Any other document: of an artefact, a procedure, a rig."""
    SETTINGS = "settings"
    MEMORY = "memory"
    """Start of the memory of the station."""


NOT_SIGNED = "Not signed: written before signatures, or the signature was removed."


class Signature(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    key: str
    """Public key, Base64."""
    value: str
    """64 bytes of the signature, Base64."""


class SealWord(StrEnum):
    SEALED = "SEALED"
    """Signed with a trusted key, and unchanged since."""
    UNKNOWN_KEY = "UNKNOWN KEY"
    """Valid signature, unknown signer."""
    NOT_SIGNED = "NOT SIGNED"
    FORGED = "FORGED"
    """The signature does not belong to the content."""


@dataclass(frozen=True, slots=True)
class SealState:
    """State of a signature."""

    word: SealWord
    station: str = ""
    """Name of the signer in the ring of keys; empty if unknown."""
    fingerprint: str = ""
    """Fingerprint of the key; empty without a signature."""

    @property
    def fault(self) -> str:
        """Return why the content cannot be trusted, as a sentence; empty if it can."""
        return {
            SealWord.SEALED: "",
            SealWord.NOT_SIGNED: NOT_SIGNED,
            SealWord.UNKNOWN_KEY: f"Signed by an unknown station (key {self.shown}).",
            SealWord.FORGED: "The signature does not belong to the content.",
        }[self.word]

    @property
    def shown(self) -> str:
        return shown_key(self.fingerprint)

    @property
    def sound(self) -> bool:
        """Return whether a trusted key signed exactly this content."""
        return self.word is SealWord.SEALED

    @property
    def signer(self) -> str:
        who = self.station or "unknown station"
        return f"{who} (key {shown_key(self.fingerprint)})" if self.fingerprint else "nobody"


def sign(key: StationKey, what: Signed, content: bytes) -> Signature:
    return Signature(public_text(key.public), public_text(key.sign(_message(what, content))))


def judge_signature(
    keys: KeyFolder, what: Signed, content: bytes, signature: Signature | None
) -> SealState:
    """Return the state of a signature, or of None; StorageError if the ring is unreadable."""
    if signature is None:
        return SealState(SealWord.NOT_SIGNED)
    try:
        public = public_from_text(signature.key)
        value = base64.b64decode(signature.value, validate=True)
    except (InputError, ValueError):
        return SealState(SealWord.FORGED)
    fingerprint = fingerprint_of(public)
    # Base64 has several spellings of the same bytes: another one would be an unnoticed change.
    if public_text(value) != signature.value or not verifies(
        public, _message(what, content), value
    ):
        return SealState(SealWord.FORGED, fingerprint=fingerprint)
    station = keys.believed().get(signature.key)
    if station is None:
        return SealState(SealWord.UNKNOWN_KEY, fingerprint=fingerprint)
    return SealState(SealWord.SEALED, station, fingerprint)


def _message(what: Signed, content: bytes) -> bytes:
    return b"ocmm %s 1\n" % what.value.encode() + content

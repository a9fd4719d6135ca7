"""Signatures of this station, and what is to be said of one that is read.

What is signed is named in what is signed: a signature of a job never passes for that of a history.
"""

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
    """What may be signed; part of what is."""

    HISTORY = "history"
    JOB = "job"
    REPORT = "report"
    CERTIFICATE = "certificate"
    STATION = "station"
    DELIVERY = "delivery"


class Signature(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A signature with the key that verifies it."""

    key: str
    """The public key, Base64."""
    value: str
    """The 64 bytes of the signature, Base64."""


class SealWord(StrEnum):
    """What is said of a signature, in a word."""

    SEALED = "SEALED"
    """A key that is believed here signed it, and it is as it was."""
    UNKNOWN_KEY = "UNKNOWN KEY"
    """It is as it was when somebody signed it whom nobody here knows."""
    NOT_SIGNED = "NOT SIGNED"
    FORGED = "FORGED"
    """The signature does not belong to the content."""


@dataclass(frozen=True, slots=True)
class SealState:
    """What is said of a signature."""

    word: SealWord
    """See `SealWord`."""
    station: str = ""
    """Who signed: a name of the ring of keys; empty where nobody is known."""
    fingerprint: str = ""
    """Of the key that it names; empty without a signature."""

    @property
    def sound(self) -> bool:
        """Return whether a key that is believed here signed exactly this."""
        return self.word is SealWord.SEALED

    @property
    def signer(self) -> str:
        """Return who signed, for people."""
        who = self.station or "unknown station"
        return f"{who} (key {shown_key(self.fingerprint)})" if self.fingerprint else "nobody"


def sign(key: StationKey, what: Signed, content: bytes) -> Signature:
    """Return the signature of this station on a content."""
    return Signature(public_text(key.public), public_text(key.sign(_message(what, content))))


def judge_signature(
    keys: KeyFolder, what: Signed, content: bytes, signature: Signature | None
) -> SealState:
    """Return what is to be said of the signature on a content; None stands for none.

    Raises
    ------
    StorageError
        The ring of known keys cannot be read.
    """
    if signature is None:
        return SealState(SealWord.NOT_SIGNED)
    try:
        public = public_from_text(signature.key)
        value = base64.b64decode(signature.value, validate=True)
    except (InputError, ValueError):
        return SealState(SealWord.FORGED)
    fingerprint = fingerprint_of(public)
    # One way to write a signature down: another one would be a changed file that nobody notices.
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

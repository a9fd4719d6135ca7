"""Signatures of this station and their state; the signed bytes name their kind.

A release of a file by name, ``NAME.release.json``, contains hash, kind, who, when and why; signed.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path

import msgspec

from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.seals._key import KeyFolder, StationKey
from ocmm_core.seals._memory import KnownEnd, memory_folder, recall, remember
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
    CORRECTIONS = "corrections"
    """Register of a machine tool's corrections."""
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


RELEASE_ENDING = ".release.json"
_LARGEST, _LONGEST = 20_000, 200


class Release(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Signed statement; ``signature`` covers all other fields."""

    schema: str = "ocmm.release/1"
    kind: Signed
    name: str
    sha256: str
    who: str
    utc: str
    reason: str = ""
    signature: Signature | None = None


@dataclass(frozen=True, slots=True)
class ReleaseState:
    signer: SealState
    release: Release | None = None
    changed: bool = False
    replaced: bool = False
    """Whether a later release in the memory of this station replaced this one."""

    @property
    def released(self) -> bool:
        """Return whether a trusted station released exactly this file."""
        known = self.release is not None and self.signer.sound
        return known and not (self.changed or self.replaced)

    @property
    def summary(self) -> str:
        """Return the state in one line, with name, date and key."""
        if self.release is None:
            return "not released"
        by = f"{self.release.who}, {self.release.utc[:10]}, key {self.signer.shown}"
        if self.signer.word is SealWord.FORGED:
            return "NOT released: the signature of the release is forged"
        if self.changed:
            return f"NOT released: changed after the release by {by}"
        if self.signer.word is SealWord.UNKNOWN_KEY:
            return f"NOT released: released with an unknown key by {by}"
        if self.replaced:
            return f"NOT released: replaced by a later release after that by {by}"
        return f"released by {by}"


NO_RELEASE = ReleaseState(SealState(SealWord.NOT_SIGNED))


def release_path(path: Path) -> Path:
    return path.with_name(path.name + RELEASE_ENDING)


def release_file(path: Path, kind: Signed, who: str, reason: str = "") -> Release:
    """Sign a file by name with the key of this station; replaces an earlier release.

    InputError: name or reason cannot be used, or the file cannot be read. StorageError: the release
    cannot be written or remembered, or the key of this station cannot be used.
    """
    texts = (who, reason)
    if not who.strip() or any(len(x) > _LONGEST or not x.isprintable() for x in texts):
        raise InputError(
            "release.name",
            f"Name or reason is missing or longer than {_LONGEST} printable characters.",
            "Give the name of the person in full, and a short reason.",
        )
    made = Release(
        kind=kind, name=path.name, sha256=hashlib.sha256(read_bytes(path)).hexdigest(),
        who=who.strip(), utc=datetime.now(UTC).isoformat(timespec="seconds"), reason=reason.strip(),
    )  # fmt: skip
    signature = sign(KeyFolder().station_key(), kind, _content(made))
    made = msgspec.structs.replace(made, signature=signature)
    here = f"released {kind.value} {path.absolute()}"
    before = {getattr(recall(here), "link", "")}
    with contextlib.suppress(InputError, ValueError, RecursionError):
        before.add(_value_of(_release_at(path)))
    try:
        write_atomic(release_path(path), msgspec.json.format(msgspec.json.encode(made)) + b"\n")
    except OSError as error:
        raise StorageError(
            "release.unwritable",
            f"{release_path(path)}: the release cannot be written ({error.strerror or error}).",
            "Free disk space or restore write permission, then repeat.",
        ) from error
    remember(KnownEnd(name=here, count=1, link=signature.value))
    for value in before - {"", signature.value}:
        # With a first line, the archive anchors it, and other stations learn it.
        remember(
            KnownEnd(
                name=f"release {value}", count=1, link=signature.value, first=value,
                moment=made.utc, place=str(path),
            )
        )  # fmt: skip
    if getattr(recall(here), "link", "") != signature.value:
        raise StorageError(
            "release.not_remembered",
            f"{path}: it is released, but this station cannot remember it ({memory_folder()} "
            "cannot be written), and would not notice an earlier release that is put back.",
            "Free disk space or restore write permission for that folder, then repeat.",
        )
    return made


def judge_release(release: Release | None, kind: Signed, sha256: str) -> ReleaseState:
    """Return the state of a release of the content with hash ``sha256``."""
    if release is None:
        return NO_RELEASE
    signer = judge_signature(KeyFolder(), kind, _content(release), release.signature)
    if release.kind is not kind or not signer.fingerprint:
        signer = SealState(SealWord.FORGED)
    return ReleaseState(signer, release, release.sha256 != sha256)


def release_state(path: Path, kind: Signed) -> ReleaseState:
    """Return the state of the release next to a file; an unreadable release counts as forged."""
    digest = hashlib.sha256(read_bytes(path)).hexdigest()
    try:
        found = _release_at(path)
    except (InputError, ValueError, RecursionError):
        unread = Release(kind=kind, name=path.name, sha256="", who="", utc="")
        return ReleaseState(SealState(SealWord.FORGED), unread, changed=True)
    state = judge_release(found, kind, digest)
    return replace(state, replaced=recall(f"release {_value_of(found)}") is not None)


def _release_at(path: Path) -> Release | None:
    """Return the release next to a file, or None; InputError, ValueError if unreadable."""
    try:
        return msgspec.json.decode(read_bytes(release_path(path), _LARGEST), type=Release)
    except InputError as error:
        if error.code == "document.missing":
            return None
        raise


def _value_of(release: Release | None) -> str:
    signature = None if release is None else release.signature
    return "" if signature is None else signature.value


def _content(release: Release) -> bytes:
    return msgspec.json.encode(msgspec.structs.replace(release, signature=None), order="sorted")

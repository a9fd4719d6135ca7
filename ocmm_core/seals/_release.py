"""Release of a file by name: a signed statement next to it, ``NAME.release.json``.

The statement holds the hash of the file, its kind, who released it, when and why. The signature
covers all of these, so a release never passes for one of another file or of another kind.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from ocmm_core.documents import LARGEST_DOCUMENT, read_bytes, write_atomic
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.seals._key import KeyFolder
from ocmm_core.seals._signature import (
    SealState,
    SealWord,
    Signature,
    Signed,
    judge_signature,
    sign,
)

RELEASE_ENDING = ".release.json"
_SCHEMA = "ocmm.release/1"
_LARGEST = 20_000
_LONGEST = 200


class Release(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The signed statement."""

    schema: str
    kind: Signed
    name: str
    """Of the file when it was released; the file may be renamed with its release."""
    sha256: str
    """Of the released file."""
    who: str
    utc: str
    reason: str = ""
    """`who`, `utc`, `reason`: Who released it, when (ISO 8601), and why."""
    signature: Signature | None = None
    """On all other fields."""


@dataclass(frozen=True, slots=True)
class ReleaseState:
    """The state of a release."""

    signer: SealState
    """Of the signature; NOT SIGNED without a release."""
    release: Release | None = None
    """None without a release."""
    changed: bool = False
    """The release is of another content: the file was changed afterwards."""

    @property
    def released(self) -> bool:
        """Return whether a trusted station released exactly this file."""
        return self.release is not None and self.signer.sound and not self.changed

    @property
    def words(self) -> str:
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
        return f"released by {by}"


NO_RELEASE = ReleaseState(SealState(SealWord.NOT_SIGNED))


def release_path(path: Path) -> Path:
    """Return where the release of a file is."""
    return path.with_name(path.name + RELEASE_ENDING)


def release_file(path: Path, kind: Signed, who: str, reason: str = "") -> Release:
    """Sign a file by name with the key of this station; replaces an earlier release.

    Raises
    ------
    InputError
        The name is missing or too long, or the file cannot be read.
    StorageError
        The release cannot be written, or the key of this station cannot be used.
    """
    for field, text in (("name", who), ("reason", reason)):
        if len(text) > _LONGEST or not all(map(str.isprintable, text)):
            raise InputError(
                "release.text", f"The {field} is too long or holds control characters.",
                f"Give at most {_LONGEST} printable characters.",
            )  # fmt: skip
    if not who.strip():
        raise InputError(
            "release.name", "A release needs the name of a person.", "Give it with --by."
        )
    digest = hashlib.sha256(read_bytes(path)).hexdigest()
    made = Release(
        schema=_SCHEMA, kind=kind, name=path.name, sha256=digest, who=who.strip(),
        utc=datetime.now(UTC).isoformat(timespec="seconds"), reason=reason.strip(),
    )  # fmt: skip
    signature = sign(KeyFolder().station_key(), kind, _content(made))
    whole = msgspec.structs.replace(made, signature=signature)
    try:
        write_atomic(release_path(path), msgspec.json.format(msgspec.json.encode(whole)) + b"\n")
    except OSError as error:
        raise StorageError(
            "release.unwritable",
            f"{release_path(path)}: the release cannot be written ({error.strerror or error}).",
            "Free disk space or restore write permission, then repeat.",
        ) from error
    return whole


def read_release(path: Path) -> Release | None:
    """Return the release next to a file, unverified; None without one.

    Raises
    ------
    InputError
        It cannot be read, or is no release.
    """
    beside = release_path(path)
    try:
        content = read_bytes(beside, _LARGEST)
    except InputError as error:
        if error.code == "document.missing":
            return None
        raise
    return decode_release(content, beside)


def decode_release(content: bytes | str, where: Path) -> Release:
    """Return the release in ``content``; ``where`` is for messages.

    Raises
    ------
    InputError
        It is no release.
    """
    try:
        found = msgspec.json.decode(content, type=Release)
        if found.schema != _SCHEMA:
            raise ValueError(f"its schema is {found.schema!r}")
    except (ValueError, RecursionError) as error:
        raise InputError(
            "release.format",
            f"{where}: this is not a release ({error}).",
            "Release the file again (ocmm plan release, ocmm audit release), or delete it.",
        ) from error
    return found


def judge_release(
    release: Release | None, kind: Signed, sha256: str, keys: KeyFolder | None = None
) -> ReleaseState:
    """Return the state of a release of the content with hash ``sha256``.

    Raises
    ------
    StorageError
        The ring of known keys cannot be read.
    """
    if release is None:
        return NO_RELEASE
    signer = judge_signature(keys or KeyFolder(), kind, _content(release), release.signature)
    # Without a signature, or as one of another kind, it is no statement of any station.
    if release.kind is not kind or not signer.fingerprint:
        signer = SealState(SealWord.FORGED)
    return ReleaseState(signer, release, release.sha256 != sha256)


def release_state(path: Path, kind: Signed, keys: KeyFolder | None = None) -> ReleaseState:
    """Return the state of the release next to a file; an unreadable one counts as forged.

    Raises
    ------
    InputError
        The file itself cannot be read.
    StorageError
        The ring of known keys cannot be read.
    """
    digest = hashlib.sha256(read_bytes(path, LARGEST_DOCUMENT)).hexdigest()
    try:
        found = read_release(path)
    except OcmmError:
        blank = Release(schema="", kind=kind, name=path.name, sha256="", who="", utc="")
        return ReleaseState(SealState(SealWord.FORGED), blank, changed=True)
    return judge_release(found, kind, digest, keys)


def _content(release: Release) -> bytes:
    return msgspec.json.encode(msgspec.structs.replace(release, signature=None), order="sorted")

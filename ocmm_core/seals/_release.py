"""Release of a file by name, ``NAME.release.json``: hash, kind, who, when and why; signed."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import msgspec

from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.seals._key import KeyFolder
from ocmm_core.seals._signature import SealState, SealWord, Signature, Signed, judge_signature, sign

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
    return path.with_name(path.name + RELEASE_ENDING)


def release_file(path: Path, kind: Signed, who: str, reason: str = "") -> Release:
    """Sign a file by name with the key of this station; replaces an earlier release.

    InputError: name or reason cannot be used, or the file cannot be read. StorageError: the release
    cannot be written, or the key of this station cannot be used.
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
    try:
        write_atomic(release_path(path), msgspec.json.format(msgspec.json.encode(made)) + b"\n")
    except OSError as error:
        raise StorageError(
            "release.unwritable",
            f"{release_path(path)}: the release cannot be written ({error.strerror or error}).",
            "Free disk space or restore write permission, then repeat.",
        ) from error
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
        found = msgspec.json.decode(read_bytes(release_path(path), _LARGEST), type=Release)
    except (InputError, ValueError, RecursionError) as error:
        if isinstance(error, InputError) and error.code == "document.missing":
            return NO_RELEASE
        unread = Release(kind=kind, name=path.name, sha256="", who="", utc="")
        return ReleaseState(SealState(SealWord.FORGED), unread, changed=True)
    return judge_release(found, kind, digest)


def _content(release: Release) -> bytes:
    return msgspec.json.encode(msgspec.structs.replace(release, signature=None), order="sorted")

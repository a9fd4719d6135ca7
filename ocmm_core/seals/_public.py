"""Public keys: text form, fingerprint and verification, and the ring of trusted ones.

Ed25519 (RFC 8032) for keys of this program or a capable token; ECDSA on P-256 with SHA-256
(FIPS 186-5) for other tokens, e.g. a TPM. The length distinguishes them: 32 bytes, or the 33 of a
compressed point (SEC 1, 2.3.3). A signature has 64 bytes with both. Keys in the ring are trusted in
addition to the one in force.
"""

from __future__ import annotations

import base64
import contextlib
import hashlib
import os
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

import msgspec
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ec import ECDSA, SECP256R1, EllipticCurvePublicKey
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from cryptography.hazmat.primitives.asymmetric.utils import encode_dss_signature
from cryptography.hazmat.primitives.hashes import SHA256

from ocmm_core.cleanup import hold
from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.seals._private_file import guarded_content, unwritable
from ocmm_core.side_files import open_guarded

_ED25519_BYTES, _P256_BYTES, _SIGNATURE_BYTES = 32, 33, 64
_P256_ORDER = 0xFFFFFFFF00000000FFFFFFFFFFFFFFFFBCE6FAADA7179E84F3B9CAC2FC632551


def fingerprint_of(public: bytes) -> str:
    """Return the first 32 hexadecimal digits of the SHA-256 of a public key."""
    return hashlib.sha256(public).hexdigest()[:32]


def shown_key(fingerprint: str) -> str:
    """Return a fingerprint as displayed: the first 16 digits in groups of four."""
    return "-".join(fingerprint[at : at + 4] for at in range(0, 16, 4))


def public_text(public: bytes) -> str:
    """Return a public key or a signature as Base64."""
    return base64.b64encode(public).decode("ascii")


def public_from_text(text: str) -> bytes:
    """Return a public key from its Base64; InputError if invalid."""
    try:
        public = base64.b64decode(text, validate=True)
        if public_text(public) != text:
            raise ValueError
        key_of(public)
    except ValueError as error:
        raise InputError(
            "key.public",
            f"{text[:60]!r} is not a public key.",
            "Give the line that `ocmm key show` prints on the other station.",
        ) from error
    return public


def compressed_p256(point: bytes) -> bytes:
    """Return the 33 bytes of a point on P-256; ValueError if invalid."""
    return _compressed(EllipticCurvePublicKey.from_encoded_point(SECP256R1(), point))


def low_s(signature: bytes) -> bytes:
    """Return an ECDSA signature with the lower of its two values of s.

    (r, s) and (r, n - s) both verify; one is accepted, so that no change is unnoticed.
    """
    s = int.from_bytes(signature[32:], "big")
    return signature[:32] + min(s, _P256_ORDER - s).to_bytes(32, "big")


def verifies(public: bytes, content: bytes, signature: bytes) -> bool:
    """Return whether the holder of a key signed this content."""
    if len(signature) != _SIGNATURE_BYTES:
        return False
    try:
        key = key_of(public)
        if isinstance(key, Ed25519PublicKey):
            key.verify(signature, content)
            return True
        r, s = (int.from_bytes(half, "big") for half in (signature[:32], signature[32:]))
        if s > _P256_ORDER // 2:
            return False
        key.verify(encode_dss_signature(r, s), content, ECDSA(SHA256()))
    except (InvalidSignature, ValueError):
        return False
    return True


def key_of(public: bytes) -> Ed25519PublicKey | EllipticCurvePublicKey:
    """Return the key of its 32 or 33 bytes; ValueError if they are none."""
    if len(public) == _ED25519_BYTES:
        return Ed25519PublicKey.from_public_bytes(public)
    if len(public) != _P256_BYTES:
        raise ValueError
    return EllipticCurvePublicKey.from_encoded_point(SECP256R1(), public)


def _compressed(key: EllipticCurvePublicKey) -> bytes:
    x, y = key.public_numbers().x, key.public_numbers().y
    return bytes((2 + y % 2,)) + x.to_bytes(32, "big")


_RING = "known_keys.json"
_LOCK = ".changing"
_SCHEMA = "ocmm.keys/1"
_NAME_LENGTH = 60
_PATIENCE_S = 5.0


class KnownKey(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Trusted key."""

    public: str
    """Base64 of its bytes."""
    name: str
    since_utc: str
    until_utc: str = ""
    """Time at which this station replaced it; empty for the key of another station."""
    who: str
    reason: str
    """Person who added it, and the reason."""

    @property
    def public_bytes(self) -> bytes:
        """Return the key itself; InputError if invalid."""
        return public_from_text(self.public)

    @property
    def fingerprint(self) -> str:
        return fingerprint_of(self.public_bytes)


class _Ring(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    schema: str
    keys: tuple[KnownKey, ...] = ()


def read_ring(folder: Path) -> tuple[KnownKey, ...]:
    """Return the trusted keys; StorageError if damaged, unreadable or writable by others."""
    path = folder / _RING
    content = guarded_content(path, "list of known keys")
    if content is None:
        return ()
    try:
        ring = msgspec.json.decode(content, type=_Ring)
        for key in ring.keys:
            _ = key.public_bytes
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError, InputError) as error:
        raise StorageError(
            "key.ring",
            f"{path}: the list of known keys cannot be read ({error}).",
            "Restore it from a backup, or move it away and trust the keys again.",
        ) from error
    return ring.keys


def add_to_ring(folder: Path, added: KnownKey) -> None:
    """Add or replace a key, the folder locked by `changing`; StorageError for the ring."""
    keys = [key for key in read_ring(folder) if key.public != added.public] + [added]
    _write(folder, keys)


@contextlib.contextmanager
def changing(folder: Path) -> Iterator[None]:
    """Lock the folder of keys against other programs; StorageError: held too long, not writable."""
    path = folder / _LOCK
    end = time.monotonic() + _PATIENCE_S
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            descriptor = open_guarded(path, flags=os.O_RDWR | os.O_CREAT)
        except OSError as error:
            raise unwritable(folder, error) from error
        if hold(descriptor, path):
            break
        os.close(descriptor)
        if time.monotonic() > end:
            raise StorageError(
                "key.busy",
                f"{folder}: another program is changing the keys.",
                "Wait until it has ended, then repeat.",
            )
        time.sleep(0.02)
    try:
        yield
    finally:
        os.close(descriptor)


def check_names(name: str, who: str) -> None:
    """Raise InputError if the name of a station or a person is missing or too long."""
    for what, text in (("name of the station", name), ("name of who decides", who)):
        if not 0 < len(text.strip()) <= _NAME_LENGTH:
            raise InputError(
                "key.name",
                f"The {what} is missing or longer than {_NAME_LENGTH} characters.",
                "Give it.",
            )


def in_utc(now: datetime) -> str:
    """Return a time in the format of the ring."""
    return now.astimezone(UTC).isoformat(timespec="seconds")


def _write(folder: Path, keys: Sequence[KnownKey]) -> None:
    content = msgspec.json.format(
        msgspec.json.encode(_Ring(schema=_SCHEMA, keys=tuple(keys))), indent=1
    )
    try:
        write_atomic(folder / _RING, content + b"\n")
        (folder / _RING).chmod(0o600)
    except OSError as error:
        raise unwritable(folder, error) from error

"""Public keys: text form, fingerprint and verification.

Ed25519 (RFC 8032) for keys of this program or a capable token; ECDSA on P-256 with SHA-256
(FIPS 186-5) for other tokens, e.g. a TPM. The length distinguishes them: 32 bytes, or the 33 of a
compressed point (SEC 1, 2.3.3). A signature has 64 bytes with both.
"""

from __future__ import annotations

import base64
import hashlib

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ec import ECDSA, SECP256R1, EllipticCurvePublicKey
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from cryptography.hazmat.primitives.asymmetric.utils import encode_dss_signature
from cryptography.hazmat.primitives.hashes import SHA256

from ocmm_core.errors import InputError

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

"""X.509 certificates of a station, by which other programs verify its XML signatures.

The certificate of the station is self-signed with its key. It issues a certificate to a new P-256
key for each document, because few programs verify Ed25519 in XML and a token signs only its own
messages. The private P-256 key is discarded after one signature.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.asymmetric.utils import encode_dss_signature
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from ocmm_core.documents import write_atomic
from ocmm_core.seals._key import KeyFolder, StationKey
from ocmm_core.seals._public import fingerprint_of, key_of, public_text, shown_key
from ocmm_core.seals._signature import SealState, SealWord

_STATION = "OCMM station"
_LONGEST_NAME = 64
"""Bytes (X.520, ub-common-name)."""
_SINCE = datetime(2026, 1, 1, tzinfo=UTC)
# RFC 5280, 4.1.2.5: no well-defined expiration. Archived certificates must stay verifiable.
_UNTIL = datetime(9999, 12, 31, 23, 59, 59, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class DocumentKey:
    """Key for one document, with its certificate and that of the station."""

    private: ec.EllipticCurvePrivateKey
    chain: tuple[x509.Certificate, x509.Certificate]


def document_key(key: StationKey, what: str) -> DocumentKey:
    """Return a new key for a document named `what`; StorageError: the token is silent."""
    private, station = ec.generate_private_key(ec.SECP256R1()), station_certificate(key)
    usage = x509.KeyUsage(True, True, False, False, False, False, False, False, False)
    builder = (
        _named(station.subject, _name(f"OCMM {shown_key(key.fingerprint)}: {what}"))
        .public_key(private.public_key())
        .serial_number(x509.random_serial_number())
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(usage, critical=True)
    )
    return DocumentKey(private, (_issued(builder, key), station))


def station_certificate(key: StationKey) -> x509.Certificate:
    """Return the self-signed certificate of a station; errors as `document_key`."""
    name = _name(f"{_STATION} {shown_key(key.fingerprint)}")
    usage = x509.KeyUsage(False, False, False, False, False, True, False, False, False)
    builder = (
        _named(name, name)
        .public_key(key_of(key.public))
        .serial_number(int(key.fingerprint, 16) | 1)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
    )
    return _issued(builder, key)


def write_station_certificate(path: Path, keys: KeyFolder) -> None:
    """Write the certificate of this station as PEM; StorageError as `KeyFolder.station_key`."""
    certificate = station_certificate(keys.station_key())
    write_atomic(path, certificate.public_bytes(Encoding.PEM))


def station_of(certificate: x509.Certificate, names: Mapping[str, str]) -> SealState | None:
    """Return a station's state by certificate, or None; `names`: `KeyFolder.believed`."""
    public = certificate.public_key()
    if isinstance(public, Ed25519PublicKey):
        raw = public.public_bytes_raw()
    elif isinstance(public, ec.EllipticCurvePublicKey) and isinstance(public.curve, ec.SECP256R1):
        raw = public.public_bytes(Encoding.X962, PublicFormat.CompressedPoint)
    else:
        return None
    if not certificate.subject.rfc4514_string().startswith(f"CN={_STATION}"):
        return None
    name = names.get(public_text(raw), "")
    return SealState(SealWord.SEALED if name else SealWord.UNKNOWN_KEY, name, fingerprint_of(raw))


def _named(issuer: x509.Name, subject: x509.Name) -> x509.CertificateBuilder:
    builder = x509.CertificateBuilder().issuer_name(issuer).subject_name(subject)
    return builder.not_valid_before(_SINCE).not_valid_after(_UNTIL)


def _name(text: str) -> x509.Name:
    plain = "".join(sign if sign.isprintable() else " " for sign in text)
    short = plain.encode()[:_LONGEST_NAME].decode(errors="ignore")
    return x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, short)])


def _issued(builder: x509.CertificateBuilder, key: StationKey) -> x509.Certificate:
    """Return a certificate signed by a station, whose key may be in a token.

    The builder signs with a private key only, so it signs with a temporary one of the same kind,
    and the signature is replaced. The signed part does not depend on the key that signs it.
    """
    if len(key.public) == 32:
        passing = builder.sign(Ed25519PrivateKey.generate(), None)
        signature = key.sign(passing.tbs_certificate_bytes)
    else:
        passing = builder.sign(ec.generate_private_key(ec.SECP256R1()), SHA256())
        raw = key.sign(passing.tbs_certificate_bytes)
        r, s = (int.from_bytes(half, "big") for half in (raw[:32], raw[32:]))
        signature = encode_dss_signature(r, s)
    whole, signed = passing.public_bytes(Encoding.DER), passing.tbs_certificate_bytes
    at = whole.index(signed) + len(signed)
    # Certificate ::= SEQUENCE { tbsCertificate, signatureAlgorithm, signatureValue BIT STRING }
    algorithm = whole[at : at + 2 + whole[at + 1]]
    content = signed + algorithm + _tagged(3, b"\0" + signature)
    return x509.load_der_x509_certificate(_tagged(0x30, content))


def _tagged(tag: int, content: bytes) -> bytes:
    """Return DER of a tag and its content (X.690, 8.1.3)."""
    size = len(content)
    length = size.to_bytes((size.bit_length() + 7) // 8, "big")
    return bytes([tag]) + (bytes([0x80 | len(length)]) if size >= 0x80 else b"") + length + content

"""XML signatures of certificates from elsewhere: validity, signer and trust.

The signature must be enveloped and cover the whole document; XML Signature 1.1 and XAdES, without
SHA-1, by `signxml`. A signer is trusted if his X.509 certificate, or the one that issued it, lies
in the folder of trusted laboratories.
"""

from __future__ import annotations

import base64
import binascii
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.serialization import Encoding
from lxml import etree

from ocmm_core.documents import read_bytes, write_atomic
from ocmm_core.errors import InputError

_DS = "{http://www.w3.org/2000/09/xmldsig#}"
_LARGEST = 100_000
_FOLDER = "laboratories"


class XmlSignatureWord(StrEnum):
    """State of the XML signature of a certificate."""

    VALID = "VALID"
    INVALID = "INVALID"
    UNKNOWN_SIGNER = "UNKNOWN SIGNER"
    NONE = "NONE"


@dataclass(frozen=True, slots=True)
class XmlSignature:
    """State of an XML signature."""

    word: XmlSignatureWord
    signer: str = ""
    """Subject of the signer's certificate."""
    why: str = ""
    """Reason why it is INVALID."""

    @property
    def words(self) -> str:
        """Return the state for people."""
        more = "; ".join(part for part in (self.signer, self.why) if part)
        return f"XML signature {self.word.value}{f' ({more})' if more else ''}"


def trusted_laboratories(keys: Path) -> tuple[x509.Certificate, ...]:
    """Return the certificates of trusted laboratories.

    Parameters
    ----------
    keys
        Folder of the keys of this station.

    Raises
    ------
    InputError
        One of the files is no certificate.
    """
    return tuple(_loaded(path) for path in sorted((keys / _FOLDER).glob("*.pem")))


def trust_laboratory(path: Path, keys: Path) -> x509.Certificate:
    """Trust the X.509 certificate of a laboratory from now on, and return it.

    Raises
    ------
    InputError
        The file is no certificate.
    StorageError
        The folder cannot be written.
    """
    found = _loaded(path)
    folder = keys / _FOLDER
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    name = f"{found.serial_number:x}.pem"
    write_atomic(folder / name, found.public_bytes(Encoding.PEM))
    return found


def xml_signature(
    root: etree._Element, content: bytes, trusted: Sequence[x509.Certificate]
) -> XmlSignature:
    """Return the state of the signature in a document.

    Parameters
    ----------
    root
        The document, read without entities and document types.
    content
        The same as bytes.
    trusted
        Certificates of signers, or of those that issue certificates to them.
    """
    from signxml.exceptions import SignXMLException
    from signxml.verifier import SignatureConfiguration, XMLVerifier

    signatures = list(root.iter(f"{_DS}Signature"))
    if not signatures:
        return XmlSignature(XmlSignatureWord.NONE)
    if len(signatures) > 1 or signatures[0].getparent() is not root:
        return _invalid("", "it is not one signature at the end of the document")
    held = signatures[0].findall(f".//{_DS}X509Certificate")
    try:
        chain = [
            x509.load_der_x509_certificate(base64.b64decode("".join((one.text or "").split())))
            for one in held
        ]
    except (ValueError, binascii.Error):
        return _invalid("", "its certificate cannot be read")
    if not chain:
        return _invalid("", "it holds no certificate of the signer")
    leaf = chain[0]
    signer = leaf.subject.rfc4514_string()[:200]
    try:
        # A certificate of years ago was signed with a key that has expired since.
        moment = leaf.not_valid_after_utc - timedelta(seconds=1)
        config = SignatureConfiguration(
            location="./", expect_references=True, verification_time=moment
        )
        verified = XMLVerifier().verify(content, x509_cert=leaf, expect_config=config)
    except (SignXMLException, InvalidSignature, ValueError, etree.LxmlError) as error:
        return _invalid(signer, str(error)[:200] or type(error).__name__)
    # XAdES refers to its own properties as well.
    parts = verified if isinstance(verified, list) else [verified]
    if all(part.signed_xml is None or part.signed_xml.tag != root.tag for part in parts):
        return _invalid(signer, "it does not cover the whole document")
    if any(one == leaf or _issued(leaf, one) for one in trusted):
        return XmlSignature(XmlSignatureWord.VALID, signer)
    return XmlSignature(XmlSignatureWord.UNKNOWN_SIGNER, signer)


def _issued(leaf: x509.Certificate, issuer: x509.Certificate) -> bool:
    try:
        leaf.verify_directly_issued_by(issuer)
    except (ValueError, TypeError, InvalidSignature):
        return False
    try:
        limits = issuer.extensions.get_extension_for_class(x509.BasicConstraints).value
    except x509.ExtensionNotFound:
        return False
    return limits.ca


def _invalid(signer: str, why: str) -> XmlSignature:
    return XmlSignature(XmlSignatureWord.INVALID, signer, why)


def _loaded(path: Path) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(read_bytes(path, _LARGEST))
    except ValueError as error:
        raise InputError(
            "certificate.x509",
            f"{path}: this is not an X.509 certificate (PEM).",
            "Ask the laboratory for its signing certificate as a PEM file.",
        ) from error

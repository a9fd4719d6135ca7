"""XML signatures of certificates: validity, signer, trust, and the signature of this station.

A signature must be the only one, at the end of the document, and cover all of it; XML Signature 1.1
and XAdES, without SHA-1, by `signxml`. Trusted are signers whose X.509 certificate, or its issuer,
is in the folder of trusted laboratories, or issued by a station with a trusted key. This station
signs as XAdES-B-B (ETSI EN 319 132-1), enveloped.
"""

from __future__ import annotations

import base64
import copy
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import timedelta
from enum import StrEnum
from functools import cache
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives.serialization import Encoding
from lxml import etree

from ocmm_core.documents import files_of_folder, read_bytes, write_atomic
from ocmm_core.errors import InputError
from ocmm_core.seals import DocumentKey, KeyFolder, SealState, SealWord, station_of

if TYPE_CHECKING:
    from signxml.verifier import XMLVerifier
    from signxml.xades.xades import XAdESSigner

_DS = "{http://www.w3.org/2000/09/xmldsig#}"
_XADES = "http://uri.etsi.org/01903/v1.3.2#"
_CERTIFICATES = "/".join(_DS + name for name in ("KeyInfo", "X509Data", "X509Certificate"))
_REFERENCE = "/".join(_DS + name for name in ("SignedInfo", "Reference"))
_FILLED = (f"{_DS}SignedInfo", f"{_DS}SignatureValue", f"{_DS}KeyInfo",
           f"{{{_XADES}}}SignedProperties")  # fmt: skip
"""Elements whose content is signed or is the signature."""
_FRAME = (
    f'<ds:Signature xmlns:ds="{_DS[1:-1]}" Id="{{id}}"><ds:SignedInfo></ds:SignedInfo>'
    "<ds:SignatureValue></ds:SignatureValue><ds:KeyInfo></ds:KeyInfo><ds:Object>"
    f'<xades:QualifyingProperties xmlns:xades="{_XADES}" Target="#{{id}}"><xades:SignedProperties>'
    "</xades:SignedProperties></xades:QualifyingProperties></ds:Object></ds:Signature>"
)
"""A signature of a station without these, in exclusive canonical form."""
_LARGEST = 100_000
_DAMAGED = (ValueError, TypeError, AttributeError, LookupError, AssertionError, etree.LxmlError)
"""Raised by `signxml` for missing or wrong elements."""
_FOLDER = "laboratories"


class XmlSignatureWord(StrEnum):
    VALID = "VALID"
    INVALID = "INVALID"
    UNKNOWN_SIGNER = "UNKNOWN SIGNER"
    NONE = "NONE"


@dataclass(frozen=True, slots=True)
class XmlSignature:
    word: XmlSignatureWord
    signer: str = ""
    """Subject of the signer's certificate."""
    why: str = ""
    station: SealState | None = None
    """State of the key, if a station signed it."""

    @property
    def summary(self) -> str:
        more = "; ".join(part for part in (self.signer, self.why) if part)
        return f"XML signature {self.word.value}{f' ({more})' if more else ''}"


@dataclass(frozen=True, slots=True)
class TrustedSigners:
    """Signers whose XML signatures are trusted."""

    laboratories: tuple[x509.Certificate, ...] = ()
    """Certificates of signers, or of their issuers."""
    stations: Mapping[str, str] = field(default_factory=dict)
    """Names of stations by their public keys, Base64."""


def trusted_signers(keys: KeyFolder) -> TrustedSigners:
    """Return trusted laboratories and stations; InputError: no certificate; StorageError."""
    files = files_of_folder(keys.folder / _FOLDER, ".pem")
    return TrustedSigners(tuple(_loaded(path) for path in files), keys.believed())


def trust_laboratory(path: Path, keys: Path) -> x509.Certificate:
    """Trust the X.509 certificate of a laboratory; InputError: no certificate; StorageError."""
    found = _loaded(path)
    folder = keys / _FOLDER
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    name = f"{found.serial_number:x}.pem"
    write_atomic(folder / name, found.public_bytes(Encoding.PEM))
    return found


def xml_signed(root: etree._Element, key: DocumentKey) -> bytes:
    """Return a document with an enveloped XAdES-B-B signature as its last element."""
    from signxml import methods
    from signxml.algorithms import CanonicalizationMethod, SignatureMethod
    from signxml.xades.xades import XAdESDataObjectFormat

    signer = _signer()(
        method=methods.enveloped, signature_algorithm=SignatureMethod.ECDSA_SHA256,
        c14n_algorithm=CanonicalizationMethod.EXCLUSIVE_XML_CANONICALIZATION_1_0,
        data_object_format=XAdESDataObjectFormat("Digital calibration certificate", "text/xml"),
    )  # fmt: skip
    signed = signer.sign(root, key=key.private, cert=list(key.chain), always_add_key_value=False)
    return _written(signed)


def xml_signature(
    root: etree._Element, content: bytes, trusted: TrustedSigners
) -> tuple[XmlSignature, etree._Element]:
    """Return the state of the signature in a document, and the document as signed.

    `root`: the document, read without entities and document types. `content`: the same as bytes.
    The returned document is ``root`` itself unless the signature is valid.
    """
    signatures = list(root.iter(f"{_DS}Signature"))
    if not signatures:
        return XmlSignature(XmlSignatureWord.NONE), root
    if len(signatures) > 1 or signatures[0].getparent() is not root:
        return _invalid("", "it is not one signature at the end of the document"), root
    signature = signatures[0]
    try:
        chain = [
            x509.load_der_x509_certificate(base64.b64decode("".join((one.text or "").split())))
            for one in signature.iterfind(_CERTIFICATES)
        ]
        if not chain:
            return _invalid("", "it holds no certificate of the signer"), root
        signer = chain[0].subject.rfc4514_string()[:200]
        own = len(chain) > 1 and _issued(chain[1], chain[1]) and _issued(chain[0], chain[1])
        station = station_of(chain[1], trusted.stations) if own else None
    except (ValueError, TypeError, UnsupportedAlgorithm):
        return _invalid("", "its certificate cannot be read"), root
    if station is not None:
        signer = station.signer
    why, signed = _verified(root, signature, chain[0])
    if signed is None:
        return _invalid(signer, why, station), root
    if station is not None and _rewritten(root, signature, content):
        # Comments and serialisation are not signed, and stations write one serialisation only.
        return _invalid(signer, "the file was rewritten after it was signed", station), root
    known = any(one == chain[0] or _issued(chain[0], one) for one in trusted.laboratories)
    word = XmlSignatureWord.UNKNOWN_SIGNER
    if known or (station is not None and station.sound):
        word = XmlSignatureWord.VALID
    return XmlSignature(word, signer, station=station), signed


def _verified(
    root: etree._Element, signature: etree._Element, leaf: x509.Certificate
) -> tuple[str, etree._Element | None]:
    """Return the document as signed; else why the signature is invalid."""
    from signxml.exceptions import SignXMLException
    from signxml.verifier import SignatureConfiguration

    whole = signature.find(_REFERENCE)
    if whole is None or whole.get("URI") != "":
        # An identifier may name an inner element, while an outer one is read.
        return "it does not cover the whole document", None
    # The key of an older certificate may have expired since.
    moment = leaf.not_valid_after_utc - timedelta(seconds=1)
    config = SignatureConfiguration(location="./", expect_references=True, verification_time=moment)
    try:
        verified = _verifier()().verify(root, x509_cert=leaf, expect_config=config)
    except (SignXMLException, UnsupportedAlgorithm, InvalidSignature, *_DAMAGED) as error:
        return str(error)[:200] or type(error).__name__, None
    first = verified[0] if isinstance(verified, list) else verified
    if first.signed_xml is None or first.signed_xml.tag != root.tag:
        return "it does not cover the whole document", None
    return "", first.signed_xml


def _rewritten(root: etree._Element, signature: etree._Element, content: bytes) -> bool:
    """Return whether the serialisation of a document differs from a station's."""
    value = (signature.findtext(f"{_DS}SignatureValue") or "").encode()
    frame = copy.deepcopy(signature)
    for one in list(frame.iter()):
        if one.tag in _FILLED:
            tail = one.tail
            one.clear()
            one.tail = tail
    wanted = _FRAME.format(id=escape(signature.get("Id", ""), quote=False))
    unsigned = etree.tostring(frame, method="c14n", exclusive=True, with_comments=True).decode()
    plain = base64.b64encode(base64.b64decode(value)) == value
    # The only instruction is the XML declaration.
    notes = b"<!--" in content or content.count(b"<?") > 1
    return notes or not (plain and unsigned == wanted and content == _written(root))


def _written(root: etree._Element) -> bytes:
    content: bytes = etree.tostring(root.getroottree(), xml_declaration=True, encoding="UTF-8")
    return content + b"\n"


@cache
def _verifier() -> type[XMLVerifier]:
    from signxml.verifier import XMLVerifier

    class OneParse(XMLVerifier):
        """Verify the tree that is read, instead of parsing the document again."""

        def get_root(self, data: etree._Element) -> etree._Element:
            return data

    return OneParse


@cache
def _signer() -> type[XAdESSigner]:
    from signxml.xades.xades import XAdESSigner

    class Exclusive(XAdESSigner):
        """Name the canonical form of each reference: the default is inclusive."""

        def _add_reference_to_signed_info(
            self, sig_root: etree._Element, node_to_reference: etree._Element, **attrs: str
        ) -> None:
            super()._add_reference_to_signed_info(  # type: ignore[no-untyped-call]
                sig_root, node_to_reference, **attrs
            )
            *_, reference = sig_root.iterfind(_REFERENCE)
            transforms = reference.makeelement(f"{_DS}Transforms")
            etree.SubElement(transforms, f"{_DS}Transform", Algorithm=self.c14n_alg.value)
            reference.insert(0, transforms)

    return Exclusive


def _issued(leaf: x509.Certificate, issuer: x509.Certificate) -> bool:
    try:
        leaf.verify_directly_issued_by(issuer)
    except (ValueError, TypeError, UnsupportedAlgorithm, InvalidSignature):
        return False
    try:
        limits = issuer.extensions.get_extension_for_class(x509.BasicConstraints).value
    except x509.ExtensionNotFound:
        return False
    return limits.ca


def _invalid(signer: str, why: str, station: SealState | None = None) -> XmlSignature:
    if station is not None:
        station = SealState(SealWord.FORGED, fingerprint=station.fingerprint)
    return XmlSignature(XmlSignatureWord.INVALID, signer, why, station)


def _loaded(path: Path) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(read_bytes(path, _LARGEST))
    except ValueError as error:
        raise InputError(
            "certificate.x509",
            f"{path}: this is not an X.509 certificate (PEM).",
            "Ask the laboratory for its signing certificate as a PEM file.",
        ) from error

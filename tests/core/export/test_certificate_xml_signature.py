"""XML signatures of foreign certificates: VALID, INVALID, UNKNOWN SIGNER or NONE."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding
from lxml import etree
from signxml import methods
from signxml.algorithms import SignatureMethod
from signxml.signer import XMLSigner
from signxml.xades.xades import XAdESSigner

from ocmm_core.errors import InputError
from ocmm_core.export.certificate import (
    Expansion,
    XmlSignatureWord,
    artefact_text,
    check_dcc_seal,
    read_dcc,
    trust_laboratory,
    trusted_signers,
)
from ocmm_core.seals import KeyFolder
from tests.core.export.test_certificate_quantities import Stated, certificate
from tests.host import amount

MUTATIONS = amount(40, 200)
Key = tuple[ec.EllipticCurvePrivateKey, x509.Certificate]


def make_key(name: str, issuer: Key | None = None, *, is_ca: bool = False) -> Key:
    private = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    builder = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject if issuer is None else issuer[1].subject)
        .public_key(private.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(datetime.now(UTC) - timedelta(days=900))
        # Expired: the certificate of an artefact is years old.
        .not_valid_after(datetime.now(UTC) - timedelta(days=100))
        .add_extension(x509.BasicConstraints(ca=is_ca, path_length=None), critical=True)
    )
    return private, builder.sign(private if issuer is None else issuer[0], SHA256())


def signed(key: Key, content: bytes, *, xades: bool = True) -> bytes:
    maker = XAdESSigner if xades else XMLSigner
    signer = maker(method=methods.enveloped, signature_algorithm=SignatureMethod.ECDSA_SHA256)
    root = signer.sign(etree.fromstring(content), key=key[0], cert=[key[1]])
    return bytes(etree.tostring(root))


@pytest.fixture
def content() -> bytes:
    one = Stated("diameter", "Diameter", 25.0001, 0.0003, "\\milli\\metre", 2.0)
    return certificate([one], np.random.default_rng(1))


@pytest.fixture
def keys(tmp_path: Path) -> KeyFolder:
    return KeyFolder(tmp_path / "keys")


def trust(key: Key, keys: KeyFolder, tmp_path: Path) -> None:
    path = tmp_path / "lab.pem"
    path.write_bytes(key[1].public_bytes(Encoding.PEM))
    trust_laboratory(path, keys.folder)


@pytest.mark.parametrize("xades", [True, False])
def test_judges_a_signature(
    content: bytes, keys: KeyFolder, tmp_path: Path, *, xades: bool
) -> None:
    root = make_key("National institute", is_ca=True)
    lab = make_key("Laboratory", root)
    path = tmp_path / "K1.xml"
    path.write_bytes(content)
    assert read_dcc(content).signature.word is XmlSignatureWord.NONE
    path.write_bytes(signed(lab, content, xades=xades))
    found = check_dcc_seal(path, keys)
    assert found.dcc.signature.word is XmlSignatureWord.UNKNOWN_SIGNER
    assert not found.sound
    trust(root, keys, tmp_path)
    found = check_dcc_seal(path, keys)
    assert (found.dcc.signature.word, found.sound) == (XmlSignatureWord.VALID, True)
    assert "CN=Laboratory" in found.summary
    # A certificate of a laboratory issues none to others.
    path.write_bytes(signed(make_key("Forger", lab), content, xades=xades))
    assert check_dcc_seal(path, keys).dcc.signature.word is XmlSignatureWord.UNKNOWN_SIGNER


def test_no_changed_document_is_valid(content: bytes, keys: KeyFolder, tmp_path: Path) -> None:
    lab = make_key("Laboratory")
    trust(lab, keys, tmp_path)
    trusted = trusted_signers(keys)
    good = signed(lab, content)
    assert read_dcc(good, trusted).signature.word is XmlSignatureWord.VALID
    rng = np.random.default_rng(20261128)
    changed = 0
    for _ in range(MUTATIONS):
        root = etree.fromstring(good)
        texts = [one for one in root.iter() if one.text and "xmldsig" not in str(one.tag)]
        chosen = texts[int(rng.integers(len(texts)))]
        word = str(chosen.text)
        at = int(rng.integers(len(word)))
        chosen.text = word[:at] + str(rng.integers(10)) + word[at + 1 :]
        made = bytes(etree.tostring(root))
        if same_content(made, good):
            continue
        try:
            dcc = read_dcc(made, trusted)
        except InputError:
            continue
        changed += 1
        assert dcc.signature.word is not XmlSignatureWord.VALID
        if dcc.signature.word is XmlSignatureWord.INVALID:
            with pytest.raises(InputError, match=r"XML signature INVALID|states no"):
                artefact_text(dcc, "sphere", "2027-01-01", expansion=Expansion(1e-5, 1e-6))
    assert changed > MUTATIONS // 2


def same_content(first: bytes, second: bytes) -> bool:
    """Return whether two documents differ at most in their signatures."""
    forms = []
    for one in (first, second):
        try:
            root = etree.fromstring(one)
            for signature in root.findall("{http://www.w3.org/2000/09/xmldsig#}Signature"):
                root.remove(signature)
            forms.append(etree.tostring(root, method="c14n"))
        except etree.LxmlError:
            return False
    return forms[0] == forms[1]


def test_refuses_a_signature_that_covers_a_part(content: bytes, keys: KeyFolder) -> None:
    good = signed(make_key("Laboratory"), content)
    root = etree.fromstring(content)
    signature = etree.fromstring(good).find("{*}Signature")
    assert signature is not None
    items = root.find("{*}administrativeData")
    assert items is not None
    items.append(signature)
    assert read_dcc(etree.tostring(root)).signature.word is XmlSignatureWord.INVALID


def test_refuses_a_file_that_is_no_x509_certificate(keys: KeyFolder, tmp_path: Path) -> None:
    path = tmp_path / "lab.pem"
    path.write_text("text")
    with pytest.raises(InputError, match=r"not an X\.509 certificate"):
        trust_laboratory(path, keys.folder)

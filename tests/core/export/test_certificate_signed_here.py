"""Our signature of a certificate: verified by xmlsec1, and invalid after any change."""

from __future__ import annotations

import base64
import random
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat
from lxml import etree
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.calibration.records import CalibrationStore
from ocmm_core.errors import InputError
from ocmm_core.export.audits import audit
from ocmm_core.export.certificate import (
    XmlSignatureWord,
    certificate_of_cameras,
    check_dcc_seal,
    read_dcc,
    trust_laboratory,
    write_certificate,
)
from ocmm_core.seals import KeyFolder, SealWord, StationKey, document_key, station_certificate
from tests.core.calibration.made_records import make_record, make_verification
from tests.core.export.certificate_site import lab
from tests.host import amount, needs_tools
from tests.other_station import other_station

NOW = datetime(2026, 11, 25, 12, tzinfo=UTC)
CHANGES = amount(200, 2000)
DS = "{http://www.w3.org/2000/09/xmldsig#}"


@pytest.fixture(name="path", scope="module")
def _path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    store, record = CalibrationStore(folder / "cameras"), make_record()
    store.accept(record, "Ada", "first", NOW)
    store.verify(make_verification(record), NOW)
    return write_certificate(certificate_of_cameras(store, lab(folder)), folder / "out")


def xmlsec(path: Path, pem: Path) -> bool:
    told = subprocess.run(
        ["xmlsec1", "--verify", "--enabled-key-data", "x509", "--trusted-pem", pem, path],
        check=False, capture_output=True,
    )  # fmt: skip
    return told.returncode == 0


def test_another_program_verifies_it_with_the_certificate_of_the_station(
    path: Path, tmp_path: Path
) -> None:
    needs_tools("xmlsec1")
    pem, other, changed = (tmp_path / name for name in ("own.pem", "other.pem", "changed.xml"))
    assert CliRunner().invoke(app, ["key", "show", "--x509", str(pem)]).exit_code == 0
    assert xmlsec(path, pem)
    with other_station(tmp_path):
        CliRunner().invoke(app, ["key", "show", "--x509", str(other)])
    assert not xmlsec(path, other)
    changed.write_bytes(path.read_bytes().replace(b"400.0", b"401.0", 1))
    assert not xmlsec(changed, pem)


def test_is_xades_baseline(path: Path) -> None:
    signature = etree.parse(path).getroot()[-1]
    assert signature.tag == f"{DS}Signature"
    said = {str(etree.QName(one).localname) for one in signature.iter()}
    assert {"SigningTime", "SigningCertificateV2", "DataObjectFormat"} <= said
    kinds = {one.get("Algorithm", "") for one in signature.iter()} - {""}
    assert {kind.rpartition("/")[2] for kind in kinds} == {
        "xml-exc-c14n#", "xmldsig-more#ecdsa-sha256", "xmlenc#sha256", "xmldsig#enveloped-signature"
    }  # fmt: skip


def test_judges_signers(path: Path, tmp_path: Path) -> None:
    found = check_dcc_seal(path, KeyFolder())
    assert (found.dcc.signature.word, found.sound) == (XmlSignatureWord.VALID, True)
    assert "this station" in found.summary
    assert audit(path).intact
    key = KeyFolder().station_key()
    pem = tmp_path / "station.pem"
    pem.write_bytes(station_certificate(key).public_bytes(Encoding.PEM))
    with other_station(tmp_path / "other"):
        keys = KeyFolder()
        found = check_dcc_seal(path, keys)
        assert found.dcc.signature.word is XmlSignatureWord.UNKNOWN_SIGNER
        assert (found.state.word, found.sound) == (SealWord.UNKNOWN_KEY, False)
        keys.trust(key.public, "Room 2", "Ada", "test", NOW)
        assert check_dcc_seal(path, keys).state.signer.startswith("Room 2")
        trusting = KeyFolder(tmp_path / "laboratories only")
        trust_laboratory(pem, trusting.folder)
        found = check_dcc_seal(path, trusting)
        assert found.dcc.signature.word is XmlSignatureWord.VALID


def mutated(content: bytes, rng: random.Random) -> bytes:
    """Return a document with one byte changed, or one way of writing XML changed."""
    changed = bytearray(content)
    way, at = rng.randrange(8), rng.randrange(len(content))
    gaps = [k + 1 for k in range(len(content)) if content[k : k + 1] == b">"][:-1]
    gap = rng.choice(gaps)
    if way <= 2:
        changed[at] ^= 1 << rng.randrange(7)
        return bytes(changed)
    if way == 3:
        lines = [k for k, sign in enumerate(content) if sign in b" \n"]
        changed[rng.choice(lines)] = rng.choice(b" \t\n")
        return bytes(changed)
    added = {
        4: b"<!-- a note -->", 5: b"<?a note?>", 6: b" ", 7: b"<b:x xmlns:b='urn:b'/>",
    }[way]  # fmt: skip
    return content[:gap] + added + content[gap:]


def test_no_changed_byte_stays_valid(path: Path, tmp_path: Path) -> None:
    content, rng, keys = path.read_bytes(), random.Random(20261128), KeyFolder()  # noqa: S311
    file = tmp_path / "changed.dcc.xml"
    judged = 0
    for _ in range(CHANGES):
        made = mutated(content, rng)
        if made == content:
            continue
        file.write_bytes(made)
        try:
            found = check_dcc_seal(file, keys)
        except InputError:
            continue
        judged += 1
        assert not found.sound, made
        assert found.dcc.signature.word is not XmlSignatureWord.VALID
    assert judged > CHANGES // 3


@pytest.mark.parametrize(
    "how", ["wrapped", "moved", "doubled", "foreign beside", "base64", "namespace", "after"]
)
def test_tricks_with_signatures(path: Path, tmp_path: Path, how: str) -> None:
    content, keys = path.read_bytes(), KeyFolder()
    root = etree.fromstring(content)
    signature = root[-1]
    if how == "wrapped":
        # The whole signed document inside another one that is read.
        outer = etree.fromstring(content.replace(b"400.0", b"401.0"))
        outer.remove(outer[-1])
        comment = etree.SubElement(outer, "{https://ptb.de/dcc}comment")
        comment.append(root)
        root = outer
    elif how == "moved":
        root.insert(0, signature)
    elif how == "doubled":
        root.append(etree.fromstring(etree.tostring(signature)))
    elif how == "foreign beside":
        root.append(etree.fromstring(f'<x xmlns:ds="{DS[1:-1]}"><ds:Signature/></x>'))
    made = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    if how == "base64":
        made = content.replace(b"</ds:SignatureValue>", b"\n</ds:SignatureValue>")
    elif how == "namespace":
        made = content.replace(b"<dcc:items>", b"<dcc:items xmlns:si='urn:si'>", 1)
    elif how == "after":
        made = content + b"<!-- a note -->"
    assert made != content
    file = tmp_path / "changed.dcc.xml"
    file.write_bytes(made)
    found = check_dcc_seal(file, keys)
    assert not found.sound
    assert found.dcc.signature.word is not XmlSignatureWord.VALID
    assert not audit(file).intact


@pytest.mark.parametrize("note", ["<!-- -->", "<?note?>", "<!-- --><!-- -->"])
def test_refuses_a_number_that_a_comment_divides(path: Path, note: str) -> None:
    text = path.read_bytes().replace(b"<si:value>400.0<", f"<si:value>40{note}0.0<".encode())
    with pytest.raises(InputError, match="a comment divides a text"):
        read_dcc(text)


def test_a_station_with_its_key_on_p256_issues_certificates() -> None:
    private = ec.generate_private_key(ec.SECP256R1())

    def sign(content: bytes) -> bytes:
        r, s = decode_dss_signature(private.sign(content, ec.ECDSA(SHA256())))
        return r.to_bytes(32, "big") + s.to_bytes(32, "big")

    public = private.public_key().public_bytes(Encoding.X962, PublicFormat.CompressedPoint)
    made = document_key(StationKey(sign, public, "token"), "V-1 \u202e" + 60 * "x")
    leaf, station = made.chain
    leaf.verify_directly_issued_by(station)
    station.verify_directly_issued_by(station)
    assert station.public_key() == private.public_key()
    assert leaf.extensions.get_extension_for_class(x509.BasicConstraints).value.ca is False
    assert base64.b64encode(leaf.public_bytes(Encoding.DER)) == base64.b64encode(
        x509.load_pem_x509_certificate(leaf.public_bytes(Encoding.PEM)).public_bytes(Encoding.DER)
    )

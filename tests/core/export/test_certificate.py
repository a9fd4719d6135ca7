"""Papers about the machine: DCC by the schema, read back by another reader, signed, hostile."""

from __future__ import annotations

import random
import xml.etree.ElementTree as Plain
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest
from lxml import etree

from ocmm_core.calibration.records import (
    ArtefactUse,
    CalibrationStore,
    ProbeStore,
    load_bar,
    load_sphere,
    record_hash,
)
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.export.certificate import (
    SEAL_SUFFIX,
    Certificate,
    CertificateLine,
    Conformity,
    artefact_text,
    certificate_facts,
    certificate_of_cameras,
    certificate_of_tip,
    check_dcc_seal,
    read_dcc,
    write_certificate,
    write_certificates,
)
from ocmm_core.export.certificate._artefact import Expansion
from ocmm_core.export.certificate._seal import CertificateSeal
from ocmm_core.export.report import NOT_STATED
from ocmm_core.export.template import plain_paper
from ocmm_core.seals import KeyFolder, SealWord, Signed, sign
from tests.core.calibration.made_probe_records import make_probe_record, make_tip_record
from tests.core.calibration.made_records import make_record, make_verification
from tests.core.export.certificate_site import lab
from tests.core.export.dcc_schema import dcc_schema
from tests.core.export.unsigned_dcc import dcc_bytes, open_certificate_clauses
from tests.host import amount

NOW = datetime(2026, 11, 25, 12, tzinfo=UTC)
MUTATIONS = amount(100, 1000)


def store_with(folder: Path, *errors_mm: float) -> CalibrationStore:
    """Return a store whose calibration was renewed and verified with these errors, oldest first."""
    store = CalibrationStore(folder / "cameras")
    previous = ""
    for number, error in enumerate(errors_mm):
        when = NOW - timedelta(days=100 * (len(errors_mm) - number))
        record = make_record(
            made_utc=when.isoformat(), previous=previous, data_sha256=f"{number:064x}",
            valid_until_utc=(when + timedelta(days=365)).isoformat(),
        )  # fmt: skip
        previous = store.accept(record, "Ada", "renewed", when)
        plain = make_verification(record, passed=abs(error) < 0.02)
        check = msgspec.structs.replace(plain.checks[0], measured_mm=400.0 + error)
        bar = ArtefactUse(
            name="bar", serial="LB-7", certificate="K 2291", certificate_sha256="0" * 64,
            due_utc="2027-01-01T00:00:00+00:00",
        )  # fmt: skip
        later = when + timedelta(hours=1)
        store.verify(
            msgspec.structs.replace(
                plain,
                checks=(check, *plain.checks[1:]),
                artefacts=(bar,),
                made_utc=later.isoformat(),
            ),
            later,
        )
    return store


@pytest.fixture(name="cameras")
def _cameras(tmp_path: Path) -> Certificate:
    return certificate_of_cameras(store_with(tmp_path, 0.0312345678912, 0.0011), lab(tmp_path))


@pytest.fixture(name="tip")
def _tip(tmp_path: Path) -> Certificate:
    store = ProbeStore(tmp_path / "probe")
    record = make_probe_record()
    store.calibrate(record, "Ada", "first", NOW)
    found = make_tip_record(record)
    store.qualify(found, NOW)
    return certificate_of_tip(store, found.tip, lab(tmp_path))


def test_both_runs_are_there_where_something_was_adjusted(cameras: Certificate) -> None:
    assert [run.status for run in cameras.runs] == ["beforeAdjustment", "afterAdjustment"]
    found, after = cameras.runs
    assert found.lines[0].error == pytest.approx(0.0312345678912)
    assert after.lines[0].error == pytest.approx(0.0011)
    assert (found.passed, after.passed) == (False, True)
    facts = {fact.name: fact.value for fact in certificate_facts(cameras)}
    assert facts["Condition"] == "As found and after adjustment, both below."


def test_a_second_verification_is_one_as_found(tmp_path: Path) -> None:
    store = store_with(tmp_path, 0.001)
    active = store.active()
    assert active is not None
    again = msgspec.structs.replace(
        make_verification(active, passed=True), made_utc=NOW.isoformat(), data_sha256="e" * 64
    )
    store.verify(again, NOW)
    paper = certificate_of_cameras(store, plain_paper())
    assert [run.status for run in paper.runs] == ["beforeAdjustment"]
    assert paper.runs[0].record == record_hash(again)


def test_what_was_never_tested_has_no_paper(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path / "cameras")
    with pytest.raises(InputError, match="no calibration"):
        certificate_of_cameras(store, plain_paper())
    store.accept(make_record(), "Ada", "first", NOW)
    with pytest.raises(InputError, match="not verified"):
        certificate_of_cameras(store, plain_paper())
    probe = ProbeStore(tmp_path / "probe")
    with pytest.raises(InputError, match="not qualified"):
        certificate_of_tip(probe, "6 mm", plain_paper())


def test_no_clause_is_open_but_what_nobody_stated(tmp_path: Path, cameras: Certificate) -> None:
    warm = replace(cameras, runs=tuple(replace(run, temperature_c=20.4) for run in cameras.runs))
    assert open_certificate_clauses(warm) == ()
    bare = replace(cameras, paper=plain_paper(), runs=cameras.runs[:0], artefacts=())
    assert open_certificate_clauses(bare) == (
        "7.8.2.1 b", "7.8.2.1 c", "7.8.2.1 e", "7.8.4.1 b", "7.8.4.1 c", "7.8.4.1 d", "7.8.4.1 e",
    )  # fmt: skip


@pytest.mark.parametrize("which", ["cameras", "tip"])
def test_the_words_of_a_certificate_stand_only_with_an_accreditation(
    which: str, request: pytest.FixtureRequest
) -> None:
    paper: Certificate = request.getfixturevalue(which)
    assert "alibration certificate" not in dcc_bytes(paper).decode()
    assert "no certificate of an accredited laboratory" in dcc_bytes(paper).decode()
    assert b"calibrationLaboratoryCode" not in dcc_bytes(paper)
    accredited = replace(paper, accreditation="D-K-00000-00")
    assert b"calibrationLaboratoryCode>D-K-00000-00<" in dcc_bytes(accredited)


@pytest.mark.parametrize("which", ["cameras", "tip"])
def test_it_is_valid_by_the_schema(
    which: str, request: pytest.FixtureRequest, reference: Path, tmp_path: Path
) -> None:
    schema = dcc_schema(reference)
    paper: Certificate = request.getfixturevalue(which)
    for one in (paper, replace(paper, paper=plain_paper()), replace(paper, runs=()),
                replace(paper, artefacts=()), replace(paper, previous="a" * 64)):  # fmt: skip
        document = etree.fromstring(dcc_bytes(one))
        assert schema.validate(document), schema.error_log
    signed = etree.parse(write_certificate(paper, tmp_path))
    assert schema.validate(signed), schema.error_log
    signed.getroot().insert(0, signed.getroot()[-1])
    assert not schema.validate(signed)


def numbers_by_another_reader(content: bytes) -> list[tuple[str, float, float | None]]:
    """Return label, value and U of every number: no code of the product, no lxml."""
    space = "{https://ptb.de/si}"
    found = []
    for real in Plain.fromstring(content).iter(  # noqa: S314 -- ours
        f"{space}real"
    ):
        unc = real.find(f"{space}expandedUnc/{space}uncertainty")
        found.append(
            (
                str(real.findtext(f"{space}label")),
                float(str(real.findtext(f"{space}value"))),
                None if unc is None else float(str(unc.text)),
            )
        )
    return found


@pytest.mark.parametrize("which", ["cameras", "tip"])
def test_another_reader_has_the_same_numbers(which: str, request: pytest.FixtureRequest) -> None:
    paper: Certificate = request.getfixturevalue(which)
    found = numbers_by_another_reader(dcc_bytes(paper))
    errors = [(value, unc) for label, value, unc in found if label == "error"]
    wanted = [(line.error, line.expanded) for run in paper.runs for line in run.lines]
    assert len(errors) == len(wanted) > 0
    told, asked = np.array(errors, dtype=float), np.array(wanted)
    np.testing.assert_allclose(told, asked, rtol=0.0, atol=1e-9)
    limits = [value for label, value, _ in found if label == "maximum permissible error"]
    assert limits == [line.limit for run in paper.runs for line in run.lines]
    for value in paper.values:
        one = next(one for one in found if one[0] == value.name)
        assert one[1] == pytest.approx(value.value, abs=1e-9)
        assert one[2] == (None if value.expanded is None else pytest.approx(value.expanded))


@pytest.mark.parametrize(
    ("error", "unc", "word"),
    [
        (0.010, 0.005, Conformity.CONFORM),
        (-0.016, 0.005, Conformity.LEANING_IN),
        (0.023, 0.005, Conformity.LEANING_OUT),
        (-0.030, 0.005, Conformity.NOT_CONFORM),
        (0.015, 0.005, Conformity.CONFORM),
    ],
)
def test_an_error_conforms_only_beyond_its_uncertainty(
    error: float, unc: float, word: Conformity
) -> None:
    assert CertificateLine("line", error, 0.0, unc, 0.020).conformity is word


def test_a_number_that_is_none_is_refused(cameras: Certificate) -> None:
    run = cameras.runs[0]
    bad = replace(run.lines[0], measured=float("nan"))
    with pytest.raises(StorageError, match="no number for a certificate"):
        dcc_bytes(replace(cameras, runs=(replace(run, lines=(bad,)),)))


def test_reads_a_detached_signature_of_older_versions(cameras: Certificate, tmp_path: Path) -> None:
    path = tmp_path / f"{cameras.number}.dcc.xml"
    path.write_bytes(dcc_bytes(cameras))
    beside = path.with_name(path.name + SEAL_SUFFIX)
    signature = sign(
        KeyFolder().station_key(), Signed.CERTIFICATE, read_dcc(path.read_bytes()).canonical
    )
    seal = CertificateSeal(
        schema="ocmm.certificate-seal/1", number=cameras.number, signature=signature
    )
    beside.write_bytes(msgspec.json.encode(seal))
    found = check_dcc_seal(path, KeyFolder())
    assert found.state.word is SealWord.SEALED
    assert found.dcc.number == cameras.number
    # Another way to write the same document down is the same document.
    tree = etree.parse(path)
    path.write_bytes(etree.tostring(tree))
    assert check_dcc_seal(path, KeyFolder()).state.word is SealWord.SEALED
    beside.unlink()
    unsigned = check_dcc_seal(path, KeyFolder())
    assert unsigned.state.word is SealWord.NOT_SIGNED
    assert "for information only" in unsigned.summary


def mutated(content: bytes, rng: random.Random) -> bytes:
    """Return a document with one thing changed: a byte, a stretch, a line, or a copy of one."""
    changed = bytearray(content)
    place = rng.randrange(len(changed))
    way = rng.randrange(6)
    if way == 0:
        changed[place] = rng.randrange(256)
    elif way == 1:
        del changed[place : place + rng.randrange(1, 40)]
    elif way == 2:
        changed[place:place] = bytes(rng.choice(b"0123456789.-<>&'\"ae ") for _ in range(3))
    elif way == 3:
        digits = [k for k, sign in enumerate(changed) if chr(sign).isdigit()]
        changed[rng.choice(digits)] = ord(rng.choice("0123456789"))
    else:
        lines = content.split(b"\n")
        first, second = rng.randrange(len(lines)), rng.randrange(len(lines))
        if way == 4:
            lines[first], lines[second] = lines[second], lines[first]
        else:
            lines.insert(first, lines[second])
        return b"\n".join(lines)
    return bytes(changed)


def test_of_many_changed_certificates_none_is_accepted(
    cameras: Certificate, tmp_path: Path
) -> None:
    path = write_certificate(cameras, tmp_path / "out")
    original = path.read_bytes()
    rng = random.Random(20261125)  # noqa: S311 -- changes, no secrets
    keys = KeyFolder()
    told = {"refused": 0, "forged": 0, "same": 0}
    for _ in range(MUTATIONS):
        path.write_bytes(mutated(original, rng))
        try:
            found = check_dcc_seal(path, keys)
        except OcmmError:
            told["refused"] += 1
            continue
        if path.read_bytes() == original:
            told["same"] += 1
            continue
        # Without its signature it is unsigned; with any change to it or to the content, forged.
        assert not found.sound
        told["forged"] += 1
    assert sum(told.values()) == MUTATIONS
    # Both guards were tried, and hardly any change changed nothing.
    assert min(told["refused"], told["forged"]) > MUTATIONS // 10
    assert told["same"] < 0.15 * MUTATIONS


BOMB = b"""<?xml version="1.0"?>
<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>
<dcc:digitalCalibrationCertificate xmlns:dcc="https://ptb.de/dcc" schemaVersion="3.1.2">&b;
</dcc:digitalCalibrationCertificate>"""
FETCH = b"""<?xml version="1.0"?>
<!DOCTYPE x SYSTEM "file:///etc/passwd" [<!ENTITY f SYSTEM "file:///etc/passwd">]>
<dcc:digitalCalibrationCertificate xmlns:dcc="https://ptb.de/dcc" schemaVersion="3.1.2">&f;
</dcc:digitalCalibrationCertificate>"""
HEAD = b'<dcc:digitalCalibrationCertificate xmlns:dcc="https://ptb.de/dcc" schemaVersion="3.1.2">'


@pytest.mark.parametrize(
    "content",
    [
        b"", b"no xml", b"<a/>", BOMB, FETCH, b"\xff\xfe\x00", HEAD,
        HEAD.replace(b"3.1.2", b"2.4.0") + b"</dcc:digitalCalibrationCertificate>",
        HEAD + b"<a>" * 200 + b"</a>" * 200 + b"</dcc:digitalCalibrationCertificate>",
        b" " * 20_000_001,
    ],
    ids=["empty", "text", "other", "bomb", "fetch", "binary", "cut", "old", "deep", "large"],
)  # fmt: skip
def test_what_is_hostile_is_refused(content: bytes) -> None:
    with pytest.raises(InputError, match="no digital calibration certificate"):
        read_dcc(content)


def with_real(cameras: Certificate, *reals: tuple[str, str, str, str, str]) -> bytes:
    """Return a foreign certificate: name, value, unit, U and k of its quantities."""
    root = etree.fromstring(dcc_bytes(replace(cameras, values=(), runs=cameras.runs[1:])))
    results = root.find(".//{*}results")
    assert results is not None
    for child in list(results):
        results.remove(child)
    for name, value, unit, unc, k in reals:
        results.append(etree.fromstring(
            f'<dcc:result xmlns:dcc="https://ptb.de/dcc" xmlns:si="https://ptb.de/si"><dcc:name>'
            f"<dcc:content>{name}</dcc:content></dcc:name><dcc:data><dcc:quantity><si:real>"
            f"<si:value>{value}</si:value><si:unit>{unit}</si:unit><si:expandedUnc>"
            f"<si:uncertainty>{unc}</si:uncertainty><si:coverageFactor>{k}</si:coverageFactor>"
            "<si:coverageProbability>0.95</si:coverageProbability></si:expandedUnc></si:real>"
            "</dcc:quantity></dcc:data></dcc:result>"
        ))  # fmt: skip
    return etree.tostring(root)


STEEL = Expansion(11.5e-6, 0.5e-6)


def test_a_sphere_comes_from_its_certificate(cameras: Certificate, tmp_path: Path) -> None:
    content = with_real(
        cameras,
        ("Diameter", "0.0249987", "\\metre", "0.3e-6", "2.0"),
        ("Expansion", "5.5e-6", "\\kelvin\\tothe{-1}", "1e-6", "2.0"),
    )
    path = tmp_path / "sphere.toml"
    path.write_text(artefact_text(read_dcc(content), "sphere", "2027-11-25"), encoding="utf-8")
    sphere = load_sphere(path)
    assert sphere.diameter == pytest.approx(24.9987, abs=1e-12)
    assert sphere.artefact.expanded == pytest.approx(0.0003, abs=1e-15)
    assert (sphere.artefact.expansion, sphere.artefact.expansion_sigma) == (5.5e-6, 0.5e-6)
    use = sphere.artefact.use
    assert (use.certificate, use.certificate_sha256) == (cameras.number, read_dcc(content).sha256)
    assert use.due_utc.startswith("2027-11-25")


def test_u_is_brought_to_two_standard_uncertainties(cameras: Certificate, tmp_path: Path) -> None:
    content = with_real(
        cameras,
        ("Length A", "500.0012", "\\milli\\metre", "0.6", "3.0"),
        ("Length B", "900.0034", "\\milli\\metre", "0.003", "3.0"),
    )
    dcc = read_dcc(content)
    with pytest.raises(InputError, match="states 2 lengths"):
        artefact_text(dcc, "bar", "2027-11-25", expansion=STEEL)
    with pytest.raises(InputError, match="no thermal expansion"):
        artefact_text(dcc, "bar", "2027-11-25", quantity="length b")
    path = tmp_path / "bar.toml"
    text = artefact_text(dcc, "bar", "2027-11-25", quantity="length b", expansion=STEEL)
    path.write_text(text, encoding="utf-8")
    bar = load_bar(path)
    assert list(bar.nests) == [0.0, 900.0034]
    assert bar.artefact.expanded == pytest.approx(0.002, abs=1e-15)


@pytest.mark.parametrize(
    ("unit", "unc", "k", "due", "message"),
    [
        ("\\kilogram", "0.1", "2", "2027-11-25", "no diameters"),
        ("\\milli\\metre", "-0.1", "2", "2027-11-25", "U = -0.1"),
        ("\\milli\\metre", "0.1", "0", "2027-11-25", "no diameters"),
        ("\\milli\\metre", "0.1", "2", "25.11.2027", "is no date"),
        ("\\milli\\metre", "nan", "2", "2027-11-25", "is no number"),
        ("\\milli\\metre", "1_0", "2", "2027-11-25", "is no number"),
    ],
)
def test_a_certificate_that_states_less_becomes_no_artefact(
    cameras: Certificate, unit: str, unc: str, k: str, due: str, message: str
) -> None:
    content = with_real(cameras, ("Diameter", "25.0", unit, unc, k))
    with pytest.raises(InputError, match=message):
        artefact_text(read_dcc(content), "sphere", due, expansion=STEEL)


def test_hostile_names_stay_text(cameras: Certificate, tmp_path: Path) -> None:
    nasty = 'x"\\n[certificate]\\nnumber="y'
    item = replace(cameras, item=nasty, number=nasty)
    content = with_real(item, ("Diameter", "25.0", "\\milli\\metre", "0.0003", "2"))
    path = tmp_path / "sphere.toml"
    text = artefact_text(read_dcc(content), "sphere", "2027-11-25", expansion=STEEL)
    path.write_text(text, encoding="utf-8")
    assert load_sphere(path).artefact.use.certificate == nasty


def test_not_stated_is_said_in_words(cameras: Certificate) -> None:
    root = etree.fromstring(dcc_bytes(replace(cameras, paper=plain_paper())))
    assert root.findtext(".//{*}countryCodeISO3166_1") == "ZZ"
    assert root.findtext(".//{*}calibrationLaboratory//{*}name/{*}content") == NOT_STATED


def test_pages_dcc_and_signature_are_one_write(cameras: Certificate, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    # The last of the files cannot be written: a folder is in its place.
    (folder / f"{cameras.number}.dcc.xml").mkdir(parents=True)
    with pytest.raises(StorageError, match="cannot be written"):
        write_certificates([(cameras, lambda _: b"%PDF")], folder)
    assert [path.name for path in folder.iterdir()] == [f"{cameras.number}.dcc.xml"]
    (folder / f"{cameras.number}.dcc.xml").rmdir()
    written = write_certificates([(cameras, lambda _: b"%PDF")], folder)
    assert set(written) == set(folder.iterdir())
    assert [path.suffix for path in written] == [".pdf", ".xml"]

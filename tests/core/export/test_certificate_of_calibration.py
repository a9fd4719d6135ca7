"""The paper of a calibration of cameras: parameters with U, as found and after the adjustment."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest
from lxml import etree

from ocmm_core.calibration.records import (
    ArtefactUse,
    CalibrationStore,
    CameraRecord,
    entry_of,
    record_hash,
)
from ocmm_core.camera import N_PARAMETERS, camera_of
from ocmm_core.errors import InputError
from ocmm_core.export.certificate import (
    Certificate,
    certificate_facts,
    certificate_of_calibration,
    certificate_of_folder,
    check_dcc_seal,
    read_dcc,
    write_certificate,
)
from ocmm_core.export.template import plain_paper
from ocmm_core.seals import KeyFolder, SealWord
from tests.core.calibration.made_records import MADE, make_record, make_verification
from tests.core.export.certificate_site import lab
from tests.core.export.dcc_schema import dcc_schema
from tests.core.export.unsigned_dcc import dcc_bytes, open_certificate_clauses

Q = "{https://ptb.de/dcc}"
DRIFT_MM = 0.05


def later_record(previous: str) -> CameraRecord:
    """Return a calibration a year later: the first camera was pushed."""
    record = make_record()
    first = record.cameras[0]
    x, y, z = first.centre
    moved = msgspec.structs.replace(first, centre=(x + DRIFT_MM, y, z), focal=first.focal * 1.0001)
    return make_record(
        cameras=(moved, *record.cameras[1:]), previous=previous, data_sha256="d" * 64,
        made_utc=(MADE + timedelta(days=300)).isoformat(),
    )  # fmt: skip


def store_in(folder: Path, *, found: bool, after: bool) -> CalibrationStore:
    store = CalibrationStore(folder / "cameras")
    record = make_record()
    previous = store.accept(record, "Ada", "first", MADE)
    if found:
        early = make_verification(record, passed=False)
        late = MADE + timedelta(days=299)
        store.verify(msgspec.structs.replace(early, made_utc=late.isoformat()), late)
    newer = later_record(previous)
    store.accept(newer, "Ada", "pushed", MADE + timedelta(days=300))
    if after:
        when = MADE + timedelta(days=301)
        made = msgspec.structs.replace(
            make_verification(newer), made_utc=when.isoformat(), data_sha256="e" * 64
        )
        store.verify(made, when)
    return store


@pytest.fixture(name="whole")
def _whole(tmp_path: Path) -> Certificate:
    store = store_in(tmp_path, found=True, after=True)
    return certificate_of_calibration(store, lab(tmp_path))


def facts(paper: Certificate) -> dict[str, str]:
    return {fact.name: fact.value for fact in certificate_facts(paper)}


def test_no_clause_is_open(whole: Certificate) -> None:
    # The records of the test rest on no artefact, and a paper without one must say so.
    assert open_certificate_clauses(whole) == ("7.8.4.1 c",)
    bar = ArtefactUse(
        name="bar", serial="LB-7", certificate="K 2291", certificate_sha256="0" * 64, due_utc=""
    )
    assert open_certificate_clauses(replace(whole, artefacts=(bar,))) == ()


def test_both_states_are_in_it_with_their_parameters(whole: Certificate) -> None:
    assert [run.status for run in whole.runs] == ["beforeAdjustment", "afterAdjustment"]
    assert [run.passed for run in whole.runs] == [False, True]
    assert whole.passed
    assert facts(whole)["Condition"] == "As found and after adjustment, both below."
    before = {one.name: one.value for one in whole.values_before}
    after = {one.name: one for one in whole.values}
    name = make_record().cameras[0].name
    centre = f"{name}: projection centre X"
    assert after[centre].value - before[centre] == pytest.approx(DRIFT_MM, abs=1e-9)
    cameras = len(make_record().cameras)
    assert len(before) == N_PARAMETERS * cameras
    assert whole.number.startswith("C-")


@pytest.mark.parametrize(
    ("found", "after", "words"),
    [
        (False, True, "As found: not determined (the calibration before has no verification). "
                      "After adjustment: below."),
        (True, False, "As found: below. After adjustment: not determined (the calibration was not "
                      "verified; it must not be measured with until it is)."),
    ],
)  # fmt: skip
def test_a_state_that_was_not_determined_is_said_in_words(
    tmp_path: Path, found: bool, after: bool, words: str
) -> None:
    paper = certificate_of_calibration(store_in(tmp_path, found=found, after=after), lab(tmp_path))
    assert facts(paper)["Condition"] == words
    assert paper.passed is after
    conformity = facts(paper)["Conformity"]
    assert conformity.startswith("Passed" if after else "No statement: ")
    root = etree.fromstring(dcc_bytes(paper))
    overall = root.findall(f".//{Q}statements/{Q}statement/{Q}conformity")
    assert [one.text for one in overall] == ["pass" if after else "noPass"]


def test_a_failure_as_found_is_no_verdict_on_the_new_calibration(tmp_path: Path) -> None:
    # The run as found failed; after the adjustment there was no test. Neither word may appear.
    paper = certificate_of_calibration(store_in(tmp_path, found=True, after=False), lab(tmp_path))
    assert paper.final is None
    assert paper.runs[0].word == "fail"
    assert not facts(paper)["Conformity"].startswith(("Passed", "NOT passed"))


def test_the_first_calibration_has_nothing_before(tmp_path: Path) -> None:
    store = CalibrationStore(tmp_path / "cameras")
    with pytest.raises(InputError, match="no calibration"):
        certificate_of_calibration(store, plain_paper())
    store.accept(make_record(), "Ada", "first", MADE)
    paper = certificate_of_folder(tmp_path / "cameras", plain_paper(), calibration=True)
    assert "this is the first calibration" in facts(paper)["Condition"]
    assert paper.values_before == ()


def test_u_is_that_of_the_covariance() -> None:
    """20,000 drawn parameter sets scatter as stated; 3 % is six sigma of a standard deviation."""
    record = make_record()
    entry = record.cameras[0]
    covariance = np.array(record.covariance)[:N_PARAMETERS, :N_PARAMETERS]
    rng = np.random.default_rng(5)
    camera = camera_of(entry)
    # The centre alone: c = -R^T t moves with rotation and translation together.
    changes = rng.multivariate_normal(np.zeros(N_PARAMETERS), covariance, size=20_000)
    drawn = np.array([camera.perturbed(one).centre_world for one in changes])
    from ocmm_core.export.certificate._from_calibration import _stated

    _, sigmas = _stated(entry, covariance)
    np.testing.assert_allclose(drawn.std(axis=0), sigmas[:3], rtol=0.03)


def test_half_a_turn_has_no_jump() -> None:
    """A rotation by nearly pi is written with either sign; its U must not be that jump."""
    from ocmm_core.export.certificate._from_calibration import _stated

    record = make_record()
    entry = msgspec.structs.replace(record.cameras[0], rotation_vector=(np.pi - 1e-9, 0.0, 0.0))
    entry = entry_of(camera_of(entry), entry.alias)
    covariance = np.array(record.covariance)[:N_PARAMETERS, :N_PARAMETERS]
    _, sigmas = _stated(entry, covariance)
    assert np.all(sigmas[3:6] < 0.1)


@pytest.mark.parametrize(("found", "after"), [(True, True), (False, True), (True, False)])
def test_it_is_valid_by_the_schema_and_read_back(
    tmp_path: Path, found: bool, after: bool, reference: Path
) -> None:
    paper = certificate_of_calibration(store_in(tmp_path, found=found, after=after), lab(tmp_path))
    schema = dcc_schema(reference)
    document = etree.fromstring(dcc_bytes(paper))
    assert schema.validate(document), schema.error_log
    wanted = (*paper.values_before, *paper.values)
    told = read_dcc(dcc_bytes(paper)).quantities[-len(wanted) :]
    assert [(one.value, one.expanded) for one in told] == [
        (one.value, one.expanded) for one in wanted
    ]
    states = [one.text for one in document.iter(f"{Q}status")]
    assert ("beforeAdjustment" in states, "afterAdjustment" in states) == (True, True)


def test_it_is_signed(whole: Certificate, tmp_path: Path) -> None:
    path = write_certificate(whole, tmp_path / "out")
    found = check_dcc_seal(path, KeyFolder())
    assert found.state.word is SealWord.SEALED
    assert found.dcc.number == whole.number
    assert whole.previous == record_hash(make_record())

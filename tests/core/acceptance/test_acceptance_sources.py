"""Tests over the virtual wire and from recordings, and cameras that cannot prove their order."""

from __future__ import annotations

import threading
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core.acceptance import (
    AcceptanceProcedure,
    AcceptanceVerdict,
    differences,
    load_signed_record,
    recompute,
)
from ocmm_core.acquisition.recording import ReplaySource
from ocmm_core.composition import AcceptanceBench, StatedConditions, StationRequest, open_test_site
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError, InputError, OcmmError
from tests.commands import Ocmm
from tests.core.acceptance.acceptance_site import ROOM
from tests.core.station.test_unproven_cameras import rig_of
from tests.host import HANG_S, private_network

PLAN = resource("plans", "quick.toml")


def _bench(folder: Path, source: str, **more: object) -> AcceptanceBench:
    request = StationRequest(plan=PLAN, out=folder / "job", source=source, **more)  # type: ignore[arg-type]
    recorded = ""
    if source.startswith("replay:"):
        kept = ReplaySource(Path(source.removeprefix("replay:")))
        recorded = kept.recording.head.source
        kept.close()
    return AcceptanceBench(request, recorded, folder / "tests", folder / "artefacts")


def _begun(bench: AcceptanceBench, name: str) -> AcceptanceProcedure:
    now = datetime.now(UTC)
    offer = next(one for one in bench.procedures(now) if one.procedure.id == name)
    offers = bench.offers(offer, now, ROOM)
    return bench.start(offer, (offers[0].used,), StatedConditions(who="Ann"), now)


def _measured(bench: AcceptanceBench, procedure: AcceptanceProcedure) -> list[OcmmError]:
    """Take everything as soon as it is ready, as the window does with automatic taking."""
    over, failed = threading.Event(), []

    def fail(error: OcmmError) -> None:
        failed.append(error)
        over.set()

    def watch(block: object) -> None:
        procedure.watch(block)  # type: ignore[arg-type]
        if procedure.ready:
            procedure.record(datetime.now(UTC))
        if procedure.session.view.current < 0:
            over.set()

    hand = bench.hand(procedure, fail)
    assert hand is not None
    procedure.advance(datetime.now(UTC))
    hand(watch)
    assert over.wait(HANG_S)
    hand(None)
    return failed


@pytest.mark.slow
def test_a_short_test_runs_over_the_virtual_wire_as_the_window_does(tmp_path: Path) -> None:
    private_network()
    bench = _bench(tmp_path, "ethercat:virtual")
    procedure = _begun(bench, "INTERIM")
    assert _measured(bench, procedure) == []
    record = procedure.session.finish(datetime.now(UTC), ROOM)
    assert (record.verdict, len(record.observations)) == (AcceptanceVerdict.PASS, 10)
    assert differences(record, recompute(record)) == []
    # Spots came over the wire: they are those of the cameras, quantised as the cameras send them.
    assert all(one.uv is not None for one in record.observations)


@pytest.mark.slow
def test_a_short_test_runs_over_the_virtual_wire_on_the_command_line(
    ocmm_here: Ocmm, tmp_path: Path
) -> None:
    private_network()
    ran = ocmm_here(
        "acceptance", "run", "INTERIM", "--source", "ethercat:virtual", "--folder", tmp_path
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "EtherCAT, virtual wire" in ran.stdout
    (record,) = (tmp_path / "records").glob("*.json")
    assert len(load_signed_record(record).record.observations) == 10


@pytest.mark.slow
def test_a_recording_is_measured_in_the_window_and_not_twice(
    ocmm_here: Ocmm, calm_rig: Path, tmp_path: Path
) -> None:
    frames = tmp_path / "test.ocmmframes"
    made = ocmm_here(
        "acceptance", "run", "INTERIM", "--rig", calm_rig, "--folder", tmp_path / "first",
        "--record", frames,
    )  # fmt: skip
    assert made.returncode == 0, made.stdout + made.stderr
    (first,) = (
        load_signed_record(one).record for one in (tmp_path / "first" / "records").glob("*.json")
    )

    bench = _bench(tmp_path, f"replay:{frames}", rig=calm_rig)
    now = datetime.now(UTC)
    offer = next(one for one in bench.procedures(now) if one.procedure.id == "INTERIM")
    procedure = bench.start(offer, first.artefacts, StatedConditions(who="Ann"), now)
    assert _measured(bench, procedure) == []
    record = procedure.session.finish(datetime.now(UTC), ROOM)
    assert record.instrument.simulated
    for one, other in zip(record.values, first.values, strict=True):
        # The same touches, averaged over frames that begin elsewhere: within the noise of a point.
        assert abs(one.error_mm - other.error_mm) < 0.01

    # Its touches are not offered to a test that goes on.
    later = bench.start(offer, first.artefacts, StatedConditions(who="Ann"), datetime.now(UTC))
    with pytest.raises(InputError, match="does not go on"):
        bench.resume(later.session.path, ROOM)
    # A missing part of a recording is reported in a sentence.
    longer = next(one for one in bench.procedures(now) if one.procedure.id == "EFFECTIVE-DIAMETER")
    sphere = bench.start(
        longer, (_bench(tmp_path, "simulated", rig=calm_rig).offers(longer, now, ROOM)[0].used,),
        StatedConditions(who="Ann"), now,
    )  # fmt: skip
    (failed,) = _measured(bench, sphere)
    assert "The recording ended before the last point" in failed.what


def test_a_virtual_rig_without_touches_is_refused_before_the_test(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="plays no touches") as caught:
        _begun(_bench(tmp_path, "ethercat:pixels"), "INTERIM")
    assert "'simulated'" not in caught.value.remedy
    assert "ethercat:virtual" in caught.value.remedy
    assert "pixels" not in caught.value.remedy


def test_unproven_cameras_are_refused_unless_the_procedure_allows_them(
    ocmm_here: Ocmm, tmp_path: Path
) -> None:
    rig = rig_of(tmp_path)
    bench = _bench(tmp_path, "simulated", rig=rig)
    with pytest.raises(CalibrationError, match="no common clock") as caught:
        _begun(bench, "INTERIM")
    assert "'cameras' of a procedure" in caught.value.remedy
    own = tmp_path / "own.toml"
    text = resource("acceptance", "interim.toml").read_text()
    own.write_text(text.replace('unit = "mm"', 'unit = "mm"\ncameras = "unproven"', 1))
    site = open_test_site(
        str(own), [], "simulated", rig, resource("probes", "standard.toml"), None, None, None, 3
    )
    assert site.stage.procedure.cameras == "unproven"
    assert site.stage.instrument.states == ("SIMULATED", "CAMERAS UNPROVEN")
    ran = ocmm_here("acceptance", "run", own, "--rig", rig, "--folder", tmp_path / "allowed")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert "CAMERAS UNPROVEN: Cameras 'Plain spots': no common clock" in ran.stdout
    (record,) = (
        load_signed_record(one).record for one in (tmp_path / "allowed" / "records").glob("*.json")
    )
    assert record.instrument.unproven
    # A record of our own cameras has no such field, so that older records keep their hash.
    plain = open_test_site(
        "INTERIM", [], "simulated", resource("rigs", "recommended.toml"),
        resource("probes", "standard.toml"), None, None, None, 3,
    )  # fmt: skip
    assert plain.stage.instrument.states == ("SIMULATED",)
    assert not plain.stage.instrument.camera_doubts

"""A whole job with cameras that expose 10 ms apart, from a recording of the virtual rig."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ocmm_cli.measure import run_job
from ocmm_cli.terminal import PlainConsole
from ocmm_core.acquisition.frames import FrameBlock, SourceDescription
from ocmm_core.acquisition.recording import FrameRecorder, ReplaySource
from ocmm_core.camera import load_rig
from ocmm_core.composition import StationRequest, build_station, make_feed
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.inspection.evaluation import JobView
from ocmm_core.inspection.finished import reopen_job
from ocmm_core.inspection.plan import load_plan
from ocmm_core.measuring import Refusal
from ocmm_core.tracking import load_probe
from ocmm_sim.scene import Motion, VirtualRig, load_part
from ocmm_sim.sources import true_values

PLAN, RIG = resource("plans", "quick.toml"), resource("rigs", "recommended.toml")
PART, PROBE = resource("parts", "demo.toml"), resource("probes", "standard.toml")
_RATE_HZ, _FINE_HZ, _LATE_MS, _WAVE_S = 100, 1000, 10, 4.0


def waved(times: Float, middle: Float) -> Motion:
    """Return a probe that is held still for a second, then waved before the cameras."""
    more = np.clip(times - 1.0, 0.0, 1.0)[:, None] ** 2
    phase = 2.0 * np.pi * times[:, None] * np.array([0.9, 1.3, 1.1])
    turns = np.array([rotation_from_vector(0.1 * one) for one in more * np.sin(1.1 * phase)])
    there = np.ones(len(times), dtype=np.bool_)
    return Motion(turns.reshape(-1, 3, 3), middle + 50.0 * more * np.sin(phase), ~there, there)


def record(path: Path, *, wave: bool, untimed: bool, slots: int = 8) -> VirtualRig:
    """Record the script of a plan by cameras of which the second exposes 10 ms later.

    With the wave before it, or else from just before the first touch.
    """
    rig, plan = load_rig(RIG), load_plan(PLAN)
    touches = [(feature.name, feature.points) for feature in plan.features]
    given = (rig, load_probe(PROBE), load_part(PART), touches, 4)
    coarse = VirtualRig(*given, frame_rate_hz=_RATE_HZ)
    fine = VirtualRig(*given, frame_rate_hz=_FINE_HZ)
    script = fine.operator_motion(0, fine.n_frames + 100)
    middle = np.mean(rig.volume_world, axis=0)
    lead = round(_WAVE_S * _RATE_HZ) if wave else 0
    # The probe rests at the start of its script until it is identified there.
    rest = _RATE_HZ if wave else 0
    step = _FINE_HZ // _RATE_HZ

    def seen(late_ms: int) -> FrameBlock:
        waving = waved(np.arange(lead) / _RATE_HZ + late_ms * 1e-3, middle)
        places = step * np.maximum(np.arange(-rest, coarse.n_frames), 0) + late_ms
        scripted = [getattr(script, name)[places] for name in Motion.__slots__]
        both = zip((getattr(waving, name) for name in Motion.__slots__), scripted, strict=True)
        return coarse.frames_of(Motion(*(np.concatenate(pair) for pair in both)), 0)

    first, second = seen(0), seen(_LATE_MS)
    block = replace(
        first,
        time_ns=first.time_ns + 10**9,
        valid=np.stack([first.valid[:, 0], second.valid[:, 1]], axis=1),
        uv=np.pad(
            np.stack([first.uv[:, 0], second.uv[:, 1]], axis=1),
            ((0, 0), (0, 0), (0, slots - first.uv.shape[2]), (0, 0)), constant_values=np.nan,
        ),
    )  # fmt: skip
    serials = tuple(one.serial for one in rig.cameras)
    period_ns = round(1e9 / _RATE_HZ)
    description = SourceDescription(
        "simulated (late cameras)", serials, period_ns, period_ns, live=True, simulated=True,
        n_slots=slots, untimed=untimed,
    )  # fmt: skip
    recorder = FrameRecorder(path, description, rig)
    begin = 0 if wave else int(np.flatnonzero(block.flags)[0]) - 10
    recorder.append(FrameBlock(*(getattr(block, name)[begin:] for name in FrameBlock.__slots__)))
    recorder.close()
    return coarse


def request(path: Path, folder: Path) -> StationRequest:
    return StationRequest(plan=PLAN, out=folder, rig=RIG, probe=PROBE, source=f"replay:{path}")


def measured(path: Path, folder: Path) -> tuple[JobView, Path]:
    built = build_station(request(path, folder))
    view = run_job(built, folder, PlainConsole(file=io.StringIO(), width=400), formats=["json"])
    return view, built.job_path


@pytest.mark.slow
def test_a_part_is_measured_though_the_cameras_expose_apart(tmp_path: Path) -> None:
    """Every value is within 1.5 U of the truth; 1 U would fail in 5 % of honest values."""
    virtual = record(tmp_path / "late.rec", wave=True, untimed=True)
    view, path = measured(tmp_path / "late.rec", tmp_path)
    assert view.complete
    truth = true_values(load_plan(PLAN), virtual.part)
    compared = 0
    for one in view.characteristics:
        if one.name in truth and one.measured is not None and one.uncertainty is not None:
            assert abs(one.measured - truth[one.name]) < 1.5 * one.uncertainty, one.name
            compared += 1
    assert compared == 2
    (doubt,) = reopen_job(path).view.camera_doubts
    assert doubt.startswith("The cameras do not prove when they expose")


@pytest.mark.slow
def test_no_point_is_recorded_before_the_skew_is_known(tmp_path: Path) -> None:
    """The first touch of a probe that did not move before is refused with the sentence."""
    record(tmp_path / "late.rec", wave=False, untimed=True)
    station = build_station(request(tmp_path / "late.rec", tmp_path)).station
    told: list[Refusal] = []
    station.events.point_refused.connect(told.append)
    try:
        station.start()
        assert station.wait_finished(60.0)
    finally:
        station.close()
    assert told
    assert told[0].code.value == "not_ready"
    assert "not known yet" in told[0].what
    assert "wave it in all directions" in told[0].remedy


def test_recordings_keep_that_nothing_proves_the_times(tmp_path: Path) -> None:
    record(tmp_path / "late.rec", wave=False, untimed=True)
    record(tmp_path / "timed.rec", wave=False, untimed=False)
    for name, untimed in (("late", True), ("timed", False)):
        source = ReplaySource(tmp_path / f"{name}.rec")
        assert source.description.untimed is untimed
        source.close()


def test_calibrations_and_reference_bodies_refuse_such_cameras(tmp_path: Path) -> None:
    path = tmp_path / "late.rec"
    record(path, wave=False, untimed=True, slots=16)
    with pytest.raises(InputError, match="does not prove that its cameras expose") as caught:
        make_feed(request(path, tmp_path), load_plan(PLAN), load_rig(RIG))
    assert caught.value.code == "source.untimed"
    reference = replace(request(path, tmp_path), reference=resource("references", "plate.toml"))
    with pytest.raises(InputError, match="A reference body may move") as caught:
        build_station(reference)
    assert caught.value.code == "reference.untimed"

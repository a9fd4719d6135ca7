"""Temperatures in a job: the switches, the record, and a warm probe on a virtual rig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.probe_design import (
    MaterialExpansion,
    Temperature,
    TemperatureState,
    body_in_use,
    growth_shape,
    load_design,
)
from ocmm_core.documents import resource
from ocmm_core.errors import MeasuringError
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import SessionOptions
from ocmm_core.inspection.session import InspectionSession
from ocmm_core.measuring import (
    CLIMATE_EVENT,
    Climate,
    MeasuredPoint,
    PartTemperature,
    TouchCollector,
    climate_of_text,
)
from ocmm_core.storage import JobFile
from ocmm_core.tracking import ProbeBody, TrackingPipeline
from ocmm_sim.scene import VirtualRig, load_part
from tests.core.inspection.conftest import FRAME_RATE_HZ, Bench

STEEL = MaterialExpansion("steel", 11.5e-6, 1.0e-6)


def part_at(celsius: float) -> Climate:
    return Climate(part=PartTemperature(Temperature(celsius, 0.5, "test"), STEEL, compensated=True))


def session_of(bench: Bench, job: JobFile, climate: Climate) -> InspectionSession:
    return InspectionSession(
        bench.plan, bench.rig, bench.body, job, SessionOptions(climate=climate)
    )


def test_results_are_those_at_20_degrees_and_observations_stay(bench: Bench, job: JobFile) -> None:
    climate = part_at(30.0)
    plain = bench.session(job)
    for touch in bench.touches:
        assert isinstance(plain.touches.record_touch(touch), MeasuredPoint)
    stored = [point.tip_world for point in job.points()]
    with JobFile.create(bench.folder / "warm.ocmm", job.head) as other:
        warm = session_of(bench, other, climate)
        warm.conditions.note_climate()
        for touch in bench.touches:
            assert isinstance(warm.touches.record_touch(touch), MeasuredPoint)
        for before, after in zip(
            plain.view.characteristics, warm.view.characteristics, strict=True
        ):
            assert before.measured is not None
            assert after.measured is not None
            # 10 K x 11.5 ppm; a form error would not scale like this, and this plan has none.
            assert after.measured / before.measured == pytest.approx(1.0 - 115e-6, abs=1e-9)
            assert before.uncertainty is not None
            assert after.uncertainty is not None
            scale = 2.0 * before.measured * climate.part.scale_sigma
            assert after.uncertainty == pytest.approx(np.hypot(before.uncertainty, scale), rel=1e-3)
        assert "at 20 °C" in warm.view.temperature
        assert (
            climate_of_text(
                [event.text for event in other.events() if event.kind == CLIMATE_EVENT][-1]
            )
            == climate
        )
        for point, tip in zip(other.points(), stored, strict=True):
            np.testing.assert_array_equal(point.tip_world, tip)
        assert other.verify() == []


def test_a_job_is_computed_again_from_its_file(bench: Bench, job: JobFile) -> None:
    climate = part_at(26.0)
    first = session_of(bench, job, climate)
    first.conditions.note_climate()
    first.conditions.note_climate()
    for touch in bench.touches:
        first.touches.record_touch(touch)
    notes = [event.text for event in job.events() if event.kind == CLIMATE_EVENT]
    assert len(notes) == 1
    again = session_of(bench, job, climate_of_text(notes[0]))
    assert [item.measured for item in again.view.characteristics] == [
        item.measured for item in first.view.characteristics
    ]


@pytest.mark.parametrize("climate", [Climate(), part_at(27.0)])
def test_a_job_does_not_go_on_with_other_temperatures(
    climate: Climate, bench: Bench, job: JobFile
) -> None:
    first = session_of(bench, job, part_at(26.0))
    first.conditions.note_climate()
    first.touches.record_touch(bench.touches[0])
    with pytest.raises(MeasuringError, match="other temperature settings") as caught:
        session_of(bench, job, climate)
    assert "26.0" in caught.value.what


def tips_of(bench: Bench, true: ProbeBody, used: ProbeBody) -> Float:
    """Return the ball centres of a true probe, touch by touch, found with another geometry."""
    part = load_part(resource("parts", "demo.toml"))
    script = [(feature.name, feature.points) for feature in bench.plan.features]
    virtual = VirtualRig(bench.rig, true, part, script, seed=1, frame_rate_hz=FRAME_RATE_HZ)
    collector = TouchCollector(1.0 / FRAME_RATE_HZ, SessionOptions().point)
    tracked = TrackingPipeline(bench.rig, used).process(virtual.frames(0, virtual.n_frames))
    found: Float = np.array(
        [touch.window.tip_world.mean(axis=0) for touch in collector.push(tracked)]
    )
    return found


def test_a_warm_probe_that_is_compensated_finds_what_a_cold_one_finds(bench: Bench) -> None:
    body = bench.body
    design = load_design(resource("designs", "standard.toml"), body)
    temperature_state = TemperatureState(
        Temperature(27.0, 0.5, ""), Temperature(20.0, 0.5, ""), compensated=True
    )
    grown = 7.0 * growth_shape(design, body)[:-3].reshape(-1, 3)
    warm = replace(body, leds_probe=body.leds_probe + grown)
    cold = tips_of(bench, body, body)
    # The same noise and the same drawn errors: what differs is the geometry alone.
    off = np.linalg.norm(tips_of(bench, warm, body) - cold, axis=1)
    on = np.linalg.norm(
        tips_of(bench, warm, body_in_use(body, design, temperature_state)) - cold, axis=1
    )
    assert off.min() > 0.005
    assert on.max() < 0.001

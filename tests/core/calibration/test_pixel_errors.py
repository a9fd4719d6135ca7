"""Errors of spots fixed to pixels in the watch over a calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.monitor import CalibrationMonitor, ChangeCause, DriftReport
from ocmm_core.geometry import Float
from ocmm_core.tracking import TrackingPipeline, cut
from tests.core.calibration.monitored import RATE_HZ, Monitored

PIXEL_PX = 0.0045
"""Of rendered cameras: 1 % of response between pixels, and a black image of 64 frames."""

SECONDS, BENT_MM = 8.0, 0.030


def fixed_to_pixels(uv: Float) -> Float:
    """Return errors of spots at ``uv`` (..., 2), px: a Gaussian field, correlated over 1.2 px."""
    rng = np.random.default_rng(7)
    waves, phases = rng.normal(0.0, 1.0 / 1.2, (2, 60, 2)), rng.uniform(0.0, 2 * np.pi, (2, 60))
    parts = [
        np.cos(uv @ wave.T + phase).sum(axis=-1) for wave, phase in zip(waves, phases, strict=True)
    ]
    field: Float = PIXEL_PX * np.sqrt(2.0 / 60) * np.stack(parts, axis=-1)
    return field


def watched(seed: int, bent_mm: float) -> tuple[CalibrationMonitor, list[DriftReport]]:
    """Return a monitor and its reports on work with such cameras; the third LED may be bent."""
    bench = Monitored.of(seed=seed)
    leds = bench.body.leds_probe.copy()
    leds[2, 0] += bent_mm
    body = replace(bench.body, leds_probe=leds)
    frames = bench.virtual().frames(0, int(SECONDS * RATE_HZ))
    frames = replace(frames, uv=frames.uv + fixed_to_pixels(frames.uv))
    track = TrackingPipeline(bench.gate, body).process(frames)
    monitor = CalibrationMonitor(bench.rig, body)
    reports: list[DriftReport] = []
    for first in range(0, len(track), 40):
        reports += monitor.push(cut(track, first, min(first + 40, len(track))))
    return monitor, reports


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_errors_of_pixels_are_learnt_and_no_change(seed: int) -> None:
    monitor, reports = watched(seed, 0.0)
    assert len(reports) > 10
    assert not any(report.alarm for report in reports)
    # Places of a hand at rest are alike, so the estimate is of some ten independent ones.
    assert monitor._pixels.px == pytest.approx(PIXEL_PX, rel=0.35)  # noqa: SLF001 - its estimate
    scores = [report.scores for report in reports if report.scores]
    assert np.mean([one.chi2 / one.dof for one in scores]) < 1.2


def test_a_bent_led_is_found_among_errors_of_pixels() -> None:
    _, reports = watched(1, BENT_MM)
    alarms = [report for report in reports if report.alarm]
    assert alarms
    assert alarms[0].cause is ChangeCause.PROBE
    assert "LED 3" in alarms[0].what

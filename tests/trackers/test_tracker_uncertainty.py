"""U of balls measured by trackers: coverage, degrees of freedom, filters, noise of a job."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ocmm_core.camera import Rig, load_rig, projection_jacobians
from ocmm_core.errors import InputError
from ocmm_core.measuring import Refusal, StablePoint
from ocmm_core.tracking import TrackingPipeline
from ocmm_sim.trackers import MarkerErrors
from tests.host import amount, looser
from tests.trackers.tracker_bench import Bench, inside, written

_LONG, _EACH = 100, 10
_DEVICES = amount(24, _LONG)
_LEAST = 0.954 - looser(0.024, _DEVICES, _LONG)
_MOST = 0.954 + looser(0.021, _DEVICES, _LONG)
"""95 % less and more three standard deviations of N touches."""
_HEAD: dict[str, Any] = {
    "sigma_across": 0.05, "sigma_along": 0.15, "place_sigma": 0.02, "scale_sigma": 1e-4,
}  # fmt: skip
_ROOM: dict[str, Any] = {
    "growth": "none", "sigma_across": 0.03, "sigma_along": 0.03, "place_sigma": 0.01,
}  # fmt: skip


def noise_at(rig: Rig, place: np.ndarray) -> np.ndarray:
    """Return the covariance (3, 3) of a marker by the virtual cameras, mm^2."""
    rows = [projection_jacobians(camera, place[None])[0][0] for camera in rig.cameras]
    by_place = np.concatenate(rows)
    found: np.ndarray = np.linalg.inv(by_place.T @ by_place) * rig.noise.white_px**2
    return found


@pytest.mark.parametrize("along", [0.05, 0.1, 0.5])
@pytest.mark.parametrize("growth", ["distance", "none"])
def test_virtual_cameras_have_the_stated_noise(growth: str, along: float, tmp_path: Path) -> None:
    path = written(tmp_path, growth=growth, sigma_across=0.05, sigma_along=along, rounding=0.0)
    found = noise_at(load_rig(path), np.zeros(3))
    np.testing.assert_allclose(found, np.diag([0.05, along, 0.05]) ** 2, atol=1e-9, rtol=1e-6)


@pytest.mark.statistics
@pytest.mark.parametrize(
    "values",
    [
        {},
        {**_HEAD, "rounding": 0.01},
        {**_HEAD, "rounding": 0.1},
        {**_ROOM, "rounding": 0.01},
        {"sigma_across": 0.3, "sigma_along": 0.9, "place_sigma": 0.0, "rounding": 0.1},
    ],
    ids=["shipped", "head", "head, 0.1 mm", "room", "coarse"],
)
def test_the_true_ball_is_in_the_stated_ellipsoid(values: dict[str, Any], tmp_path: Path) -> None:
    """Ten touches of 25 frames by each of 24 (100) devices; hardly any is refused."""
    bench = Bench.of(written(tmp_path, **values))
    points = [(p, t) for p, t in bench.touches(_DEVICES, _EACH, 1) if isinstance(p, StablePoint)]
    assert len(points) > 0.97 * _DEVICES * _EACH
    share = np.mean([inside(bench, point, tip) for point, tip in points])
    assert _LEAST <= share <= _MOST


@pytest.mark.statistics
@pytest.mark.parametrize("stated", [True, False])
def test_a_filter_widens_u_or_refuses_the_point(stated: bool, tmp_path: Path) -> None:
    """N = 500 touches; without the statement U is by the correlation of the frames."""
    truth = Bench.of(written(tmp_path, **_HEAD, correlation=0.5)).document
    bench = Bench.of(written(tmp_path, **_HEAD, correlation=0.5 if stated else 0.0))
    points = [(p, t) for p, t in bench.touches(50, 10, 2, truth) if isinstance(p, StablePoint)]
    # Slow noise looks like motion: some touches are refused for that.
    assert len(points) > 250
    share = np.mean([inside(bench, point, tip) for point, tip in points])
    assert share >= 0.92


def test_strong_smoothing_is_refused(tmp_path: Path) -> None:
    bench = Bench.of(written(tmp_path, correlation=0.0))
    truth = Bench.of(written(tmp_path, correlation=0.9)).document
    found = [point for point, _ in bench.touches(5, 4, 3, truth)]
    # N = 20; few frames seldom look independent by chance.
    assert sum(isinstance(point, Refusal) for point in found) >= 16
    assert any("smooths its markers" in p.what for p in found if isinstance(p, Refusal))


def test_a_marker_has_three_degrees_of_freedom(tmp_path: Path) -> None:
    """N = 2,500 frames; the mean of chi-square per degree of freedom has a deviation of 0.008."""
    bench = Bench.of(written(tmp_path, place_sigma=0.0))
    rng, ratios = np.random.default_rng(4), []
    for device in range(100):
        block, _ = bench.window(MarkerErrors(bench.document, device), rng)
        track = TrackingPipeline(bench.rig, bench.body).process(block)
        assert (track.dof == 3 * bench.body.n_leds - 6).all()
        ratios.append(track.chi2 / track.dof)
    # The noise of the model differs from that of the device a little away from the middle.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.12)


def test_cameras_keep_their_degrees_of_freedom() -> None:
    from ocmm_core.documents import resource

    rig = load_rig(resource("rigs", "recommended.toml"))
    assert rig.markers is None
    assert rig.per_spot == 2
    assert replace(rig, noise_ratios=(1.0, 1.0)).per_spot == 2


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"rounding": 0.1}, "rounding"),
        ({"sigma_along": 0.001}, "sigma_along"),
        ({"correlation": 0.99}, "correlation"),
        ({"serial": 0}, "serial"),
        ({"frame_rate_hz": 10}, "frame_rate_hz"),
        ({"device_unit": "inch"}, "device_unit"),
        ({"handedness": "any"}, "handedness"),
        ({"growth": "other"}, "growth"),
        ({"unit": "m"}, "unit"),
        ({"distance": -5.0}, "distance"),
    ],
)
def test_implausible_documents_are_refused(
    values: dict[str, Any], said: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=said):
        load_rig(written(tmp_path, **values))


def test_unknown_fields_markers_and_heads_are_refused(tmp_path: Path) -> None:
    path = written(tmp_path)
    text = path.read_text("utf-8")
    for old, new, said in (
        ('missing = "absent"', 'missing = "absent"\nfilter = 3', "filter"),
        ('"M2"', '"M1"', "markers"),
        ("head = [0.0, -1000.0, 0.0]", "head = [0.0, 0.0, 0.0]", "head"),
        ("head = [0.0, -1000.0, 0.0]", "head = [0.0, -450.0, 0.0]", "close to the head"),
    ):
        path.write_text(text.replace(old, new), "utf-8")
        with pytest.raises(InputError, match=said):
            load_rig(path)

"""Continuous probing: averages along a path, contact, stations, against known paths."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameFlag
from ocmm_core.geometry import Float
from ocmm_core.measuring import (
    Path,
    PathCollector,
    PathPoints,
    PathSurface,
    Thinning,
    _path_points,
    points_along,
    thinned,
    transported,
)
from ocmm_core.measuring._path_points import _bend
from ocmm_core.tracking import FrameStatus, TrackBlock, cut, pick

Tracked = Callable[..., TrackBlock]
PERIOD_S = 125e-6
PRESSED = slice(800, 12_800)
"""1.5 s at 8 kHz."""


def paths_of(block: TrackBlock, cuts: list[int]) -> list[Path]:
    collector = PathCollector(PERIOD_S)
    edges = [0, *sorted(set(cuts)), len(block)]
    return [path for a, b in pairwise(edges) if b > a for path in collector.push(cut(block, a, b))]


def pressed(tracked: Tracked, tips: Float) -> TrackBlock:
    block = tracked(tips)
    block.flags[PRESSED] |= np.uint32(FrameFlag.BUTTON)
    return block


def around(radius: float, speed: float, noise: Float) -> Float:
    """Return the ball centres of a turn about z, mm, with noise (n, 3)."""
    angle = np.arange(len(noise)) * PERIOD_S * speed / radius
    circle = radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    return np.asarray(circle + noise)


def on_circle(block: TrackBlock, radius: float, spacing: float = 1.0) -> PathPoints:
    """Return the points along a path on the outside of a circle about z."""
    (path,) = paths_of(block, [])
    assert path.ticks is not None
    flat = path.ticks.tip_world * [1.0, 1.0, 0.0]
    lengths = np.linalg.norm(flat, axis=1)
    surface = PathSurface(flat / lengths[:, None], lengths - radius)
    return points_along(path.ticks, surface, Thinning(spacing))


def test_a_path_does_not_depend_on_how_the_stream_is_cut(
    tracked: Tracked, scatter: Callable[..., Float]
) -> None:
    rng = np.random.default_rng(5)
    block = pressed(tracked, around(20.0, 30.0, scatter(rng, 15_000)))
    block.status[rng.random(15_000) < 0.1] = FrameStatus.LOST
    (whole,) = paths_of(block, [])
    assert whole.first_frame == PRESSED.start
    assert whole.ticks is not None
    assert len(whole.ticks) == 600
    for _ in range(10):
        (again,) = paths_of(block, rng.integers(1, 15_000, 40).tolist())
        assert again.ticks is not None
        for one, other in (
            (again.ticks.tip_world, whole.ticks.tip_world),
            (again.ticks.n_frames, whole.ticks.n_frames),
            (again.trail_world, whole.trail_world),
        ):
            assert np.array_equal(one, other)


def test_a_pause_of_the_stream_ends_a_path(tracked: Tracked) -> None:
    block = pressed(tracked, np.zeros((15_000, 3)))
    kept = np.setdiff1d(np.arange(15_000), np.arange(5000, 5500))
    (path,) = paths_of(pick(block, kept), [])
    assert path.interrupted


def test_a_key_starts_and_ends_a_path(tracked: Tracked) -> None:
    block, collector = tracked(np.zeros((4000, 3))), PathCollector(PERIOD_S)
    assert not collector.push(cut(block, 0, 1000))
    collector.arm()
    assert not collector.push(cut(block, 1000, 3000))
    assert collector.collecting
    assert collector.progress is not None
    collector.arm()
    (path,) = collector.push(cut(block, 3000, 4000))
    assert path.first_frame == 1000
    assert path.ticks is not None
    assert int(path.ticks.last_frame[-1]) == 2999


def test_a_path_without_a_tip_has_no_ticks(tracked: Tracked) -> None:
    block = pressed(tracked, np.zeros((15_000, 3)))
    block.status[:] = FrameStatus.LOST
    (path,) = paths_of(block, [])
    assert path.ticks is None


@pytest.mark.parametrize(("radius", "speed"), [(7.0, 8.0), (7.0, 50.0), (30.0, 25.0)])
def test_points_are_evenly_spaced_and_on_the_circle(
    tracked: Tracked, scatter: Callable[..., Float], radius: float, speed: float
) -> None:
    """A ball of 2 mm on a radius of 5 mm or more; the bias is below 0.2 U of a point."""
    errors, sigmas, steps = [], [], []
    for seed in range(20):
        noise = scatter(np.random.default_rng([seed, 3]), 15_000)
        found = on_circle(pressed(tracked, around(radius, speed, noise)), radius)
        tips = np.array([one.tip_world for one in found.stations])
        steps += np.linalg.norm(np.diff(tips, axis=0), axis=1).tolist()
        errors += (np.linalg.norm(tips[:, :2], axis=1) - radius).tolist()
        sigmas += [
            float(np.sqrt(normal @ one.random_covariance @ normal))
            for one, normal in zip(found.stations, found.normals, strict=True)
        ]
        assert not found.fast_ms
        assert found.raised_mm == 0.0
    u = 2.0 * float(np.mean(sigmas))
    assert abs(float(np.mean(errors))) < 0.2 * u + 3.0 * float(np.std(errors)) / len(errors) ** 0.5
    # As stated: N points of known noise.
    assert float(np.mean(np.abs(errors) <= 2.0 * np.array(sigmas))) > 0.93
    assert 0.9 < float(np.median(steps)) < 1.2


def test_hops_are_left_out_and_honest_paths_are_not(
    tracked: Tracked, scatter: Callable[..., Float]
) -> None:
    """20 ms without contact, 0.05 to 0.3 mm high: found in 99 of 100; N = 200 hops."""
    missed = hops = 0
    lost = 0.0
    for seed in range(50):
        rng = np.random.default_rng([seed, 7])
        radius = rng.uniform(7.0, 40.0)
        tips = around(radius, rng.uniform(8.0, 40.0), scatter(rng, 15_000))
        honest = on_circle(pressed(tracked, tips), radius)
        lost += honest.lifted_ms
        outward = tips * [1.0, 1.0, 0.0] / radius
        high = np.zeros(15_000)
        starts = [2500, 4800, 7100, 9400]
        for start in starts:
            share = np.linspace(0.0, 1.0, 160)
            high[start : start + 160] = 4.0 * rng.uniform(0.05, 0.3) * share * (1.0 - share)
        found = on_circle(pressed(tracked, tips + high[:, None] * outward), radius)
        hops += len(starts)
        for one in found.stations:
            # A station inside a hop: more than half its frames are off the surface.
            inside = high[one.first_frame : one.last_frame + 1] > 0.02
            missed += bool(np.mean(inside) > 0.5)
    assert missed <= 0.01 * hops
    # Of 50 paths of 1.5 s.
    assert lost <= 0.001 * 50 * 1500


def test_a_long_rise_is_reported_and_not_removed_in_silence(
    tracked: Tracked, scatter: Callable[..., Float]
) -> None:
    """A lifted ball and a bump of the surface look alike; at the ends it is the approach."""
    tips = around(20.0, 25.0, scatter(np.random.default_rng(3), 15_000))
    outward = tips * [1.0, 1.0, 0.0] / 20.0
    for part, raised in ((slice(5000, 6600), True), (slice(0, 2400), False)):
        high = np.zeros(15_000)
        high[part] = 0.4
        found = on_circle(pressed(tracked, tips + high[:, None] * outward), 20.0)
        assert (found.raised_mm > 0.3) == raised
        assert found.lifted_ms > 190
        assert all(abs(np.hypot(*one.tip_world[:2]) - 20.0) < 0.05 for one in found.stations)


def test_a_fast_ball_gives_no_points(tracked: Tracked, scatter: Callable[..., Float]) -> None:
    tips = around(40.0, 150.0, scatter(np.random.default_rng(3), 15_000))
    found = on_circle(pressed(tracked, tips), 40.0)
    assert not found.stations
    assert found.fast_ms > 1200


def test_normals_follow_the_surface(tracked: Tracked) -> None:
    angle = np.linspace(0.0, 1.9 * np.pi, 4000)
    path = 15.0 * np.stack([np.cos(angle), np.sin(angle), 0.02 * angle], axis=1)
    normals = transported(path, np.array([1.0, 0.0, 0.0]), 0.5)
    true = path * [1.0, 1.0, 0.0] / 15.0
    # Transport about a helix turns by its pitch: 1.9 pi 0.02 rad, 6.8 degrees.
    assert float(np.degrees(np.arccos(np.sum(normals * true, axis=1)).max())) < 9.0
    zigzag = np.concatenate([path[:, :1] * [1.0, 0.0, 0.0] for _ in range(3)])
    flat = transported(zigzag, np.array([0.0, 0.0, 1.0]), 0.5)
    assert np.array_equal(flat, np.tile([0.0, 0.0, 1.0], (len(zigzag), 1)))


@pytest.mark.parametrize("radius", [5.0, 7.0, -18.0])
@pytest.mark.parametrize("begin", [-0.15, -0.05])
@pytest.mark.parametrize("sticks", [False, True])
def test_the_average_of_a_bent_piece_is_put_back_on_it(
    radius: float, begin: float, *, sticks: bool
) -> None:
    """The normal is that of a station, which need not be in the middle of its piece."""
    along = np.linspace(begin, begin + 0.3, 60)
    if sticks:
        along = np.insert(along, 20, np.full(30, along[20]))
    turn = along / abs(radius)
    side = np.sign(radius)
    piece = abs(radius) * np.stack([np.sin(turn), 0.0 * turn, side * np.cos(turn)], axis=1)
    share = np.full(len(piece), 1.0 / len(piece))
    missing = side * (abs(radius) - float(np.linalg.norm(share @ piece)))
    found = _bend(piece, np.array([0.0, 0.0, 1.0]), share)
    assert found == pytest.approx(missing, rel=0.05)
    assert abs(missing) > 1e-4


def sliding(*corners: tuple[float, float], speed: float = 20.0) -> tuple[Float, Float]:
    """Return ball centres every 2.5 ms along straight pieces, with a noise of 1 um, and times."""
    places = np.array(corners)
    lengths = np.append(0.0, np.linalg.norm(np.diff(places, axis=0), axis=1).cumsum())
    at = np.arange(0.0, lengths[-1], 0.0025 * speed)
    path = np.stack([np.interp(at, lengths, places[:, k]) for k in range(2)] + [0.0 * at], axis=1)
    path += 1e-3 * np.random.default_rng(4).normal(size=path.shape)
    return np.asarray(path), np.asarray(0.0025 * np.arange(len(at)))


def test_points_by_time_are_no_nearer_than_the_time_and_the_distance() -> None:
    slow, fast = sliding((0, 0), (20, 0), speed=4.0), sliding((0, 0), (20, 0), speed=40.0)
    rule = Thinning(1.0, interval_s=0.1)
    for (path, time_s), step in ((slow, 1.0), (fast, 4.0)):
        chosen, back = thinned(path, time_s, rule)
        steps = np.linalg.norm(np.diff(path[chosen], axis=0), axis=1)
        # Half a tick of path, and noise.
        assert steps == pytest.approx(np.full(len(steps), step), abs=0.11)
        assert np.diff(time_s[chosen]).min() >= 0.1 - 1e-12
        assert back == 0.0


def test_points_by_change_of_direction_are_dense_in_bends() -> None:
    turn = np.linspace(0.0, np.pi, 60)
    bend = [(60.0 + 6.0 * np.sin(a), 6.0 - 6.0 * np.cos(a)) for a in turn]
    path, time_s = sliding((0, 0), *bend, (0, 12))
    chosen, _ = thinned(path, time_s, Thinning(1.0, turn=np.radians(15.0)))
    bent = path[chosen, 0] > 60.5
    # Half a turn of radius 6 mm: 180 / 15 points; straight, one in 10 mm.
    assert 9 <= int(bent.sum()) <= 13
    assert 10 <= int((~bent).sum()) <= 16
    plain, _ = thinned(path, time_s, Thinning(1.0))
    assert len(plain) > 5 * len(chosen)


def test_gates_give_points_on_planes_once_and_in_one_direction() -> None:
    path, time_s = sliding((-0.6, 0), (20.3, 4), (12, 5), (31, 6))
    rule = Thinning(2.0, gates=np.array([1.0, 0.0, 0.0]), start=np.zeros(3))
    chosen, back = thinned(path, time_s, rule)
    assert path[chosen, 0] == pytest.approx(2.0 * np.arange(16), abs=0.06)
    # 8.3 mm back, and what lies there is passed twice.
    assert back == pytest.approx(8.3, abs=0.5)


def test_gates_passed_without_contact_give_no_point() -> None:
    path, time_s = sliding((-0.6, 0), (21, 0))
    seen = (path[:, 0] < 5.0) | (path[:, 0] > 9.0)
    rule = Thinning(2.0, gates=np.array([1.0, 0.0, 0.0]), start=np.zeros(3))
    chosen, _ = thinned(path[seen], time_s[seen], rule)
    expected = [0, 2, 4, 10, 12, 14, 16, 18, 20]
    assert path[seen][chosen, 0] == pytest.approx(expected, abs=0.06)


def test_a_long_path_keeps_its_gates_on_the_planes_of_the_plan(
    tracked: Tracked, scatter: Callable[..., Float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a path of more than 2,000 points; of fewer here, to be quick."""
    monkeypatch.setattr(_path_points, "MOST_POINTS", 10)
    tips = scatter(np.random.default_rng(2), 15_000)
    tips[:, 0] += 30.0 * PERIOD_S * np.arange(15_000)
    (path,) = paths_of(pressed(tracked, tips), [])
    assert path.ticks is not None
    count = len(path.ticks)
    flat = PathSurface(np.tile([0.0, 0.0, 1.0], (count, 1)), np.zeros(count))
    found = points_along(path.ticks, flat, Thinning(2.0, gates=np.array([1.0, 0.0, 0.0])))
    places = np.array([one.tip_world[0] for one in found.stations])
    # 45 mm in at most 10 points: each third of the planes.
    assert len(places) >= 7
    assert places == pytest.approx(6.0 * np.round(places / 6.0), abs=0.2)

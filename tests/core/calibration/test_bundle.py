"""The engine against its definition: residuals written in numpy, derivatives by differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ocmm_core.calibration.bundle import (
    BundleData,
    BundleState,
    Prior,
    adjust,
    common_covariance,
    residuals,
)
from ocmm_core.calibration.bundle._bundle import linearise
from ocmm_core.calibration.relocation import (
    GeometryMode,
    Observations,
    RelocationOptions,
    RelocationProblem,
    build,
)
from ocmm_core.camera import project
from ocmm_core.geometry import Float
from tests.core.calibration.waved_probe import as_known_before, disturbed, joined, probe, rig, world

NEST = np.array([[120.0, 40.0, -150.0]])


def small_problem(geometry: GeometryMode = "uncertain") -> RelocationProblem:
    """Return a problem with everything in it: waved, seated, a shown bar, a touched bar, hidden."""
    # A tip that is not the origin of the probe's frame.
    true = world(3, body=replace(probe(), tip_probe=np.array([5.0, 20.0, -30.0])))
    waved = true.waved(22)
    waved.uv[4, 0, 1] = waved.uv[7, 1, 3] = np.nan
    touched, seated, names = true.touched(2, 2, 0.001)
    nest = true.seated(NEST, 2, 0.001)
    shift = replace(nest, seats=nest.seats + len(names))
    observed = Observations(
        # The seated ones first: the engine wants them last.
        frames=joined(seated, waved, shift),
        shown_bars=(true.shown(3),),
        touched_bars=(touched,),
        seats=(*names, "nest"),
        seat_sigma=0.01,
    )
    start = disturbed(as_known_before(rig()), np.random.default_rng(1), lenses=False)
    options = RelocationOptions(lens="prior", geometry=geometry)
    given = build(start, true.body, observed, options)
    # The condition of the touched bar, loose enough for differences.
    return replace(given, data=replace(given.data, touched_sigma=0.05))


def defined_residuals(data: BundleData, prior: Prior, state: BundleState) -> Float:
    """Return all residuals over their sigmas, from the definition."""
    found: list[Float] = []
    leds = np.einsum("nij,lj->nli", state.rotations, state.leds) + state.origins[:, None]
    for index, camera in enumerate(state.cameras):
        used = data.weights[:, index] > 0.0
        off = project(camera, leds[used]) - data.uv[:, index][used]
        found.append((off * data.weights[:, index][used][:, None]).ravel())
    half = 0.5 * state.lengths[data.bars][:, None] * state.bar_rotations[:, :, 0]
    ends = np.stack([state.bar_origins - half, state.bar_origins + half], axis=1)
    for index, camera in enumerate(state.cameras):
        used = data.bar_weights[:, index] > 0.0
        off = project(camera, ends[used]) - data.bar_uv[:, index][used]
        found.append((off * data.bar_weights[:, index][used][:, None]).ravel())
    tips = state.rotations @ state.tip + state.origins
    seated = (data.seats >= 0) & data.active[0]
    found.append(((tips - state.seats[data.seats])[seated] / data.seat_sigma).ravel())
    for first, second, bar in data.touched:
        distance = np.linalg.norm(state.seats[second] - state.seats[first])
        found.append(np.array([(distance - state.lengths[bar]) / data.touched_sigma]))
    values, vectors = np.linalg.eigh(prior.information)
    known = np.sqrt(np.maximum(values, 0.0)) * vectors
    found.append(known.T @ (state.values() - prior.values))
    return np.concatenate(found)


def numeric_jacobian(given: RelocationProblem, state: BundleState) -> Float:
    """Return d(residuals)/d(common columns, then every pose, then every bar) by differences."""
    common, frames, bars = state.columns.count, len(state.origins), len(state.bar_origins)
    columns = []
    for index in range(common + 6 * (frames + bars)):
        sides = []
        for step in (1e-6, -1e-6):
            moves = np.zeros(common + 6 * (frames + bars))
            # Angles and distortions are small numbers, lengths are not.
            moves[index] = step
            pose = moves[common : common + 6 * frames].reshape(-1, 6)
            bar = moves[common + 6 * frames :].reshape(-1, 6)
            sides.append(
                defined_residuals(given.data, given.prior, state.moved(moves[:common], pose, bar))
            )
        columns.append((sides[0] - sides[1]) / 2e-6)
    return np.stack(columns, axis=1)


@pytest.mark.parametrize("geometry", ["known", "uncertain", "unknown"])
def test_eliminating_poses_leaves_what_the_dense_equations_leave(geometry: GeometryMode) -> None:
    given = small_problem(geometry)
    state = given.start
    free = given.prior.free
    here = linearise(given.data, given.prior, state, 0.0)
    whole = defined_residuals(given.data, given.prior, state)
    assert here.cost == pytest.approx(float(whole @ whole), rel=1e-9)

    jacobian = numeric_jacobian(given, state)
    common = state.columns.count
    own = jacobian[:, common:]
    # A bar may turn about itself: the pseudo-inverse leaves that out.
    inverse = np.linalg.pinv(own.T @ own, rcond=1e-9, hermitian=True)
    shared = jacobian[:, free]
    expected = shared.T @ shared - shared.T @ own @ inverse @ own.T @ shared
    slope = shared.T @ whole - shared.T @ own @ inverse @ (own.T @ whole)
    normal, gradient = here.reduced()
    # Differences of columns whose sizes span twelve orders of magnitude: compare scaled.
    scale = np.sqrt(np.diag(shared.T @ shared))
    np.testing.assert_allclose(
        normal[np.ix_(free, free)] / np.outer(scale, scale),
        expected / np.outer(scale, scale),
        atol=2e-6,
    )
    np.testing.assert_allclose(
        gradient[free] / scale, slope / scale, atol=1e-5 * np.abs(slope / scale).max()
    )


def test_a_motion_of_everything_changes_no_residual() -> None:
    given = small_problem()
    # Exact if the balls are in their seats, as they are at the minimum except for noise.
    state = adjust(given.data, given.prior, given.start).state
    normal, _ = linearise(given.data, given.prior, state, 0.0).reduced()
    free = given.prior.free
    scale = np.sqrt(normal.diagonal()[free])
    motions = state.world_motions()[free] * scale[:, None]
    motions /= np.linalg.norm(motions, axis=0)
    scaled = normal[np.ix_(free, free)] / np.outer(scale, scale)
    assert np.abs(scaled @ motions).max() < 1e-6


def test_adjusting_twice_changes_nothing() -> None:
    given = small_problem()
    found = adjust(given.data, given.prior, given.start)
    assert found.converged
    again = adjust(given.data, given.prior, found.state)
    assert again.iterations <= 1
    assert again.cost == pytest.approx(found.cost, rel=1e-8)


def test_what_is_not_free_stays_and_has_no_variance() -> None:
    given = small_problem("known")
    found = adjust(given.data, given.prior, given.start)
    np.testing.assert_array_equal(found.state.leds, given.start.leds)
    covariance = common_covariance(given.data, given.prior, found.state)
    assert covariance is not None
    leds = given.start.columns.of_leds
    assert not covariance[leds].any()
    assert np.all(covariance.diagonal()[given.prior.free] > 0.0)


def test_a_start_behind_a_camera_is_impossible_and_said_so() -> None:
    given = small_problem()
    away = given.start.origins.copy()
    away[0] = [0.0, -3000.0, 0.0]
    behind = replace(given.start, origins=away)
    found = adjust(given.data, given.prior, behind)
    assert np.isinf(found.cost)
    assert not found.converged
    assert np.isinf(residuals(given.data, behind)[0][0]).any()

"""Stillness of a ball: detected motion, undetected motion, and the U that includes it.

Noise as on the shipped rig at one metre, 5, 15 and 28 um a frame at 8 kHz along its own axes, which
are oblique in the world; to save time one frame represents five. Shares of some hundred windows;
`benchmarks.stillness` has the great numbers.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.steady_hand import steady_hand
from ocmm_core.geometry import Float, rotation_from_vector
from ocmm_core.tracking import Stillness, judge_stillness, wildness
from ocmm_core.tracking._stillness import MotionKind

pytestmark = pytest.mark.numerics

LIMIT_MM = 0.010
WINDOW_S = 0.25
N = 400
SIGMA_MM = np.array([0.005, 0.015, 0.028]) / np.sqrt(5.0)
AXES = rotation_from_vector(np.array([0.4, -0.7, 0.2]))
"""Columns: along which the noise is least, middling, greatest."""
COVARIANCE = AXES @ np.diag(SIGMA_MM**2) @ AXES.T


def watched(rng: np.random.Generator, path: Float, hand: bool = True) -> tuple[Float, Float]:
    """Return times (n,), s, and places (n, 3), mm, of a ball on a path, with noise."""
    times = np.arange(len(path)) * WINDOW_S / len(path)
    sway = steady_hand(times, rng)[0] if hand else 0.0
    noise = SIGMA_MM * rng.standard_normal((len(path), 3))
    return times, path + sway + noise @ AXES.T


def judged(times: Float, places: Float) -> Stillness:
    covariances = np.broadcast_to(COVARIANCE, (len(times), 3, 3))
    return judge_stillness(times, places, covariances, LIMIT_MM)


def even(n: int, shift: Float) -> Float:
    path: Float = np.linspace(0.0, 1.0, n)[:, None] * shift
    return path


def step(n: int, shift: Float, moment: float) -> Float:
    path: Float = (np.linspace(0.0, 1.0, n) > moment)[:, None] * shift
    return path


def direction(rng: np.random.Generator) -> Float:
    vector = rng.standard_normal(3)
    towards: Float = vector / np.linalg.norm(vector)
    return towards


@pytest.mark.parametrize("n", [N, 200, 50])
def test_a_steady_hand_is_not_refused(n: int) -> None:
    rng = np.random.default_rng(1)
    refused = sum(judged(*watched(rng, np.zeros((n, 3)))).motion is not None for _ in range(200))
    # 1 % is wanted and 0.3 % measured: 7 of 200 has a chance of 1 in 200 at 1 %.
    assert refused < 7


@pytest.mark.parametrize("way", ["drift", "slip"])
def test_twenty_micrometres_in_any_direction_are_refused(way: str) -> None:
    """The depth, too: its noise makes 2.2 um of a drift."""
    rng = np.random.default_rng(2)
    missed = 0
    for _ in range(100):
        shift = 0.020 * direction(rng)
        path = even(N, shift) if way == "drift" else step(N, shift, rng.uniform(0.05, 0.95))
        missed += judged(*watched(rng, path)).motion is None
    assert missed < 5  # 1 % is allowed, and a third of it measured: at its ends a slip is short.


def test_a_drift_across_the_depth_is_refused_from_ten_micrometres_on() -> None:
    rng = np.random.default_rng(3)
    missed = 0
    for _ in range(100):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        shift = LIMIT_MM * (AXES @ np.array([np.cos(angle), np.sin(angle), 0.0]))
        missed += judged(*watched(rng, even(N, shift))).motion is None
    assert missed < 5  # 1 % is allowed.


def test_the_words_and_the_size_are_those_of_the_motion() -> None:
    rng = np.random.default_rng(4)
    shift = 0.040 * AXES[:, 0]
    x = np.linspace(0.0, 1.0, N)
    swing = 0.030 * np.sin(2.0 * np.pi * 10.0 * WINDOW_S * x)[:, None] * AXES[:, 0]
    paths = {
        MotionKind.DRIFTED: even(N, shift),
        MotionKind.SLIPPED: step(N, shift, 0.3),
        MotionKind.SWAYED: (4.0 * x * (1.0 - x))[:, None] * shift,
        MotionKind.TREMBLED: swing,
    }
    for kind, path in paths.items():
        motion = judged(*watched(rng, path)).motion
        assert motion is not None
        # Steady hand and noise along this axis come to 3 um; a swing at 10 Hz has an amplitude.
        size = 0.030 if kind is MotionKind.TREMBLED else 0.040
        assert motion.kind is kind
        assert motion.size_mm == pytest.approx(size, abs=0.006)


def test_what_cannot_be_told_is_in_the_uncertainty() -> None:
    """A tenth of the frames often cannot reveal 15 um along the depth."""
    rng = np.random.default_rng(5)
    shift = 0.015 * AXES[:, 2]
    told, ratios = 0, []
    for _ in range(300):
        times, places = watched(rng, even(N // 10, shift))
        still = judged(times, places)
        if still.motion is not None:
            told += 1
            continue
        own = SIGMA_MM[2] ** 2 / len(times) + AXES[:, 2] @ still.covariance @ AXES[:, 2]
        # Relative to the ball's place at the beginning.
        ratios.append(AXES[:, 2] @ places.mean(axis=0) / np.sqrt(own))
    assert 10 < told < 290
    # 95 % but for the choice: accepted are those whose noise makes the drift look smaller.
    assert np.mean(np.abs(ratios) <= 2.0) > 0.88


def test_a_ball_at_rest_is_not_made_much_more_uncertain() -> None:
    """In units of the mean's variance half a drift has 3, and once more as much is seen of it."""
    rng = np.random.default_rng(6)
    shares = []
    for _ in range(200):
        times, places = watched(rng, np.zeros((N, 3)), hand=False)
        still = judged(times, places)
        shares.append(AXES[:, 2] @ still.covariance @ AXES[:, 2] * len(times) / SIGMA_MM[2] ** 2)
    assert 3.0 < np.mean(shares) < 12.0


def test_noise_beyond_the_document_is_believed() -> None:
    """Twice the documented noise of a rig is not a motion of the ball."""
    rng = np.random.default_rng(7)
    refused = 0
    for _ in range(200):
        times, places = watched(rng, np.zeros((N, 3)))
        places += np.sqrt(3.0) * SIGMA_MM * rng.standard_normal((N, 3)) @ AXES.T
        refused += judged(times, places).motion is not None
    assert refused < 6  # One of 100 is allowed.


def test_a_gap_in_the_middle_hides_nothing() -> None:
    rng = np.random.default_rng(8)
    keep = np.r_[0:140, 220:N]
    for _ in range(50):
        shift = 0.020 * direction(rng)
        times, places = watched(rng, step(N, shift, 0.45))
        assert judged(times[keep], places[keep]).motion is not None
    refused = 0
    for _ in range(200):
        times, places = watched(rng, np.zeros((N, 3)))
        refused += judged(times[keep], places[keep]).motion is not None
    assert refused < 6


def test_the_fewest_frames_are_judged() -> None:
    rng = np.random.default_rng(9)
    assert judged(*watched(rng, np.zeros((10, 3)))).motion is None
    assert judged(*watched(rng, even(10, 0.3 * AXES[:, 0]))).motion is not None


def test_a_wild_frame_is_wild_on_a_ball_that_moves_too() -> None:
    rng = np.random.default_rng(10)
    times, places = watched(rng, even(N, np.array([2.0, 0.0, 0.0])))
    places[177] += 0.3 * AXES[:, 0]
    apart = wildness(times, places, np.broadcast_to(COVARIANCE, (N, 3, 3)))
    assert np.flatnonzero(apart > 10.0).tolist() == [177]
    assert np.count_nonzero(apart > 5.0) < N // 50

"""Build the bundle of a relocation: data, prior and start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ocmm_core.calibration import bundle
from ocmm_core.calibration.relocation._data import Observations, RelocationOptions
from ocmm_core.calibration.relocation._frame import check_world
from ocmm_core.camera import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Int
from ocmm_core.tracking import ProbeBody

LEAST_FRAMES = 20
LEAST_FRAMES_OF_CAMERA = 10
UNKNOWN_SIGMA = 1.0
"""mm per axis; holds the tip of an unknown probe, unless rotation in seats determines it."""

EXACT_SIGMA = 1e-4
"""mm; of the distance of two seats of a bar: far below the spot noise, hence a condition."""


@dataclass(frozen=True, slots=True)
class RelocationProblem:
    """Input of the adjustment."""

    data: bundle.BundleData
    prior: bundle.Prior
    start: bundle.BundleState
    """`data`, `prior`, `start`: See `bundle`."""
    order: Int
    """(n,): index among the observed frames of each frame of the data."""

    @property
    def own_degrees(self) -> int:
        """Return the degrees of freedom contributed by priors, less the unknowns."""
        return self.prior.rows + self.prior.gauge - len(self.prior.free)


def build(
    start: Rig, body: ProbeBody, observed: Observations, options: RelocationOptions, *,
    alone: bool = True,
) -> RelocationProblem:  # fmt: skip
    """Return the bundle; without ``alone`` its frames need not determine the cameras.

    CalibrationError if the observations do not match the rig or probe or are too few, no length
    gives the scale, or the world frame refers to untouched seats.
    """
    _check(start, body, observed, options)
    frames = observed.frames
    order = np.argsort(frames.seats >= 0, kind="stable").astype(np.int64)
    uv = np.ascontiguousarray(frames.uv[order], dtype=np.float64)
    seats = np.ascontiguousarray(frames.seats[order], dtype=np.int64)
    leds = body.leds_probe
    if options.geometry == "unknown":
        leds = bundle.start_shape(start, body, uv)
    rotations, origins, found = bundle.start_poses(start, leds, uv)
    seen = np.isfinite(uv[..., 0] + uv[..., 1])
    found &= bundle.solvable(seen)
    cameras, count = len(start.cameras), len(observed.shown_bars)
    bar_uv = np.concatenate(
        [np.zeros((0, cameras, 2, 2)), *(shown.uv for shown in observed.shown_bars)]
    )
    bar_sigma = np.concatenate([np.zeros(0), *(shown.sigma_px for shown in observed.shown_bars)])
    bar_rotations, bar_origins, bar_found = bundle.start_bars(start, bar_uv)
    bar_seen = np.isfinite(bar_uv[..., 0] + bar_uv[..., 1]) & bar_found[:, None, None]
    state = bundle.BundleState(
        cameras=start.cameras, leds=leds, tip=body.tip_probe,
        seats=np.zeros((len(observed.seats), 3)),
        lengths=np.array([bar.length for bar in observed.bars], dtype=np.float64),
        rotations=rotations, origins=origins, bar_rotations=bar_rotations, bar_origins=bar_origins,
    )  # fmt: skip
    touched = [
        (observed.seats.index(first), observed.seats.index(second), count + bar)
        for bar, one in enumerate(observed.touched_bars)
        for first, second in one.seats
    ]
    data = bundle.BundleData(
        uv=uv, weights=seen * found[:, None, None] / frames.sigma_px[order, None, None],
        seats=seats, waved=int(np.count_nonzero(seats < 0)), seat_sigma=observed.seat_sigma,
        bar_uv=np.ascontiguousarray(bar_uv), bar_weights=bar_seen / bar_sigma[:, None, None],
        bars=np.repeat(np.arange(count), [len(shown.uv) for shown in observed.shown_bars]),
        touched=np.array(touched, dtype=np.int64).reshape(-1, 3), touched_sigma=EXACT_SIGMA,
    )  # fmt: skip
    data = _in_front(data, state)
    _check_enough(data, start, observed, alone=alone)
    state = _with_seats(data, state)
    prior = prior_of(start, body, observed, options, state)
    return RelocationProblem(data, prior, state, order)


def _in_front(data: bundle.BundleData, state: bundle.BundleState) -> bundle.BundleData:
    """Return the data without frames that start behind a camera: they are mislabelled."""
    of_frames, of_bars = bundle.residuals(data, state)
    behind, bars_behind = (
        np.count_nonzero(np.isinf(off), axis=(1, 2, 3)) for off in (of_frames, of_bars)
    )
    return data.scaled(_only(np.equal(behind, 0)), _only(np.equal(bars_behind, 0)))


def _only(kept: NDArray[np.bool_]) -> Float:
    return kept.astype(np.float64)[:, None, None]


def _with_seats(data: bundle.BundleData, state: bundle.BundleState) -> bundle.BundleState:
    tips = state.rotations @ state.tip + state.origins
    active = data.active[0]
    seats = [
        np.median(tips[active & (data.seats == seat)], axis=0) for seat in range(len(state.seats))
    ]
    return bundle.BundleState(
        state.cameras, state.leds, state.tip, np.array(seats).reshape(-1, 3), state.lengths,
        state.rotations, state.origins, state.bar_rotations, state.bar_origins,
    )  # fmt: skip


def prior_of(
    rig: Rig, body: ProbeBody, observed: Observations, options: RelocationOptions,
    state: bundle.BundleState,
) -> bundle.Prior:  # fmt: skip
    """Return prior knowledge and free unknowns for a state."""
    columns = state.columns
    values = state.values()
    values[columns.of_leds] = body.leds_probe.ravel()
    information = np.zeros((columns.count, columns.count))
    free = [columns.of_extrinsics(), _range(columns.of_seats), _range(columns.of_lengths)]
    rows = 0
    if options.lens == "free":
        free.append(columns.of_lenses())
    elif options.lens == "prior":
        known = _inform(information, columns.of_lenses(), lens_covariance(rig))
        free.append(known)
        rows += len(known)
    body_columns = columns.all_leds()
    if len(state.seats):
        # Without a seat the tip is undetermined, and nothing depends on it.
        body_columns = np.append(body_columns, _range(columns.of_tip))
    floats = options.geometry == "unknown"
    lengths = _range(columns.of_lengths)
    informed: Int = lengths
    shared, own = thermal_shapes(body, observed, columns)
    stated = np.zeros((columns.count, columns.count))
    by_heat = np.array([bar.per_k for bar in observed.bars]) * options.thermometer_k
    stated[lengths, lengths] = [
        max(bar.sigma**2 - k**2, EXACT_SIGMA**2)
        for bar, k in zip(observed.bars, by_heat, strict=True)
    ]
    if floats:
        free.append(body_columns)
        tip = _range(columns.of_tip)
        information[tip, tip] = UNKNOWN_SIGMA**-2
    elif options.geometry == "uncertain" or options.thermometer_k:
        size = len(body_columns)
        covariance = body.geometry_covariance[:size, :size]
        if options.geometry == "known":
            covariance = EXACT_SIGMA**2 * np.eye(size)
        stated[np.ix_(body_columns, body_columns)] = covariance
        informed = np.append(body_columns, lengths)
    for shape in (shared, own):
        stated += options.thermometer_k**2 * np.outer(shape, shape)
    inside = _inform(information, informed, stated[np.ix_(informed, informed)])
    free.append(inside[inside < columns.of_lengths.start])
    rows += len(inside)
    every = np.sort(np.concatenate(free))
    thermal = None
    if options.thermometer_k:
        thermal = np.zeros(columns.count)
        thermal[inside] = shared[inside]
    return bundle.Prior(values, information, every, rows, floats, thermal)


def thermal_shapes(
    body: ProbeBody, observed: Observations, columns: bundle.Columns
) -> tuple[Float, Float]:
    """Return growth of the unknowns (k,) by one kelvin of error of the thermometer.

    First what bars and probe share, at the probe's expected expansion; then the standard
    uncertainty of the latter.
    """
    shared, own = np.zeros(columns.count), np.zeros(columns.count)
    arms = (body.leds_probe - body.tip_probe).ravel()
    shared[columns.of_leds], own[columns.of_leds] = (part * arms for part in body.expansion)
    shared[columns.of_lengths] = [bar.per_k for bar in observed.bars]
    return shared, own


def lens_covariance(rig: Rig) -> Float:
    """Return the prior covariance of all lenses, (8 C, 8 C), independent of the poses."""
    lenses = bundle.Columns(len(rig.cameras), 0, 0, 0).of_lenses()
    return rig.parameter_covariance[np.ix_(lenses, lenses)]


def _inform(information: Float, columns: Int, covariance: Float) -> Int:
    """Write the inverse of a covariance; return the columns with nonzero uncertainty."""
    sigmas = np.sqrt(covariance.diagonal())
    uncertain = sigmas > 0.0
    mine, scale = columns[uncertain], sigmas[uncertain]
    correlation = covariance[np.ix_(uncertain, uncertain)] / np.outer(scale, scale)
    information[np.ix_(mine, mine)] = np.linalg.inv(correlation) / np.outer(scale, scale)
    return mine


def _range(columns: slice) -> Int:
    return np.arange(columns.start, columns.stop)


def _check(start: Rig, body: ProbeBody, observed: Observations, options: RelocationOptions) -> None:
    views = observed.frames.uv.shape[1:3]
    expected = len(start.cameras), body.n_leds
    if views != expected:
        raise CalibrationError(
            "relocation.shape",
            f"The frames show {views[0]} cameras and {views[1]} LEDs, but the rig and the probe "
            f"have {expected[0]} and {expected[1]}.",
            "Select the rig and probe the frames were taken with.",
        )
    for shown in observed.shown_bars:
        if shown.uv.shape[1:3] != (expected[0], 2):
            raise CalibrationError(
                "relocation.shape",
                f"The spots of bar '{shown.bar.name}' show {shown.uv.shape[1]} cameras and "
                f"{shown.uv.shape[2]} ends, but the rig has {expected[0]} cameras.",
                "Select the rig the bar was shown to.",
            )
    if observed.frames.seats.max(initial=-1) >= len(observed.seats):
        raise CalibrationError(
            "relocation.unknown_seat",
            f"A frame belongs to seat {observed.frames.seats.max()}, but {len(observed.seats)} "
            f"seats are named.",
            "Name every seat in which the ball rested.",
        )
    if options.geometry == "unknown" and not observed.bars:
        raise CalibrationError(
            "relocation.no_scale",
            "No bar was shown and the probe geometry is unknown: nothing defines the scale.",
            "Show a length bar, or use a calibrated probe.",
        )
    check_world(options.world, observed.seats)
    for touched in observed.touched_bars:
        for name in (name for pair in touched.seats for name in pair):
            if name not in observed.seats:
                raise CalibrationError(
                    "relocation.unknown_seat",
                    f"The bar '{touched.bar.name}' ends in the seat '{name}', which was not "
                    f"touched.",
                    "Touch both ends of the bar in every placement.",
                )


def _check_enough(
    data: bundle.BundleData, rig: Rig, observed: Observations, *, alone: bool
) -> None:
    active = data.active[0]
    count = int(active.sum())
    if alone and count < LEAST_FRAMES:
        raise CalibrationError(
            "relocation.too_few_frames",
            f"Only {count} of {len(active)} frames show three LEDs to two cameras; at least "
            f"{LEAST_FRAMES} are needed.",
            "Wave the probe longer, with its LEDs towards the cameras.",
        )
    for index, camera in enumerate(rig.cameras if alone else ()):
        frames = int(np.count_nonzero(np.count_nonzero(data.weights[:, index], axis=1)))
        if frames < LEAST_FRAMES_OF_CAMERA:
            raise CalibrationError(
                "relocation.camera_sees_little",
                f"Camera '{camera.name}' contributes to only {frames} "
                f"frame{'' if frames == 1 else 's'}.",
                "Wave the probe where this camera and another one see it.",
            )
    for index, name in enumerate(observed.seats):
        if not (active & (data.seats == index)).any():
            raise CalibrationError(
                "relocation.seat_not_seen",
                f"No frame showed the probe well enough while the ball rested in '{name}'.",
                "Touch it again with the LEDs towards the cameras.",
            )

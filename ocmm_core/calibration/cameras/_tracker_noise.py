"""Noise of a tracker: of one frame from a minute at rest, of places from one body at many of them.

In the whitened coordinates of a marker, across the line of sight by the growth g with distance and
along it by r g more (r: ratio of the stated noises), the place error is a field of one standard
deviation s with correlation exp(-d^2 / (2 l^2)), where l is its stated length. The poses of the
body, its scale and small errors of its LEDs are estimated together with s, which maximises the
restricted likelihood (Patterson and Thompson, Biometrika 58 (1971) 545).
"""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import numpy as np
import scipy

from ocmm_core.calibration.guided import STILL_FRAMES
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import TrackerDocument, independent_share, place_shape, sights_of
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, rigid_fit, skew
from ocmm_core.tracking import ProbeBody

_STEPS_MM = (1.0, 0.5, 0.1, 0.05, 0.01, 0.005, 0.001)
_ON_STEP = 0.1
"""Distance from a multiple of the step, in steps, that 32-bit numbers of a device leave."""
_PART_S = 1.0
"""Noise is that within parts of this length; slower changes are drift."""
_LEAST_PARTS = 20
_SHAKEN = 4.0
"""Variance of the mean of all markers over that of independent ones; more is vibration."""
_LEAST_MARKERS = 4


class RestNoise(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Noise of one frame of resting markers; mm, standard deviations at the stated distance."""

    frames: int
    across: float
    along: float
    """`across`, `along`: without the part of rounding."""
    correlation: float
    """Of consecutive frames."""
    rounding: float
    """Step of the coordinates; 0: none found."""
    drift: float
    """Of the means of parts of one second, beyond what the noise explains."""
    shaken: float
    """Variance of the mean of all markers, over that of independent markers."""


def rest_noise(places: Float, document: TrackerDocument) -> RestNoise:
    """Return the noise of resting markers (n, L, 3), mm, NaN if hidden in a frame.

    CalibrationError with fewer than four markers in all frames, or too few frames.
    """
    places = places[:, np.isfinite(places).all(axis=(0, 2))]
    count, n_markers = places.shape[:2]
    part = round(_PART_S * document.frame_rate_hz)
    parts = count // part
    if n_markers < _LEAST_MARKERS or parts < _LEAST_PARTS:
        raise CalibrationError(
            "tracker.rest",
            f"{n_markers} markers were seen in all of {count} frames at rest; "
            f"{_LEAST_MARKERS} markers in {_LEAST_PARTS * part} frames are needed.",
            "Fix the probe so that the tracker sees it well, and do not step between them.",
        )
    step = _rounding(places / document.noise.scale)
    middle = places.mean(axis=0)
    plain = np.linalg.inv(place_shape(middle, document)) @ (places - middle)[..., None]
    blocks = plain[: parts * part, ..., 0].reshape(parts, part, n_markers, 3)
    means = blocks.mean(axis=1)
    inner = blocks - means[:, None]
    free = parts * (part - 1)
    sight = sights_of(middle, document)
    # Whitened by the stated ratio, so that `along` is the measured over the stated ratio.
    along = np.einsum("pkmi,mi->pkm", inner, sight)
    across2 = float((np.sum(inner**2) - np.sum(along**2)) / (2.0 * free * n_markers))
    along2 = float(np.sum(along**2) / (free * n_markers))
    lag = float(np.sum(inner[:, 1:] * inner[:, :-1]) / np.sum(inner**2))
    # Bias of short parts, as of touches (Marriott and Pope, Biometrika 41 (1954) 390).
    lag = float(np.clip(lag + (1.0 + 4.0 * lag) / part, 0.0, 0.99))
    of_mean = (2.0 * across2 + along2) / (3.0 * part * independent_share(lag))
    drift2 = float(means.var(axis=0, ddof=1).mean()) - of_mean
    together = inner.mean(axis=2)
    shaken = np.sum(together**2) * n_markers**2 / np.sum(inner**2)
    noise = document.noise
    less = step**2 / 12.0
    ratio = noise.sigma_along / noise.sigma_across
    return RestNoise(
        frames=count, across=float(np.sqrt(max(across2 - less, 0.0))),
        along=float(np.sqrt(max(along2 * ratio**2 - less, 0.0))), correlation=lag, rounding=step,
        drift=float(np.sqrt(max(drift2, 0.0))), shaken=float(shaken),
    )  # fmt: skip


def place_sigma(
    means: Float, sigma_mean: float, body: ProbeBody, document: TrackerDocument
) -> float:
    """Return the standard deviation of the place error, mm, across, at its upper 84 % limit.

    ``means`` (n, L, 3), mm, NaN if hidden: of each pose; ``sigma_mean``: of their noise, across.
    """
    leds, size = body.leds_probe, body.leds_probe.size
    # White coordinates of the LEDs, by their own covariance.
    spread = np.linalg.cholesky(body.geometry_covariance[:size, :size] + 1e-12 * np.eye(size))
    rows, values, at = [], [], []
    for pose, places in enumerate(means):
        seen = np.flatnonzero(np.isfinite(places[:, 0]))
        rotation, origin = rigid_fit(leds[seen], places[seen])
        white = np.linalg.inv(place_shape(places[seen], document))
        for led, weight, place in zip(seen, white, places[seen], strict=True):
            arm = rotation @ leds[led]
            row = np.zeros((3, 1 + 6 * len(means) + size))
            row[:, 0] = weight @ arm
            row[:, 6 * pose + 1 : 6 * pose + 7] = weight @ np.hstack([np.eye(3), -skew(arm)])
            row[:, 6 * len(means) + 1 :] = weight @ rotation @ spread[3 * led : 3 * led + 3]
            rows.append(row)
            values.append(weight @ (place - arm - origin))
            at.append(place)
    design, residual, where = np.concatenate(rows), np.concatenate(values), np.array(at)
    # The LEDs have a prior: unit rows with value zero.
    prior = np.eye(design.shape[1])[6 * len(means) + 1 :]
    square = np.sum((where[:, None] - where) ** 2, axis=2) / document.noise.place_length**2
    field = np.kron(np.exp(-0.5 * square), np.eye(3))
    free = scipy.linalg.null_space(np.vstack([design, prior]).T)
    on_data, on_prior = free[: len(residual)], free[len(residual) :]
    by_field = on_data.T @ field @ on_data
    by_noise = sigma_mean**2 * on_data.T @ on_data + on_prior.T @ on_prior
    root = np.linalg.cholesky(by_noise)
    inner = np.linalg.solve(root, np.linalg.solve(root, by_field).T)
    strengths, axes = np.linalg.eigh(0.5 * (inner + inner.T))
    squares = (axes.T @ np.linalg.solve(root, on_data.T @ residual)) ** 2

    def loss(log_sigma: float) -> float:
        total = 1.0 + np.exp(2.0 * log_sigma) * np.maximum(strengths, 0.0)
        return float(0.5 * np.sum(np.log(total) + squares / total))

    grid = np.linspace(np.log(1e-4), np.log(10.0), 500)
    losses = np.array([loss(one) for one in grid])
    return float(np.exp(grid[losses <= losses.min() + 0.5].max()))


def measured_document(
    document: TrackerDocument, rest: RestNoise, means: Float, body: ProbeBody
) -> TrackerDocument:
    """Return the document with the measured noise in place of the stated one.

    ``means`` (n, L, 3), mm: markers at each place, from `STILL_FRAMES`; NaN if hidden.
    """
    noise = msgspec.structs.replace(
        document.noise, sigma_across=rest.across, sigma_along=max(rest.along, rest.across),
        correlation=rest.correlation, rounding=rest.rounding,
    )  # fmt: skip
    independent = STILL_FRAMES * independent_share(rest.correlation)
    place = place_sigma(means, noise.reported[0] / np.sqrt(independent), body, document)
    noise = msgspec.structs.replace(noise, place_sigma=float(np.hypot(place, rest.drift)))
    return msgspec.structs.replace(document, noise=noise)


def rest_findings(rest: RestNoise) -> list[Finding]:
    """Return objections to a minute at rest."""
    found = []
    if rest.shaken > _SHAKEN:
        found.append(
            Finding(
                "tracker.shaken",
                f"All markers move together, with {rest.shaken:.0f} times the variance of "
                "independent ones: the tracker or the probe vibrates.",
                "Fix both to something heavy, then repeat the minute at rest.",
                refuses=True,
            )
        )
    if rest.correlation > 0.9:
        found.append(
            Finding(
                "tracker.filtered",
                f"Consecutive frames have a correlation of {rest.correlation:.2f}: the tracker "
                "smooths its markers.",
                "Switch off averaging, smoothing and prediction, then repeat.",
                refuses=True,
            )
        )
    return found


def _rounding(places: Float) -> float:
    for step in _STEPS_MM:
        off = np.abs(places / step - np.round(places / step))
        if off.max() < _ON_STEP:
            return step
    return 0.0


def changes(stated: TrackerDocument, measured: TrackerDocument) -> Iterator[Finding]:
    """Yield every stated value that the measurement contradicts by more than a fifth."""
    for field in ("sigma_across", "sigma_along", "place_sigma", "correlation", "rounding"):
        before, after = getattr(stated.noise, field), getattr(measured.noise, field)
        if abs(after - before) > max(0.2 * before, 0.02 if field == "correlation" else 1e-4):
            yield Finding(
                "tracker.noise_changed",
                f"noise.{field} is {after:.4g}; {before:.4g} was stated.",
                "The measured value is used.",
                refuses=False,
            )

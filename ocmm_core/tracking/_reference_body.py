"""Reference body: LEDs fixed on the part or its table, its document, and the filter of its pose.

The pose is averaged at rest and followed immediately in motion.
The mean over half a second has hardly any noise, but lags behind motion. Three tests monitor it in
every frame, on the latest frame and on exponential means over about 16 and 256 frames, each by
chi-square over the six parameters of the pose (5 sigma: once in three million frames by chance). If
one fails, the mean restarts with the value of that test: a move of ten sigma is followed in the
same frame. Undetected motion is less than a third of the noise of one frame; it only affects trail
and live position, because measured points use the poses of their own frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ocmm_core.camera import MAX_LEDS
from ocmm_core.cpu_features import njit
from ocmm_core.documents import Document, load_with_text, text_digest
from ocmm_core.errors import InputError
from ocmm_core.geometry import Float, unit
from ocmm_core.tracking._ambiguity import check_distinct
from ocmm_core.tracking._body import (
    LedBody,
    LedEntry,
    OrientationRule,
    ProbeBody,
    check_labels,
    check_leds,
    check_stated,
    rule_directions,
    unit_rules,
)
from ocmm_core.tracking._identify import chi2_limit
from ocmm_core.tracking._result import FrameStatus, TrackBlock
from ocmm_core.tracking._strobe import StrobeEntry, strobe_code
from ocmm_core.tracking.kernels import cholesky, forward, turn

SCHEMA = "ocmm.reference/1"


class ReferenceDocument(Document, frozen=True, kw_only=True):
    """Document of a reference body; lengths in mm, reference frame."""

    name: str
    led_sigma: float
    emission_half_angle_deg: float
    leds: list[LedEntry]
    orientation_rules: tuple[OrientationRule, ...] = ()
    strobe: StrobeEntry | None = None


@dataclass(frozen=True, slots=True)
class ReferenceBody:
    """A reference body with unambiguous labels."""

    leds: LedBody
    """Its body frame is the reference frame."""
    geometry_covariance: Float
    """(3 R, 3 R), mm^2: LED coordinates."""
    text: str
    """The document, for the job file."""
    identity: str

    @property
    def name(self) -> str:
        return self.leds.name

    @property
    def label(self) -> str:
        """Return name and shortened hash, for reports; pure ASCII, no commas."""
        kept = (sign if sign.isascii() and sign.isprintable() else "?" for sign in self.name)
        return f"{''.join(kept).replace(',', ' ')} {self.identity[:12]}"

    @property
    def n_leds(self) -> int:
        return self.leds.n_leds

    @property
    def middle(self) -> Float:
        """Return the middle of its LEDs (3,), mm, reference frame."""
        middle: Float = self.leds.leds_body.mean(axis=0)
        return middle


def load_reference(path: Path | str) -> ReferenceBody:
    """Return the reference body of the document at ``path``.

    InputError if malformed, or LEDs are too few, too many, in one place, in line or confusable.
    """
    path = Path(path)
    document, text = load_with_text(path, ReferenceDocument, SCHEMA)
    check_leds(path, "reference", document.leds, rule_directions(document.orientation_rules))
    check_stated(path, "reference", document)
    positions = np.array([led.position for led in document.leds])
    leds = LedBody(
        name=document.name,
        leds_body=positions,
        led_directions_body=unit(np.array([led.direction for led in document.leds])),
        emission_half_angle=float(np.radians(document.emission_half_angle_deg)),
        rules=unit_rules(document.orientation_rules),
        code=strobe_code(path, document.strobe, len(document.leds)),
    )
    check_labels(path, "reference", leds)
    return ReferenceBody(
        leds=leds,
        geometry_covariance=document.led_sigma**2 * np.eye(positions.size),
        text=text,
        identity=text_digest(text),
    )


def check_together(probe: ProbeBody, reference: ReferenceBody) -> None:
    """Refuse a probe and a reference body that are confusable in the same images.

    InputError if they have more LEDs than a camera follows, or three LEDs of both look alike.
    """
    count = probe.n_leds + reference.n_leds
    if count > MAX_LEDS:
        raise InputError(
            "reference.slots",
            f"The probe '{probe.name}' has {probe.n_leds} LEDs and the reference body "
            f"'{reference.name}' has {reference.n_leds}: OCMM follows {MAX_LEDS}, not "
            f"{count}.",
            f"Choose a probe or a reference body with fewer LEDs, together at most {MAX_LEDS}.",
        )
    check_distinct((probe.led_body, reference.leds))


LONGEST = 4096
"""Memory of the mean in frames: half a second at 8 kHz."""

# Share of the latest frame in each mean. An exponential mean of share a has the noise of a plain
# one over (2 - a) / a frames: 1, 31 and 511.
_SHARES = np.array([1.0, 1.0 / 16.0, 1.0 / 256.0])
# The mean (6), an exponential mean (6) for each test, and two counts.
_SIZE = 6 + 6 * len(_SHARES) + 2
_FRAMES, _SINCE = _SIZE - 2, _SIZE - 1
"""Indices of frames in the mean and frames since its start."""


class ReferenceFilter:
    """Average poses of a resting reference body, independent of blocks; for one thread."""

    def __init__(self) -> None:
        self._limit = float(chi2_limit(np.array([6]))[0])
        self._rotation, self._origin = np.eye(3), np.zeros(3)
        self._state = np.zeros(_SIZE)
        self.n_frames = 0
        """Frames in the mean after the latest one; 0 if the body is not tracked."""

    def push(self, body: TrackBlock, covariance: Float) -> tuple[Float, Float, Float]:
        """Return rotation, origin, mm, and covariance (n, 6, 6) of every frame.

        NaN if the body is not tracked; the mean restarts after that. The covariance of the
        single-frame poses is for the increments of `pose.reprojection`.
        """
        n = len(body)
        rotations, origins, frames = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty(n)
        _follow(
            body.status == FrameStatus.OK, body.rotation_world_from_probe, body.origin_world,
            covariance, self._limit, _SHARES, self._rotation, self._origin, self._state,
            rotations, origins, frames,
        )  # fmt: skip
        self.n_frames = int(self._state[_FRAMES])
        return rotations, origins, covariance / frames[:, None, None]


@njit(cache=True, nogil=True, error_model="numpy")
def _follow(
    good: NDArray[np.bool_], rotations_in: Float, origins_in: Float, covariance: Float,
    limit: float, shares: Float, anchor: Float, place: Float, state: Float,
    rotations: Float, origins: Float, frames: Float,
) -> None:  # fmt: skip
    """Apply the filter; ``anchor``, ``place`` and ``state`` are kept between calls.

    The mean is held as increments (6) to the pose ``anchor`` (3, 3), ``place`` (3).
    """
    n_tests = len(shares)
    factor = np.empty((6, 6))
    step = np.empty(6)
    scaled = np.empty(6)
    work, other = np.empty((3, 3)), np.empty((3, 3))
    for i in range(len(good)):
        if not good[i]:
            # Not tracked: discard history, as the body may be moved while hidden.
            state[:] = 0.0
            rotations[i] = np.nan
            origins[i] = np.nan
            frames[i] = 1.0
            continue
        if state[_FRAMES] == 0.0:
            _restart(anchor, place, state, rotations_in[i], origins_in[i])
        else:
            # (rotation vector, translation), rad and mm, rig axes, as those of the covariance.
            _increments(anchor, place, rotations_in[i], origins_in[i], step)
            for k in range(6):
                # Now the latest frame less the mean: zero in expectation at rest.
                step[k] -= state[k]
            for a in range(6):
                for b in range(6):
                    factor[a, b] = covariance[i, a, b]
            # With C = L L', |L^-1 x|^2 is the squared Mahalanobis length of x, chi-square with six
            # degrees of freedom for the noise of one frame.
            sound = cholesky(factor)
            since = state[_SINCE] + 1.0
            failed = -1
            for test in range(n_tests):
                share = shares[test]
                first = 6 + 6 * test
                for k in range(6):
                    # With a share of 1 this is the latest frame itself.
                    state[first + k] += share * (step[k] - state[first + k])
                    scaled[k] = state[first + k]
                forward(factor, scaled)
                squares = 0.0
                for k in range(6):
                    squares += scaled[k] * scaled[k]
                # Variance of an exponential mean started at zero n frames ago, relative to one
                # frame: a^2 times the geometric sum of (1 - a)^(2 i), i < n.
                spread = share / (2.0 - share) * (1.0 - (1.0 - share) ** (2.0 * since))
                # 1 / frames is the variance of the subtracted mean. The first test to fail wins:
                # the shorter its memory, the more recent its value. Written so that NaN fails.
                if failed < 0 and not squares <= limit * (spread + 1.0 / state[_FRAMES]):
                    failed = test
            # The latest frame alone is off: restart with it. Also without a usable covariance.
            if not sound or failed == 0:
                _restart(anchor, place, state, rotations_in[i], origins_in[i])
            elif failed > 0:
                first = 6 + 6 * failed
                for k in range(6):
                    # A slow shift: the mean jumps by the value of the failed test, with the weight
                    # of that exponential mean, but at most the present one.
                    state[k] += state[first + k]
                state[_FRAMES] = min((2.0 - shares[failed]) / shares[failed], since)
                state[_SINCE] = 0.0
                for k in range(6, 6 + 6 * n_tests):
                    state[k] = 0.0
            else:
                state[_SINCE] = since
                # A plain mean up to LONGEST frames, then an exponential one with a share of 1 /
                # LONGEST.
                state[_FRAMES] = min(state[_FRAMES] + 1.0, LONGEST)
                for k in range(6):
                    state[k] += step[k] / state[_FRAMES]
        for a in range(3):
            origins[i, a] = place[a] + state[3 + a]
            for b in range(3):
                rotations[i, a, b] = anchor[a, b]
        # exp(w) anchor, the inverse of `_increments`.
        turn(rotations[i], state[0], state[1], state[2], work, other)
        frames[i] = state[_FRAMES]


@njit(cache=True, nogil=True, error_model="numpy")
def _restart(anchor: Float, place: Float, state: Float, rotation: Float, origin: Float) -> None:
    """Restart the mean with one pose."""
    anchor[:] = rotation
    place[:] = origin
    state[:] = 0.0
    state[_FRAMES] = 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _increments(anchor: Float, place: Float, rotation: Float, origin: Float, out: Float) -> None:
    """Write the increments from the anchor to a nearby pose: rotation vector, translation."""
    # From the left, so that the rotation vector is along the axes of the rig. Half the skew part is
    # sin(angle) times the axis, less than the vector by a sixth of the cube of the angle: 2e-10 rad
    # for a milliradian.
    change = rotation @ anchor.T
    out[0] = 0.5 * (change[2, 1] - change[1, 2])
    out[1] = 0.5 * (change[0, 2] - change[2, 0])
    out[2] = 0.5 * (change[1, 0] - change[0, 1])
    for a in range(3):
        out[3 + a] = origin[a] - place[a]

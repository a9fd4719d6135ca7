"""Detect what changed before or during a session: which element, when, and suddenly or evenly.

Every resting position leaves residuals: spots minus those predicted by the pose. A camera that
turned leaves a pattern of them from one moment on, and a seat visited first and again at the end
appears displaced. Each suspect is linear in a few amounts, so one weighted least squares fit gives
its likelihood ratio (M. Basseville, I. V. Nikiforov, Detection of Abrupt Changes, 1993, section
2.4): a camera or an LED that jumped at some moment, drifted linearly in time, or was off from the
first observation, and a size of the probe that drifted or was wrong. They compete with a charge per
free amount (G. Schwarz, Ann. Statist. 6, 1978). Effects shared by the whole session (uncertainty of
calibration and probe) are in the covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import Enum, auto

import numpy as np
import scipy

from ocmm_core.calibration.guided._articulation import SEAT_SIGMA_MM, RestingTouch, touch_of
from ocmm_core.calibration.guided._repeats import shown_moment
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import N_PARAMETERS, Rig, projection_jacobians
from ocmm_core.geometry import Float, skew
from ocmm_core.tracking import ProbeBody, reprojection

STEP_CHANCE = 1e-3
"""False alarm probability of a session."""

_DECISIVE = 12.0
"""Twice the logarithm of a likelihood ratio of 400: less likely alternatives are excluded."""

_MOST = 2
"""Changes of one session that are found."""

_FREE = 30.0
"""Standard deviation of a granted change, in its amounts: practically free."""

_LEAST_INFORMATION = 1e-8
"""Fraction of the information of a change below which it is unobservable."""


@dataclass(frozen=True, slots=True)
class Rest:
    """The probe at rest somewhere."""

    touch: RestingTouch
    """The ball's centre with its sensitivities."""
    residuals: Float
    """(m - 6,): residuals of the pose, in directions orthogonal to all poses, in sigmas."""
    by_cameras: Float
    by_geometry: Float
    """`by_cameras`, `by_geometry`: (m - 6, 14 C) and (m - 6, 3 L + 3): their derivatives."""
    utc: str
    """ISO 8601 text."""


class TimeCourse(Enum):
    """Course of a change in time."""

    JUMP = auto()
    DRIFT = auto()
    BEFORE = auto()
    """Constant over the session: it happened before the session, the start is unknown."""


@dataclass(frozen=True, slots=True)
class SessionChange:
    """Change that explains a session."""

    course: TimeCourse
    element: str
    """``pose``, ``turn`` or ``lens`` of a camera, ``LED``, or ``size`` of the probe."""
    index: int
    """Of the camera or LED; -1 for the probe."""
    columns: slice
    profile: Float
    """(n,): fraction effective at each rest."""
    last: int
    first: int
    """`last`, `first`: Rests between which it happened, as far as the residuals determine it."""
    amount: Float
    gain: float
    limit: float
    """`gain`, `limit`: Decrease of chi-square with it; critical value over suspects and moments."""
    worth: float
    """Gain less the charge for free amounts; the moment of a jump is one."""


def rest_of(uv: Float, sigma_px: float, utc: str, rig: Rig, body: ProbeBody) -> Rest:
    """Return the rest of averaged spots (C, L, 2), px; TrackingError without a pose."""
    touch = touch_of(uv, sigma_px, rig, body)
    rotation = touch.rotation_world_from_probe
    origin = touch.tip_world - rotation @ body.tip_probe
    residuals, rows = reprojection(rig, body.leds_probe, uv, rotation, origin)
    across = np.asarray(scipy.linalg.qr(rows)[0][:, rows.shape[1] :].T / sigma_px, dtype=np.float64)
    by_cameras = np.zeros((len(residuals), N_PARAMETERS * len(rig.cameras)))
    by_geometry = np.zeros((len(residuals), 3 * body.n_leds + 3))
    row = 0
    for c, camera in enumerate(rig.cameras):
        seen = np.flatnonzero(np.isfinite(uv[c]).all(axis=1))
        leds = body.leds_probe[seen] @ rotation.T + origin
        d_point, d_parameters = projection_jacobians(camera, leds)
        part = slice(row, row + 2 * len(seen))
        by_cameras[part, c * N_PARAMETERS : (c + 1) * N_PARAMETERS] = d_parameters.reshape(
            -1, N_PARAMETERS
        )
        for led, slope in zip(seen, d_point @ rotation, strict=True):
            by_geometry[row : row + 2, 3 * led : 3 * led + 3] = slope
            row += 2
    return Rest(touch, across @ residuals, across @ by_cameras, across @ by_geometry, utc)


def session_changes(
    rests: Sequence[Rest],
    repeats: Sequence[tuple[int, int]],
    rig: Rig,
    body: ProbeBody,
    *,
    failed: bool = False,
) -> list[tuple[SessionChange, ...]]:
    """Return the changes that explain a session, each with its equally likely alternatives.

    ``rests`` in order of time, two or more; ``repeats``: indices of rests in the same seat.
    ``chance`` of exceeding the limit if undisturbed is divided between suspects and moments.
    ``failed`` lengths: a change before the session counts by itself; otherwise it only competes.
    """
    found: list[tuple[SessionChange, ...]] = []
    if len(rests) < 2:
        return found
    normal, drifting = _Normal.from_rests(rests, repeats, rig, body), set[tuple[str, int]]()
    for _ in range(_MOST):
        suspects = normal.suspects(rests, len(rig.cameras), body.n_leds)
        # A drift is hardly ever exactly even: the rest of it is no jump.
        real = [
            one
            for one in suspects
            if one.gain > one.limit
            and not (one.course is not TimeCourse.BEFORE and (one.element, one.index) in drifting)
        ]
        if not real or not (failed or any(one.course is not TimeCourse.BEFORE for one in real)):
            break
        best = max(real, key=lambda one: one.worth)
        near = [one for one in real if one.worth > best.worth - _DECISIVE]
        found.append(_one_of_each(near))
        drifting |= {(one.element, one.index) for one in near if one.course is TimeCourse.DRIFT}
        normal = normal.granting(best)
    return found


@dataclass(frozen=True, slots=True)
class _Normal:
    """Residuals of rests and repeats, and derivatives by changes and shared effects."""

    parts: tuple[tuple[tuple[tuple[int, Float], ...], Float, Float], ...]
    """Per rest or repeat: (rest, rows) of the changes, values, and rows of shared effects."""

    @classmethod
    def from_rests(
        cls, rests: Sequence[Rest], repeats: Sequence[tuple[int, int]], rig: Rig, body: ProbeBody
    ) -> _Normal:
        of_cameras, of_geometry = _root(rig.parameter_covariance), _root(body.geometry_covariance)
        changes, size = _changes(rig), (body.leds_probe - body.leds_probe.mean(axis=0)).ravel()

        def rows(by_cameras: Float, by_geometry: Float) -> Float:
            leds = by_geometry[:, : len(size)]
            return np.hstack([by_cameras @ changes, leds, leds @ size[:, None]])

        def shared(by_cameras: Float, by_geometry: Float) -> Float:
            # Scaled to one standard deviation each.
            return np.hstack([by_cameras @ of_cameras, by_geometry @ of_geometry])

        parts: list[tuple[tuple[tuple[int, Float], ...], Float, Float]] = [
            (((i, rows(one.by_cameras, one.by_geometry)),), one.residuals,
             shared(one.by_cameras, one.by_geometry))
            for i, one in enumerate(rests)
        ]  # fmt: skip
        for i, k in repeats:
            one, other = rests[i].touch, rests[k].touch
            covariance = one.noise + other.noise + 2.0 * SEAT_SIGMA_MM**2 * np.eye(3)
            white = np.linalg.inv(np.linalg.cholesky(covariance))
            was = -white @ one.by_cameras, -white @ one.by_geometry
            now = white @ other.by_cameras, white @ other.by_geometry
            both = shared(was[0] + now[0], was[1] + now[1])
            shift = white @ (other.tip_world - one.tip_world)
            parts.append((((i, rows(*was)), (k, rows(*now))), shift, both))
        return cls(tuple(parts))

    def felt(self, columns: slice, profile: Float) -> list[Float]:
        """Return the effect of a change on each part."""
        found = []
        for rows, _, _ in self.parts:
            found.append(sum((profile[i] * one[:, columns] for i, one in rows), np.zeros(())))
        return found

    def granting(self, change: SessionChange) -> _Normal:
        """Return the same with a change of free size as a shared effect."""
        scale = _FREE * np.abs(change.amount).max()
        effects = self.felt(change.columns, change.profile)
        return _Normal(
            tuple(
                (rows, values, np.hstack([shared, scale * effect]))
                for (rows, values, shared), effect in zip(self.parts, effects, strict=True)
            )
        )

    def suspects(self, rests: Sequence[Rest], cameras: int, leds: int) -> list[SessionChange]:
        """Return every suspect at every moment."""
        count, values = len(rests), np.concatenate([one[1] for one in self.parts])
        shared = np.concatenate([one[2] for one in self.parts])
        factor = scipy.linalg.cho_factor(np.eye(shared.shape[1]) + shared.T @ shared)
        still = shared @ scipy.linalg.cho_solve(factor, shared.T @ values)
        at = np.array([datetime.fromisoformat(one.utc).timestamp() for one in rests])
        span = float(at[-1] - at[0])
        even = (at - at[0]) / span if span > 0.0 else np.linspace(0.0, 1.0, count)
        always = np.ones(count)
        jumps = np.triu(np.ones((count, count)))[1:]
        trials: list[tuple[TimeCourse, str, int, slice, Float, int]] = []
        for c in range(cameras):
            turn, pose, lens = (slice(9 * c + a, 9 * c + b) for a, b in ((0, 3), (0, 6), (6, 9)))
            trials += [(TimeCourse.JUMP, "turn", c, turn, one, i) for i, one in enumerate(jumps)]
            trials.append((TimeCourse.DRIFT, "turn", c, turn, even, 0))
            trials += [(TimeCourse.BEFORE, "turn", c, turn, always, 0),
                       (TimeCourse.BEFORE, "pose", c, pose, always, 0),
                       (TimeCourse.BEFORE, "lens", c, lens, always, 0)]  # fmt: skip
        first = 9 * cameras
        for led in range(leds):
            place = slice(first + 3 * led, first + 3 * led + 3)
            trials += [(TimeCourse.JUMP, "LED", led, place, one, i) for i, one in enumerate(jumps)]
            trials += [(TimeCourse.DRIFT, "LED", led, place, even, 0),
                       (TimeCourse.BEFORE, "LED", led, place, always, 0)]  # fmt: skip
        place = slice(first + 3 * leds, first + 3 * leds + 1)
        trials += [(TimeCourse.DRIFT, "size", -1, place, even, 0),
                   (TimeCourse.BEFORE, "size", -1, place, always, 0)]  # fmt: skip
        found = []
        for course, element, index, columns, profile, last in trials:
            rows = np.concatenate(self.felt(columns, profile))
            cross = rows.T @ shared
            information = rows.T @ rows - cross @ scipy.linalg.cho_solve(factor, cross.T)
            score = rows.T @ (values - still)
            # A camera without spots since then leaves its angles undetermined.
            scale = np.sqrt(np.maximum(np.diag(rows.T @ rows), 1e-300))
            amount = np.linalg.lstsq(
                information / np.outer(scale, scale), score / scale, rcond=_LEAST_INFORMATION
            )[0] / scale  # fmt: skip
            gain, free = float(score @ amount), len(amount)
            jump = course is TimeCourse.JUMP
            found.append(
                SessionChange(
                    course, element, index, columns, profile, last, last + 1 if jump else count - 1,
                    amount, gain, float(scipy.special.chdtri(free, STEP_CHANCE / len(trials))),
                    gain - (free + jump) * float(np.log(len(values))),
                )
            )  # fmt: skip
        return found


def _one_of_each(near: Sequence[SessionChange]) -> tuple[SessionChange, ...]:
    """Return the best of each suspect, likeliest first, a jump with its likely moments."""
    alike: dict[tuple[TimeCourse, str, int], list[SessionChange]] = {}
    for one in sorted(near, key=lambda one: -one.worth):
        alike.setdefault((one.course, one.element, one.index), []).append(one)
    return tuple(
        replace(some[0], last=min(o.last for o in some), first=max(o.first for o in some))
        for some in alike.values()
    )


def change_findings(
    changes: Sequence[Sequence[SessionChange]], rests: Sequence[Rest], rig: Rig, remedy: str
) -> list[Finding]:
    """Return the findings on changes; ``remedy`` is for changes during the session."""
    found = []
    for alike in changes:
        found += [_finding(one, rests, rig, remedy) for one in alike]
        if len(alike) > 1:
            found.append(
                Finding(
                    "session.ambiguous",
                    f"One of these {len(alike)} changes happened; the residuals do not show which.",
                    "Check all of them.",
                    refuses=True,
                )
            )
    return found


def _finding(change: SessionChange, rests: Sequence[Rest], rig: Rig, remedy: str) -> Finding:
    amount, number = change.amount, change.index + 1
    begin, end = (shown_moment(rests[i].utc) for i in (change.last, change.first))
    if change.element in ("LED", "size"):
        before = change.course is TimeCourse.BEFORE
        return Finding(
            "session.probe_before" if before else "session.probe_moved",
            _probe_change(change, number, begin, end),
            "Check LEDs and temperature of the probe, calibrate it again, and verify again.",
            refuses=True,
        )
    name = rig.cameras[change.index].name
    size = 1e6 * _norm(amount[:3])
    if change.course is TimeCourse.BEFORE:
        what = (
            f"Camera '{name}' was off its calibrated pose during the whole session, by about "
            f"{size:.0f} urad: it moved before the first observation at {begin} UTC."
        )
        if change.element == "lens":
            what = (
                f"The lens of camera '{name}' was off its calibration during the whole session "
                f"(focal length {1e3 * amount[0]:+.0f} um, middle of the image {amount[1]:+.2f} "
                f"and {amount[2]:+.2f} px): it changed before the first observation at "
                f"{begin} UTC."
            )
        return Finding(
            "session.before", what,
            "Fasten the lens and the mount of this camera, calibrate the cameras again, and verify "
            "again.",
            refuses=True,
        )  # fmt: skip
    if change.course is TimeCourse.DRIFT:
        return Finding(
            "session.drift",
            f"Camera '{name}' drifted evenly by about {size:.0f} urad from {begin} to {end} UTC; "
            "it may have started earlier.",
            "Let cameras and frame reach their temperature, keep draughts and sun away, check the "
            "mount of the camera, and verify again.",
            refuses=True,
        )
    what = f"Camera '{name}' moved by about {size:.0f} urad between {begin} and {end} UTC."
    return Finding("session.camera_moved", what, remedy, refuses=True)


def _probe_change(change: SessionChange, number: int, begin: str, end: str) -> str:
    course, size = change.course, 1e3 * _norm(change.amount)
    if change.element == "size":
        if course is TimeCourse.BEFORE:
            return (
                f"The probe was {1e6 * change.amount[0]:+.0f} um/m larger than recorded during the "
                "whole session."
            )
        return (
            f"The probe grew evenly by {1e6 * change.amount[0]:+.0f} um/m from {begin} to {end} "
            "UTC; it may have started earlier."
        )
    if course is TimeCourse.BEFORE:
        return (
            f"LED {number} of the probe was {size:.0f} um from its recorded position during the "
            "whole session: it moved before the first observation."
        )
    if course is TimeCourse.DRIFT:
        return (
            f"LED {number} of the probe drifted evenly by about {size:.0f} um from {begin} to "
            f"{end} UTC; it may have started earlier."
        )
    return f"LED {number} of the probe moved by about {size:.0f} um between {begin} and {end} UTC."


def _norm(vector: Float) -> float:
    return float(np.linalg.norm(vector))


def _changes(rig: Rig) -> Float:
    """Return d(parameters), (14 C, 9 C), by turn, shift, focal length (mm), principal point."""
    cameras = len(rig.cameras)
    changes = np.zeros((cameras, N_PARAMETERS, cameras, 9))
    for c, camera in enumerate(rig.cameras):
        changes[c, :3, c, :3] = changes[c, 3:6, c, 3:6] = np.eye(3)
        # The centre stays: the translation turns with the camera.
        changes[c, 3:6, c, :3] = -skew(camera.T_camera_from_world.translation)
        changes[c, 6, c, 6] = changes[c, 8, c, 7] = changes[c, 9, c, 8] = 1.0
    return changes.reshape(cameras * N_PARAMETERS, cameras * 9)


def _root(covariance: Float) -> Float:
    """Return a square root, as columns, of a possibly singular covariance."""
    values, vectors = np.linalg.eigh(covariance)
    root: Float = vectors * np.sqrt(np.maximum(values, 0.0))
    return root

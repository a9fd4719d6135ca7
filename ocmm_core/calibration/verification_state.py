"""What was taken in a verification, and what follows from it: placements, gates and the verdict."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from ocmm_core.calibration.artefacts import LengthBar, Sphere
from ocmm_core.calibration.conclusion import hash_of
from ocmm_core.calibration.procedure import OPEN, Gate
from ocmm_core.calibration.records import VERIFICATION_SCHEMA, Check, VerificationRecord
from ocmm_core.calibration.session_events import Begun, SessionEvent, Spots, from_spots
from ocmm_core.calibration.verification import (
    SPHERE_POINTS,
    Limits,
    PlannedLine,
    fit_sphere,
    judge_placement,
    length_checks,
    sphere_check,
)
from ocmm_core.camera.rig import Rig
from ocmm_core.errors import CalibrationError
from ocmm_core.geometry import Float, Points3
from ocmm_core.tracking.body import ProbeBody
from ocmm_core.tracking.sensitivity import tip_sensitivity

_MOST_GAIN = 1.0
"""Standard deviation of a diameter over that of a point; beyond, points lie too near the pole."""


class VerificationBegun(Begun, frozen=True, kw_only=True):
    """First line.

    Attributes
    ----------
    probe_identity
        Hash of the probe's document.
    bar, spheres
        Artefacts that are used.
    limits
        Permissible errors.
    """

    probe_identity: str
    bar: LengthBar
    spheres: tuple[Sphere, ...]
    limits: Limits


class NestTaken(SessionEvent, frozen=True, kw_only=True):
    """The probe in one nest of one line.

    Attributes
    ----------
    line, nest
        Indices.
    uv
        (C, L), px.
    sigma_px
        Standard deviation of a spot.
    """

    line: int
    nest: int
    uv: Spots
    sigma_px: float


class SphereTouched(SessionEvent, frozen=True, kw_only=True):
    """The probe at one point of one sphere; see `NestTaken`."""

    sphere: int
    uv: Spots
    sigma_px: float


class LineRepeated(SessionEvent, frozen=True, kw_only=True):
    """A line is taken anew: its placement was wrong, or it failed (allowed once)."""

    line: int
    failed: bool


VerificationEvent: TypeAlias = VerificationBegun | NestTaken | SphereTouched | LineRepeated


@dataclass(slots=True)
class VerificationState:
    """Everything that was taken, with the ball centres that follow from it.

    Attributes
    ----------
    rig, body, begun, plans
        What it is about.
    nests, tips
        What was taken of the lines, in order, and the ball centres (3,), mm, world.
    touched, touched_tips
        The same of the spheres.
    repeated
        Lines that had failed and were taken anew.
    """

    rig: Rig
    body: ProbeBody
    begun: VerificationBegun
    plans: tuple[PlannedLine, ...]
    nests: list[NestTaken] = field(default_factory=list)
    tips: list[Float] = field(default_factory=list)
    touched: list[SphereTouched] = field(default_factory=list)
    touched_tips: list[Float] = field(default_factory=list)
    repeated: list[int] = field(default_factory=list)

    def add(self, event: NestTaken | SphereTouched) -> None:
        """Take in an observation; raise TrackingError where its spots determine no pose."""
        tip = tip_sensitivity(from_spots(event.uv), self.rig, self.body).tip_world
        if isinstance(event, NestTaken):
            self.nests.append(event)
            self.tips.append(tip)
        else:
            self.touched.append(event)
            self.touched_tips.append(tip)

    def remove_nest(self) -> None:
        """Take out what was taken last of the lines."""
        del self.nests[-1], self.tips[-1]

    def remove_touch(self) -> None:
        """Take out what was taken last of the spheres."""
        del self.touched[-1], self.touched_tips[-1]

    def repeat(self, event: LineRepeated) -> None:
        """Take out all of a line."""
        kept = [i for i, one in enumerate(self.nests) if one.line != event.line]
        self.nests = [self.nests[i] for i in kept]
        self.tips = [self.tips[i] for i in kept]
        if event.failed:
            self.repeated.append(event.line)

    def line_tips(self, line: int) -> Points3:
        """Return the ball centres (n, 3), mm, that were taken on a line, nest by nest."""
        own = [(one.nest, i) for i, one in enumerate(self.nests) if one.line == line]
        return np.array([self.tips[i] for _, i in sorted(own)]).reshape(-1, 3)

    def sphere_tips(self, sphere: int) -> Points3:
        """Return the ball centres (n, 3), mm, that were taken on a sphere."""
        own = [i for i, one in enumerate(self.touched) if one.sphere == sphere]
        return np.array([self.touched_tips[i] for i in own]).reshape(-1, 3)

    def is_complete(self, line: int) -> bool:
        """Return whether all nests of a line were taken."""
        return len(self.line_tips(line)) == len(self.begun.bar.nests)

    def is_begun(self, line: int) -> bool:
        """Return whether some but not all nests of a line were taken."""
        return len(self.line_tips(line)) > 0 and not self.is_complete(line)

    def current_line(self) -> int | None:
        """Return the first line that is not complete; None after the last one."""
        return next((i for i in range(len(self.plans)) if not self.is_complete(i)), None)

    def current_sphere(self) -> int | None:
        """Return the first sphere that lacks points; None after the last one."""
        return next(
            (
                number
                for number in range(len(self.begun.spheres))
                if len(self.sphere_tips(number)) < SPHERE_POINTS
            ),
            None,
        )

    def hint(self, line: int) -> str:
        """Return what speaks against the placement of a line; empty where nothing does."""
        if not self.is_complete(line):
            return ""
        others = [self.line_tips(one)[[0, -1]] for one in range(line) if self.is_complete(one)]
        ends = self.line_tips(line)[[0, -1]]
        return judge_placement(self.plans[line], ends, others, self.rig.volume_world)

    def lengths(self, line: int) -> tuple[Check, ...]:
        """Return the test lengths of a complete line."""
        return length_checks(
            self.plans[line].name,
            self.line_tips(line),
            self.begun.bar,
            self.begun.limits,
            self.begun.temperature_c,
        )

    def has_failed(self, line: int) -> bool:
        """Return whether a test length of a line does not conform."""
        return self.is_complete(line) and not all(
            self.begun.limits.passes(check) for check in self.lengths(line)
        )

    def lines_gate(self) -> Gate:
        """Return whether all lines were taken where they should be."""
        missing = sum(not self.is_complete(line) for line in range(len(self.plans)))
        if missing:
            return Gate(False, f"{missing} of {len(self.plans)} lines are missing.", "Take them.")
        for line, plan in enumerate(self.plans):
            hint = self.hint(line)
            if hint:
                return Gate(False, f"Line '{plan.name}': {hint}", "Take this line again.")
        return OPEN

    def spheres_gate(self) -> Gate:
        """Return whether all spheres were touched all around."""
        missing = len(self.begun.spheres) * SPHERE_POINTS - len(self.touched)
        if missing > 0:
            return Gate(False, f"{missing} points on spheres are missing.", "Touch them.")
        for number, one in enumerate(self.begun.spheres):
            if fit_sphere(self.sphere_tips(number))[2] > _MOST_GAIN:
                return Gate(
                    False,
                    f"The points on '{one.artefact.use.name}' lie too near its pole.",
                    "Take some of them back and touch it nearer to its equator.",
                )
        return OPEN

    def verdict(self) -> VerificationRecord:
        """Return the record of what was taken.

        Raises
        ------
        CalibrationError
            Something is missing or placed wrongly.
        """
        for gate in (self.lines_gate(), self.spheres_gate()):
            if not gate.open:
                raise CalibrationError("verification.incomplete", gate.reason, gate.remedy)
        begun = self.begun
        checks = [check for line in range(len(self.plans)) for check in self.lengths(line)]
        for number, sphere in enumerate(begun.spheres):
            name = f"{sphere.artefact.use.name}, place {number + 1}"
            tips, ball = (
                self.sphere_tips(number),
                (self.body.tip_radius, self.body.tip_radius_sigma),
            )
            checks.append(sphere_check(name, tips, ball, sphere, begun.limits, begun.temperature_c))
        rule = begun.limits.describe()
        if self.repeated:
            names = ", ".join(self.plans[line].name for line in self.repeated)
            rule += f"; repeated once: {names}"
        uses = [begun.bar.artefact.use, *(sphere.artefact.use for sphere in begun.spheres)]
        taken: list[NestTaken | SphereTouched] = [*self.nests, *self.touched]
        return VerificationRecord(
            schema=VERIFICATION_SCHEMA,
            calibration=begun.running,
            made_utc=max(one.utc for one in taken),
            made_by=begun.who,
            software=begun.software,
            temperature_c=begun.temperature_c,
            rule=rule,
            checks=tuple(checks),
            artefacts=tuple(dict.fromkeys(uses)),
            data_sha256=hash_of(np.array([from_spots(one.uv) for one in taken])),
            passed=all(begun.limits.passes(check) for check in checks),
        )

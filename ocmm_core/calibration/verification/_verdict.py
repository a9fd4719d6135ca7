"""The verdict of a verification: its checks, and whether anything moved meanwhile."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ocmm_core.calibration.guided import (
    SEATS,
    JudgedRepeat,
    Repeat,
    RestingPosition,
    camera_step,
    from_spots,
    hash_of,
    judge_repeats,
    repeat_finding,
    step_finding,
)
from ocmm_core.calibration.records import (
    VERIFICATION_SCHEMA,
    ArtefactUse,
    Corner,
    Finding,
    LengthBar,
    Objection,
    RepeatedSeat,
    Sphere,
    VerificationRecord,
)
from ocmm_core.calibration.verification._culprits import TIP, culprits
from ocmm_core.calibration.verification._line_planning import CORNER_SHARE
from ocmm_core.calibration.verification._state import SphereTouched, Taken, VerificationState
from ocmm_core.calibration.verification._verification import sphere_checks
from ocmm_core.errors import CalibrationError
from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS, doubts_by_name

_ANYWHERE_MM = 100.0
_REMEDY = "Find what moved (camera, frame, table or seat), fix it, and verify again."


def verdict(state: VerificationState, reused: Sequence[Finding]) -> VerificationRecord:
    """Return the record of what was taken.

    Parameters
    ----------
    reused
        What speaks against the artefacts.

    Raises
    ------
    CalibrationError
        Something is missing or placed wrongly.
    """
    gates = (state.seats_gate(), state.lines_gate(), state.spheres_gate(), state.again_gate())
    for gate in gates:
        if not gate.open:
            raise CalibrationError("verification.incomplete", gate.reason, gate.remedy)
    begun, body = state.begun, state.body
    checks = [check for line in range(len(state.plans)) for check in state.lengths(line)]
    ball = (body.tip_radius, body.tip_radius_sigma)
    for number, sphere in enumerate(begun.spheres):
        checks += sphere_checks(
            state.sphere_name(number), state.sphere_tips(number), ball, sphere, begun.limits,
            begun.temperature_c,
        )  # fmt: skip
    conform = all(begun.limits.passes(check) for check in checks)
    corners, repeats = state.corners(), _repeats(state)
    explained = [] if conform else culprits(state)
    found = [*reused, *_unreached(corners), *explained]
    found += _moved(state, repeats, tip_is_known=TIP not in {one.code for one in explained})
    rule = begun.limits.describe()
    if state.repeated:
        rule += f"; repeated once: {state.plans[state.repeated[0]].name}"
    everything = _in_order(state)
    return VerificationRecord(
        schema=VERIFICATION_SCHEMA,
        calibration=begun.running,
        made_utc=max(one.event.utc for one in everything),
        made_by=begun.who,
        software=begun.software,
        temperature_c=begun.temperature_c,
        rule=rule,
        checks=tuple(checks),
        artefacts=uses_of(state),
        data_sha256=hash_of(np.array([from_spots(one.event.uv) for one in everything])),
        passed=conform and not any(one.refuses for one in found),
        superseded=state.superseded,
        corners=corners,
        repeats=tuple(_recorded(one) for one in repeats),
        objections=tuple(Objection(code=o.code, what=o.what, remedy=o.remedy) for o in found),
        notes=(*state.planning.notes, *_camera_notes(state)),
    )


def _camera_notes(state: VerificationState) -> tuple[str, ...]:
    """Return what the cameras cannot prove, for the record and its papers."""
    return tuple(f"{UNPROVEN_CAMERAS}: {one}" for one in doubts_by_name(state.rig.device))


def uses_of(state: VerificationState) -> tuple[ArtefactUse, ...]:
    """Return the artefacts that a verification rests on, each once."""
    artefacts: tuple[LengthBar | Sphere, ...] = (state.begun.bar, *state.begun.spheres)
    uses = [one.artefact.use for one in artefacts]
    return tuple(dict.fromkeys(uses))


def _repeats(state: VerificationState) -> tuple[JudgedRepeat, ...]:
    """Return every later visit of a seat against the first one."""
    pairs = []
    for seat in range(SEATS):
        first, *later = (state.taken[i] for i in state.visits(seat))
        pairs += [Repeat(f"seat {seat + 1}", _resting(first), _resting(one)) for one in later]
    return judge_repeats(pairs)


def _resting(one: Taken) -> RestingPosition:
    return RestingPosition(one.tip, one.rest.touch.noise, one.event.utc)


def _moved(
    state: VerificationState, repeats: Sequence[JudgedRepeat], *, tip_is_known: bool
) -> list[Finding]:
    """Return which camera moved, and which seats did; empty where nothing did.

    A wrong tip moves the ball as the probe is turned, in seats as well: then only what the spots
    show of a camera counts.
    """
    # Points on a sphere lie so near each other that they share the pattern of the sensors.
    taken = [one for one in _in_order(state) if not isinstance(one.event, SphereTouched)]
    rests = [one.rest for one in taken]
    pairs = []
    for seat in range(SEATS):
        visits = [state.taken[i] for i in state.visits(seat)]
        pairs.append((taken.index(visits[0]), taken.index(visits[-1])))
    body = state.body
    if not tip_is_known:
        covariance = body.geometry_covariance.copy()
        covariance[-3:, -3:] += _ANYWHERE_MM**2 * np.eye(3)
        body = replace(body, geometry_covariance=covariance)
    step = camera_step(rests, pairs, state.rig, body)
    found = [step_finding(step, rests, state.rig, _REMEDY)]
    if tip_is_known:
        found.append(repeat_finding(repeats, _REMEDY))
    return [one for one in found if one is not None]


def _in_order(state: VerificationState) -> list[Taken]:
    """Return everything that was taken, also what was replaced, in the order of time."""
    return sorted([*state.taken, *state.replaced], key=lambda one: one.event.utc)


def _unreached(corners: Sequence[Corner]) -> list[Finding]:
    missing = [one.name for one in corners if not one.reached and not one.reason]
    if not missing:
        return []
    return [
        Finding(
            "verification.corners",
            f"No test length ends in corner {', '.join(missing)} of the volume (within "
            f"{100.0 * CORNER_SHARE:.0f} % of each edge).",
            "Place the bar there, or state why it cannot be reached.",
            refuses=True,
        )
    ]


def _recorded(one: JudgedRepeat) -> RepeatedSeat:
    x, y, z = (float(value) for value in one.shift_world)
    return RepeatedSeat(
        place=one.place, first_utc=one.first_utc, again_utc=one.again_utc, shift_mm=(x, y, z),
        square=one.normalised_square, limit=one.limit,
    )  # fmt: skip

"""Verdict of a verification: its checks, motion in between, and causes of a failure.

Causes are another tip or a wrong scale. The ball of line i rests at p_i + s_j u_i in nest j, s_j as
certified. A tip displaced by d in the probe moves it by R_ij d, so that lines bend as the probe is
turned; a wrong scale stretches all lines equally. Each is a linear least-squares problem, together
with place and direction of every line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime

import numpy as np

from ocmm_core.calibration import guided, records
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.verification._limits import Limits
from ocmm_core.calibration.verification._line_causes import SCALE, TIP, TrackerLines, culprits
from ocmm_core.calibration.verification._line_planning import CORNER_SHARE
from ocmm_core.calibration.verification._state import SphereTouched, Taken, VerificationState
from ocmm_core.calibration.verification._verification import sphere_checks
from ocmm_core.errors import CalibrationError
from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS, doubts_by_name


def judge_artefacts(
    bar: records.LengthBar, spheres: Sequence[records.Sphere], limits: Limits, now: datetime,
    temperature: Temperature | None, calibration: records.CameraRecord | None,
) -> list[records.Finding]:  # fmt: skip
    """Return objections to artefacts of a verification of ``calibration`` with these limits."""
    lengths = [nest - bar.nests[0] for nest in bar.nests[1:]]
    findings = [
        one
        for length in lengths
        for one in bar.artefact.judge(length, limits.of_length(length), now, temperature)
    ]
    for sphere in spheres:
        for limit in (limits.diameter, limits.form):
            findings += sphere.artefact.judge(sphere.diameter, limit, now, temperature)
    uses = [bar.artefact.use, *(sphere.artefact.use for sphere in spheres)]
    return findings + judge_independence(uses, calibration)


def judge_independence(
    uses: Sequence[records.ArtefactUse], calibration: records.CameraRecord | None
) -> list[records.Finding]:
    """Return objections to artefacts that gave the calibration its scale.

    Artefacts are the same if serial number or certificate file agree.
    """
    known = () if calibration is None else calibration.artefacts
    same = [use for use in uses if any(_is_same(use, one) for one in known)]
    return [
        records.Finding(
            "verification.same_artefact",
            f"The cameras were calibrated with the same '{use.name}' (serial {use.serial}): a "
            "certificate error would go unnoticed, so this is not an independent check.",
            "Verify with another certified length: a second bar, or a bar whose nests are those "
            "of a certified ball bar. If you have only one, keep it for verifications and "
            "borrow another for the calibration.",
            refuses=True,
        )
        for use in dict.fromkeys(same)
    ]


def _is_same(one: records.ArtefactUse, other: records.ArtefactUse) -> bool:
    if records.same_serial(one.serial, other.serial):
        return True
    return bool(one.certificate_sha256) and one.certificate_sha256 == other.certificate_sha256


_ANYWHERE_MM = 100.0
_REMEDY = "Find what moved (camera, frame, table or seat), fix it, and verify again."


def verdict(
    state: VerificationState, calibration: records.CameraRecord | None, good_utc: str
) -> records.VerificationRecord:
    """Return the record of the observations; CalibrationError if incomplete or misplaced.

    ``good_utc``: last good verification, ISO 8601; empty: none.
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
            begun.temperature,
        )  # fmt: skip
    conform = all(begun.limits.passes(check) for check in checks)
    corners, repeats = state.corners(), _repeats(state)
    tracker = None if state.rig.markers is None else TrackerLines(state)
    explained = [] if tracker is None else tracker.findings()
    if not conform and tracker is None:
        explained = culprits(state)
    tip_is_known = TIP not in {one.code for one in explained}
    moved, seen = _moved(state, repeats, tip_is_known=tip_is_known, failed=not conform)
    if tracker is not None and SCALE in {one.code for one in explained}:
        # It shows in the probe and in repeated seats as well.
        moved = []
    uses = _uses_of(state)
    reused = judge_independence(uses, calibration)
    found = [*reused, *_unreached(corners), *explained, *moved]
    arose = records.ErrorInterval(
        good_utc=good_utc or ("" if calibration is None else calibration.made_utc),
        seen_utc=seen, verified=bool(good_utc),
    )  # fmt: skip
    rule = begun.limits.describe()
    if state.repeated:
        rule += f"; repeated once: {state.plans[state.repeated[0]].name}"
    everything = _in_order(state)
    return records.VerificationRecord(
        schema=records.VERIFICATION_SCHEMA, calibration=begun.running,
        made_utc=max(one.event.utc for one in everything), made_by=begun.who,
        software=begun.software, temperature_c=begun.temperature_c, rule=rule, checks=tuple(checks),
        artefacts=uses,
        data_sha256=guided.hash_of(
            np.array([guided.from_spots(one.event.uv) for one in everything])
        ),
        passed=conform and not any(one.refuses for one in found), superseded=state.superseded,
        corners=corners, repeats=tuple(_recorded(one) for one in repeats),
        objections=tuple(
            records.Objection(code=o.code, what=o.what, remedy=o.remedy) for o in found
        ),
        notes=(*state.planning.notes, *(
            f"{UNPROVEN_CAMERAS}: {one}" for one in doubts_by_name(state.rig.device)
        )),
        arose=None if conform and not moved else arose,
        scale=None if tracker is None else tracker.scale,
    )  # fmt: skip


def _uses_of(state: VerificationState) -> tuple[records.ArtefactUse, ...]:
    """Return the artefacts of a verification, each once."""
    artefacts: tuple[records.LengthBar | records.Sphere, ...] = (
        state.begun.bar,
        *state.begun.spheres,
    )
    return tuple(dict.fromkeys([one.artefact.use for one in artefacts]))


def _repeats(state: VerificationState) -> tuple[guided.JudgedRepeat, ...]:
    """Return every later visit of a seat against the first one."""
    pairs = []
    for seat in range(guided.SEATS):
        first, *later = (state.taken[i] for i in state.visits(seat))
        pairs += [
            guided.Repeat(f"seat {seat + 1}", _resting(first), _resting(one)) for one in later
        ]
    return guided.judge_repeats(pairs)


def _resting(one: Taken) -> guided.RestingPosition:
    return guided.RestingPosition(one.tip, one.rest.touch.noise, one.event.utc)


def _moved(
    state: VerificationState,
    repeats: Sequence[guided.JudgedRepeat],
    *,
    tip_is_known: bool,
    failed: bool,
) -> tuple[list[records.Finding], str]:
    """Return findings on cameras, probe, and on seats if the tip is known; and when first seen."""
    # Points on a sphere are so close together that they share the sensor pattern.
    taken = [one for one in _in_order(state) if not isinstance(one.event, SphereTouched)]
    rests = [one.rest for one in taken]
    pairs = []
    for seat in range(guided.SEATS):
        visits = [state.taken[i] for i in state.visits(seat)]
        pairs.append((taken.index(visits[0]), taken.index(visits[-1])))
    body = state.body
    if not tip_is_known:
        covariance = body.geometry_covariance.copy()
        covariance[-3:, -3:] += _ANYWHERE_MM**2 * np.eye(3)
        body = replace(body, geometry_covariance=covariance)
    changes = guided.session_changes(rests, pairs, state.rig, body, failed=failed)
    found = guided.change_findings(changes, rests, state.rig, _REMEDY)
    if tip_is_known:
        again = guided.repeat_finding(repeats, _REMEDY)
        if again is not None:
            found.append(again)
    return found, _first_seen(changes, rests, found)


def _first_seen(
    changes: Sequence[Sequence[guided.SessionChange]],
    rests: Sequence[guided.Rest],
    found: Sequence[records.Finding],
) -> str:
    """Return when an error was first seen: the first rest, unless all changes came later."""
    every = [one for alike in changes for one in alike]
    during = bool(every) and all(one.course is not guided.TimeCourse.BEFORE for one in every)
    if during:
        return min(rests[one.first].utc for one in every)
    return rests[-1 if found and not every else 0].utc


def _in_order(state: VerificationState) -> list[Taken]:
    return sorted([*state.taken, *state.replaced], key=lambda one: one.event.utc)


def _unreached(corners: Sequence[records.Corner]) -> list[records.Finding]:
    missing = [one.name for one in corners if not one.reached and not one.reason]
    if not missing:
        return []
    return [
        records.Finding(
            "verification.corners",
            f"No test length ends in corner {', '.join(missing)} of the volume (within "
            f"{100.0 * CORNER_SHARE:.0f} % of each edge).",
            "Place the bar there, or state why it cannot be reached.",
            refuses=True,
        )
    ]


def _recorded(one: guided.JudgedRepeat) -> records.RepeatedSeat:
    x, y, z = (float(value) for value in one.shift_world)
    return records.RepeatedSeat(
        place=one.place, first_utc=one.first_utc, again_utc=one.again_utc, shift_mm=(x, y, z),
        square=one.normalised_square, limit=one.limit,
    )  # fmt: skip

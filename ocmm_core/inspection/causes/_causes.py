"""Explanations: why a characteristic is NOT CONFORM or NOT PROVEN, and the remedy.

A cause needs evidence in the points of the whole job, and the value must be good, or much nearer to
it, without it, as evaluated again with points omitted, moved or flipped. The first with both is
named, the most specific first; the part is the last resort.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import msgspec
import numpy as np

from ocmm_core.alignment import BoundAlignment, SavedFrame, nominal_frame
from ocmm_core.camera import Rig
from ocmm_core.errors import OcmmError
from ocmm_core.features.shapes import POINT
from ocmm_core.geometry import Float, Int, RigidTransform
from ocmm_core.inspection.causes._common_causes import (
    Common,
    ball_taken_off,
    brought_home,
    expansion,
    growth_taken_off,
)
from ocmm_core.inspection.causes._deviations import Suspects
from ocmm_core.inspection.causes._inquiry import (
    MOST_POINTS,
    Cause,
    CauseFinding,
    Explanation,
    Inquiry,
    amount_words,
    beyond_limit,
    points_words,
)
from ocmm_core.inspection.causes._remaining_causes import few_points, scatter, the_part, uncertainty
from ocmm_core.inspection.evaluation import EvaluatedJob, JobView, SessionOptions, evaluated_job
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_core.tolerances.kinds import spec_of
from ocmm_core.tolerances.zones import Characteristic
from ocmm_core.tracking import ProbeBody, TipSensitivity

_SIDE = 0.15
"""Tolerated difference between an offset and a ball diameter, relative to the diameter."""
_OTHER_PLACE = 0.5
"""Tolerated difference between two nominals of one place, relative to the tolerance."""


def cause_of(inquiry: Inquiry, item: Characteristic, result: CharacteristicResult) -> CauseFinding:
    """Return the cause that the evidence supports, and the remedy."""
    if inquiry.is_doubted(item, result):
        return CauseFinding(Cause.DOUBT, (), (), result.note)
    for ask in (
        _side, _single_points, _ball, _warmth, _datum, _frame, few_points, scatter, uncertainty,
    ):  # fmt: skip
        found = ask(inquiry, item, result)
        if found is not None:
            return found
    return the_part(inquiry, item, result)


def _side(
    inquiry: Inquiry, item: Characteristic, result: CharacteristicResult
) -> CauseFinding | None:
    common = inquiry.common
    if common is None:
        return None
    for surface in common.surfaces:
        name = surface.name
        if name not in inquiry.rests_on(item):
            continue
        T = common.place.T_nominal_from_world
        off, normals, _ = surface.lies(T)
        diameter = 2.0 * surface.tip_radius
        if not surface.nominal.shape.spec.is_curved:
            seen = T.rotation @ surface.direction
            if float(np.mean(normals @ seen)) >= 0.0:
                continue
            points = inquiry.turned(name)
        else:
            apart = abs(abs(float(np.mean(off))) - diameter) + float(np.ptp(off))
            if apart > _SIDE * diameter:
                continue
            back = -float(np.mean(off)) * normals @ T.rotation
            points = inquiry.job.moved(_placed(len(inquiry.numbers), surface.places, back))
        trial = inquiry.trial(
            f"side {name}", partial(inquiry.job.results_of, inquiry.items, points)
        )
        if inquiry.cured(item, trial) is not None:
            return CauseFinding(
                Cause.SIDE, (name,), inquiry.own_points(name)[:MOST_POINTS],
                f"Check the probe side of {name}: flip its points, or re-probe it from outside "
                "the material.",
                f"{name} is off by the ball diameter, {diameter:.3f} mm.",
            )  # fmt: skip
    return None


def _single_points(
    inquiry: Inquiry, item: Characteristic, result: CharacteristicResult
) -> CauseFinding | None:
    best: tuple[float, Suspects] | None = None
    for name in inquiry.rests_on(item):
        seen = inquiry.suspects.get(name)
        if seen is None:
            continue
        trial = inquiry.trial(
            f"without {name}", partial(inquiry.job.results_without, inquiry.items, seen.numbers)
        )
        left = inquiry.cured(item, trial)
        if left is not None and (best is None or left < best[0]):
            best = left, seen
    if best is None:
        return None
    seen = best[1]
    name, points = seen.feature, points_words(seen.numbers)
    off = ", ".join(f"{value:+.3f}" for value in seen.off)
    evidence = f"Far better without {points}; off by {off} mm."
    if name not in inquiry.own_features(item) or name in inquiry.held_by:
        return CauseFinding(
            Cause.DATUM, (name,), seen.numbers, f"Re-probe {points} of datum {name}.", evidence
        )
    if seen.is_burr:
        return CauseFinding(
            Cause.BURR, (name,), seen.numbers,
            f"Clean or deburr {name} at {points}, then re-probe them.", evidence,
        )  # fmt: skip
    return CauseFinding(
        Cause.OUTLIER, (name,), seen.numbers, f"Re-probe {points} of {name}.", evidence
    )


def _ball(
    inquiry: Inquiry, item: Characteristic, result: CharacteristicResult
) -> CauseFinding | None:
    common = inquiry.common
    if common is None or common.ball is None:
        return None
    trial = inquiry.moved("ball", lambda: ball_taken_off(inquiry.job, common))
    if inquiry.cured(item, trial) is None:
        return None
    small, large = ("inner", "outer") if common.ball > 0.0 else ("outer", "inner")
    if common.both_sides:
        seen = f"every {small} size is too small and every {large} one too large"
    else:
        seen = "all sizes are off in the same direction"
    return CauseFinding(
        Cause.TIP, inquiry.own_features(item), inquiry.strongest(item, result),
        f"Qualify the tip: {seen}, by about {2.0 * abs(common.ball):.3f} mm.",
        f"The ball appears {2.0 * abs(common.ball):.3f} mm "
        f"{'larger' if common.ball > 0.0 else 'smaller'} than the diameter in use.",
    )  # fmt: skip


def _warmth(
    inquiry: Inquiry, item: Characteristic, result: CharacteristicResult
) -> CauseFinding | None:
    common, job = inquiry.common, inquiry.job
    if common is None or common.growth is None:
        return None
    trial = inquiry.moved("growth", lambda: growth_taken_off(job, common))
    if inquiry.cured(item, trial) is None:
        return None
    grow = "grow" if common.growth > 0.0 else "shrink"
    per_100 = 1e5 * abs(common.growth)
    kelvin = common.growth / expansion(job)
    known = job.options.climate.part
    verb = "Check" if known.now is not None else "Enter"
    if known.now is not None and not known.compensated:
        verb = "Compensate"
    return CauseFinding(
        Cause.TEMPERATURE, inquiry.own_features(item), inquiry.strongest(item, result),
        f"{verb} the part's temperature: lengths {grow} with distance, {per_100:.0f} µm per "
        "100 mm.",
        f"Equivalent to about {kelvin:+.0f} K.",
    )  # fmt: skip


def _datum(
    inquiry: Inquiry, item: Characteristic, result: CharacteristicResult
) -> CauseFinding | None:
    common = inquiry.common
    if common is None:
        return None
    own = inquiry.own_features(item)
    best: tuple[float, str] | None = None
    for name in inquiry.rests_on(item):
        # Features that hold the frame are datums of all else, even if toleranced themselves.
        if (name in own and name not in inquiry.held_by) or not common.stands_out(name):
            continue
        trial = inquiry.moved(f"home {name}", partial(brought_home, inquiry.job, common, name))
        left = inquiry.cured(item, trial)
        if left is not None and (best is None or left < best[0]):
            best = left, name
    if best is None:
        return None
    name = best[1]
    off = common.place.misfits[name]
    return CauseFinding(
        Cause.DATUM, (name,), inquiry.farthest(name),
        f"Clean and re-probe datum {name}: inconsistent with the other features.",
        f"{name} is off by {off:.3f} mm while the other features agree.",
    )  # fmt: skip


def _frame(
    inquiry: Inquiry, item: Characteristic, result: CharacteristicResult
) -> CauseFinding | None:
    common, job = inquiry.common, inquiry.job
    bound = job.plan.bound_alignment
    if bound is None:
        return None
    drawn = _drawn_place(item, bound)
    apart = 0.0 if drawn is None else abs(drawn - item.nominal)
    if drawn is not None and apart > _OTHER_PLACE * (item.upper - item.lower):
        at = msgspec.structs.replace(item, nominal=drawn)
        if (beyond_limit(at, result) or 0.0) < 0.0:
            return CauseFinding(
                Cause.ALIGNMENT, bound.features, (),
                f"Check the alignment ({bound.frame}): in it, the plan nominal of "
                f"{item.features[0]} is {drawn:.3f} mm, not {item.nominal:.3f} mm.",
                "The value agrees with the nominal geometry of the plan.",
            )  # fmt: skip
    if common is None or common.shifted is None:
        return None
    trial = inquiry.trial("frame", lambda: job.results_in(inquiry.items, _saved(bound, common)))
    if inquiry.cured(item, trial) is None:
        return None
    return CauseFinding(
        Cause.ALIGNMENT, bound.features, inquiry.strongest(item, result),
        f"Check the alignment ({bound.frame}): the features agree with each other, but the "
        f"frame is off by {common.shifted:.3f} mm.",
        "One motion of the frame brings all features to their nominals.",
    )  # fmt: skip


def _placed(count: int, places: Int, rows: Float) -> Float:
    spread = np.zeros((count, 3))
    spread[places] = rows
    return spread


def _drawn_place(item: Characteristic, bound: BoundAlignment) -> float | None:
    """Return the coordinate of the nominal geometry in the frame of the plan; None without one."""
    geometry = bound.nominals.get(item.features[0])
    if geometry is None or not spec_of(item.kind).is_place:
        return None
    try:
        place = nominal_frame(bound).apply(geometry[POINT])
    except OcmmError:
        return None
    return float(place["xyz".index(item.axis)])


def _saved(bound: BoundAlignment, common: Common) -> BoundAlignment:
    """Return the plan's frame at the place supported by most features, as a known frame."""
    T: RigidTransform = nominal_frame(bound).compose(common.place.T_nominal_from_world)
    rows = tuple(tuple(float(value) for value in row) for row in T.rotation)
    nothing = tuple((0.0,) * 6 for _ in range(6))
    frame = SavedFrame(
        name="of all features", digest="",
        rotation=rows, translation=tuple(T.translation.tolist()), covariance=nothing,  # type: ignore[arg-type]  # three numbers a row
    )  # fmt: skip
    return BoundAlignment(frame, bound.shapes, bound.nominals)


EXPLAINED = (Verdict.NOT_CONFORM, Verdict.NOT_PROVEN)


def explanations(
    plan: Plan,
    view: JobView,
    points: Sequence[MeasuredPoint],
    sensitivities: Sequence[TipSensitivity],
    rig: Rig,
    body: ProbeBody,
    options: SessionOptions,
) -> tuple[Explanation, ...]:
    """Explain every result that is NOT CONFORM or NOT PROVEN; evaluates the job several times.

    Arguments as `evaluation.evaluate_job`: the points that count, as stored.
    """
    if not any(result.verdict in EXPLAINED for result in view.characteristics):
        return ()
    job = evaluated_job(plan, points, sensitivities, rig, body, options)
    return explanations_of(job, view)


def explanations_of(job: EvaluatedJob, view: JobView) -> tuple[Explanation, ...]:
    """Return the same for an evaluated job."""
    inquiry = Inquiry(job, view)
    asked = {item.name: item for item in job.plan.characteristics}
    return tuple(
        explain(inquiry, asked[result.name], result)
        for result in view.characteristics
        if result.verdict in EXPLAINED and result.name in asked
    )


def explain(inquiry: Inquiry, item: Characteristic, result: CharacteristicResult) -> Explanation:
    """Return why one characteristic is not CONFORM, and the remedy."""
    beyond, uncertainty = beyond_limit(item, result), result.uncertainty
    finding = cause_of(inquiry, item, result)
    if beyond is None or uncertainty is None:
        why = result.note
    elif finding.cause is Cause.DOUBT:
        told = amount_words(item, result)
        why = f"The measurement is in doubt. {told}"
    else:
        why = amount_words(item, result)
    return Explanation(result.name, result.verdict, result.unit, beyond, uncertainty, why, finding)

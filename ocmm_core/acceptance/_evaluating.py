"""Judged values of all complete positions, retests included (`_kinds` supersedes)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ocmm_core.acceptance._procedure import InterimTest, LocationTest, LongStylusTest
from ocmm_core.acceptance._result import JudgedValue, UsedArtefact
from ocmm_core.acceptance._situation import Situation, certified_at
from ocmm_core.acceptance._values import (
    block_length,
    faces_normal,
    location_value,
    nest_lengths,
    repeat_ranges,
    spat_values,
    sphere_values,
    thickness,
    volumetric_values,
)
from ocmm_core.errors import InternalError
from ocmm_core.geometry import Float


def repeated_lengths(at: Situation, position: int) -> Float:
    """Return lengths (items, repeats), mm, of a position with a bar or gauge block."""
    plan = at.plan[position]
    if plan.role == "gauge block":
        faces = at.tips[position].reshape(plan.repeats, 2, -1, 3)
        radius = at.stage.instrument.ball_radius
        return np.array([[block_length(one, two, faces_normal(one, two), radius)
                          for one, two in faces]])  # fmt: skip
    nests = at.tips[position].reshape(plan.repeats, len(plan.points_world), 3)
    return np.array([nest_lengths(one) for one in nests]).T


def length_values(at: Situation) -> Iterator[JudgedValue]:
    """Yield E (E_L with a long stylus) of every length."""
    quantity = "E_L" if isinstance(at.stage.procedure.test, LongStylusTest) else "E"
    for position in at.complete():
        plan, repeats = at.plan[position], at.plan[position].repeats
        for item, lengths in zip(plan.items, repeated_lengths(at, position), strict=True):
            nominal = _nominal(at, position, item)
            artefact = _artefact(at, position)
            certified, expanded = certified_at(artefact, nominal, at.temperatures[position])
            if artefact.role == "gauge block":
                # Both sides: u of the ball's radius, twice and k = 2.
                expanded = float(np.hypot(expanded, 4.0 * at.stage.instrument.ball_sigma))
            for number, length in enumerate(lengths):
                name = f"{nominal:.0f} mm"
                yield at.value(
                    quantity,
                    position,
                    f"{name}, repeat {number + 1}" if repeats > 1 else name,
                    item=item,
                    nominal=nominal,
                    measured=float(length),
                    certified=certified,
                    expanded=expanded,
                )


def e0_values(at: Situation) -> Iterator[JudgedValue]:
    """Yield E of every length, and the range R0 of every set of repeats."""
    yield from length_values(at)
    for position in at.complete():
        plan = at.plan[position]
        if plan.role == "gauge block":
            # R0 is of the bar's lengths; a block serves two-sided probing only.
            continue
        for item, spread in zip(
            plan.items, repeat_ranges(repeated_lengths(at, position)), strict=True
        ):
            nominal = _nominal(at, position, item)
            yield at.value(
                "R0",
                position,
                f"{nominal:.0f} mm, {plan.repeats} repeats",
                item=item,
                nominal=nominal,
                measured=float(spread),
            )


def _nominal(at: Situation, position: int, item: int) -> float:
    """Return the certified length of an item at 20 degrees, mm, by the plan."""
    if at.plan[position].role == "gauge block":
        return _artefact(at, position).sizes[0]
    plan = at.plan[position]
    points = np.array(plan.points_world)
    length = float(np.linalg.norm(points[1 + plan.items.index(item)] - points[0]))
    sizes = at.stage.only("bar").sizes
    return min((abs(a - sizes[0]) for a in sizes[1:]), key=lambda one: abs(one - length))


def _artefact(at: Situation, position: int) -> UsedArtefact:
    """Return the artefact of a position; of several blocks, the planned one by length and ball."""
    plan = at.plan[position]
    found = at.stage.of_role(plan.role) or (at.stage.only(plan.role),)
    if len(found) == 1:
        return found[0]
    faces = np.array(plan.points_world).reshape(2, -1, 3).mean(axis=1)
    apart = float(np.linalg.norm(faces[1] - faces[0])) - 2.0 * at.stage.instrument.ball_radius
    return min(found, key=lambda one: abs(one.sizes[0] - apart))


def sphere_results(at: Situation) -> Iterator[JudgedValue]:
    """Yield size and form of the sphere at every position."""
    for position in at.complete():
        yield _size(at, position, "P_Size")
        form = sphere_values(at.tips[position]).form
        yield at.value(
            "P_Form", position, "form", item=1, measured=form, expanded=_form_of_sphere(at)
        )


def diameter_results(at: Situation) -> Iterator[JudgedValue]:
    """Yield the effective diameter of every repeat."""
    return (_size(at, position, "D_eff") for position in at.complete())


def _size(at: Situation, position: int, quantity: str) -> JudgedValue:
    sphere, ball = at.stage.only("sphere"), at.stage.instrument
    certified, expanded = certified_at(sphere, sphere.sizes[0], at.temperatures[position])
    measured = sphere_values(at.tips[position]).diameter - 2.0 * ball.ball_radius
    # u of the ball's radius, twice for the diameter and k = 2.
    expanded = float(np.hypot(expanded, 4.0 * ball.ball_sigma))
    return at.value(
        quantity, position, "size", measured=measured, certified=certified, expanded=expanded
    )


def _form_of_sphere(at: Situation) -> float:
    """Return U of a form: the sphere's own, or its certificate if no form is stated."""
    sphere = at.stage.only("sphere")
    return sphere.form or sphere.expanded


def location_results(at: Situation) -> Iterator[JudgedValue]:
    """Yield L_Dia of the five attitudes at every place, and of its retest."""
    numbers = at.stage.procedure.test
    if not isinstance(numbers, LocationTest):
        raise InternalError("acceptance.kind", "Not a location test.", "Report this.")
    for group in groups(at, 5):
        centres = np.array([sphere_values(at.tips[one]).centre for one in group])
        depth_part = at.plan[group[0]].place
        yield at.value(
            "L_Dia", group[0], f"5 attitudes, {depth_part}", measured=location_value(centres)
        )


def ball_results(at: Situation) -> Iterator[JudgedValue]:
    """Yield size and form of every measurement, and the spread of the centres."""
    yield from sphere_results(at)
    for group in groups(at, len([one for one in at.plan if one.retest_of < 0])):
        centres = np.array([sphere_values(at.tips[one]).centre for one in group])
        yield at.value(
            "L_Dia",
            group[0],
            f"centres of {len(group)} measurements",
            item=2,
            measured=location_value(centres),
        )


def groups(at: Situation, count: int) -> list[list[int]]:
    """Return complete groups of positions at one place, first and in every retest."""
    found: dict[tuple[str, int], list[int]] = {}
    for position, plan in enumerate(at.plan):
        found.setdefault((plan.place, at.depth(position)), []).append(position)
    return [
        sorted(group, key=at.root)
        for group in found.values()
        if len(group) == count and all(at.is_complete(one) for one in group)
    ]


def spat_results(at: Situation) -> Iterator[JudgedValue]:
    """Yield the largest distance from the mean, and two sigma, in every place."""
    for position in at.complete():
        values = spat_values(at.tips[position])
        for item, (quantity, value) in enumerate(
            (("SPAT_max", values.largest), ("SPAT_2s", values.two_sigma))
        ):
            yield at.value(
                quantity, position, f"{len(at.tips[position])} points", item=item, measured=value
            )


def volumetric_results(at: Situation) -> Iterator[JudgedValue]:
    """Yield the figures of all placements together, and the largest of them."""
    bar = at.stage.only("bar")
    depths = [at.depth(one) for one in range(len(at.plan))]
    for depth in range(max(depths) + 1):
        done = [one for one in at.complete() if depths[one] == depth]
        everything = depths.count(depth)
        if not done or len(done) != everything:
            continue
        errors, largest_u = [], 0.0
        for position in done:
            nominal = _nominal(at, position, at.plan[position].items[0])
            certified, expanded = certified_at(bar, nominal, at.temperatures[position])
            errors.append(float(repeated_lengths(at, position)[0, 0]) - certified)
            largest_u = max(largest_u, expanded)
        values = volumetric_values(np.array(errors))
        for item, (quantity, value) in enumerate(
            (("V_max", values.largest), ("V_range", values.half_range), ("V_2RMS", values.two_rms))
        ):
            yield at.value(
                quantity,
                done[0],
                f"{len(done)} placements",
                item=item,
                measured=value,
                expanded=0.0 if quantity == "V_range" else largest_u,
            )


def plate_results(at: Situation) -> Iterator[JudgedValue]:
    """Yield thickness and coplanarity (RMS from the plane, over n) of bed and block."""
    plate = at.stage.only("plate")
    for group in groups(at, 2):
        bed, top = (at.tips[one] for one in group)
        # Both faces are touched from above, so the ball's radius cancels.
        measured = float(thickness(bed, top, 0.0).mean())
        certified, expanded = certified_at(plate, plate.sizes[0], at.temperatures[group[0]])
        yield at.value(
            "Thickness",
            group[0],
            f"mean of {len(top)} points",
            nominal=plate.sizes[0],
            measured=measured,
            certified=certified,
            expanded=expanded,
        )
        for item, (side, points) in enumerate((("bed", bed), ("top of the block", top)), start=1):
            away = points - points.mean(axis=0)
            normal = np.linalg.svd(away, full_matrices=False)[2][-1]
            yield at.value(
                "Coplanarity",
                group[item - 1],
                f"rms of {len(points)} points, {side}",
                item=item,
                measured=float(np.sqrt(np.mean((away @ normal) ** 2))),
                expanded=plate.form,
            )


def interim_results(at: Situation) -> Iterator[JudgedValue]:
    """Yield the distance of two spheres, and both diameters."""
    if not isinstance(at.stage.procedure.test, InterimTest):
        raise InternalError("acceptance.kind", "Not an interim check.", "Report this.")
    dumbbell, ball = at.stage.only("dumbbell"), at.stage.instrument
    for group in groups(at, 2):
        spheres = [sphere_values(at.tips[one]) for one in group]
        apart = float(np.linalg.norm(spheres[1].centre - spheres[0].centre))
        certified, expanded = certified_at(dumbbell, dumbbell.sizes[2], at.temperatures[group[0]])
        yield at.value(
            "Interim_L",
            group[0],
            "distance",
            item=2,
            nominal=dumbbell.sizes[2],
            measured=apart,
            certified=certified,
            expanded=expanded,
        )
        for item, (position, sphere) in enumerate(zip(group, spheres, strict=True)):
            certified, expanded = certified_at(
                dumbbell, dumbbell.sizes[item], at.temperatures[position]
            )
            yield at.value(
                "Interim_D",
                position,
                "diameter",
                measured=sphere.diameter - 2.0 * ball.ball_radius,
                certified=certified,
                expanded=float(np.hypot(expanded, 4.0 * ball.ball_sigma)),
            )

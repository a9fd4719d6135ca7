"""What a modifier of material adds to the tolerance of a position (ISO 2692)."""

from __future__ import annotations

from dataclasses import replace

import msgspec

from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature
from ocmm_core.features.shapes import RADIUS, SECOND
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.kinds._shape_groups import SLOTS
from ocmm_core.tolerances.kinds._size import associated_size, own_association, size_words
from ocmm_core.tolerances.zones import (
    Association,
    Characteristic,
    Evaluation,
    slot_envelope,
)


def with_bonus(
    characteristic: Characteristic, feature: ActualFeature, found: Evaluation
) -> Evaluation:
    """Return an evaluation with what the size adds to the tolerance.

    At maximum material a bore is as small, a shaft as large as it may be; at least material the
    other way round. What the size is off that limit widens the zone by as much. Of all sizes that
    the points show the one counts that widens it least: the mating one (largest inscribed or
    smallest circumscribed; of a slot the planes along its sides), that of least squares, and the
    feature's own. Where there is no mating size there is no bonus.
    """
    if not characteristic.modifier:
        return found
    inner = feature.nominal.side == "inner"
    sign = 1.0 if inner == (characteristic.modifier == "maximum material") else -1.0
    bonus, gradient = 0.0, Rows.nothing()
    try:
        size = min(_sizes(characteristic, feature, sign), key=lambda one: sign * one.value)
    except FitError as error:
        note = f"No bonus, there is no mating size: {error.what}"
    else:
        own, kind = size.value, size.association
        note = f"Size for the bonus: {own:.4f} mm, {kind}."
        if sign * (size.value - characteristic.material_size) > 0.0:
            bonus = sign * (size.value - characteristic.material_size)
            gradient = sign * size.gradient
    return replace(found, bonus=bonus, bonus_gradient=gradient, note=f"{found.note} {note}".strip())


def _sizes(characteristic: Characteristic, feature: ActualFeature, sign: float) -> list[Evaluation]:
    """Return the sizes that points show, the mating one first.

    Parameters
    ----------
    sign
        1 where a greater size gives a greater bonus, else -1.

    Raises
    ------
    FitError
        The feature is constructed, or there is no such element.
    """
    slot = feature.fit.shape in SLOTS
    place = SECOND if slot else RADIUS
    own = Evaluation(
        2.0 * float(feature.fit.geometry[place]),
        2.0 * feature.jacobian[place],
        association=size_words(own_association(feature)),
    )
    if slot:
        size, gradient = slot_envelope(feature, widest=sign < 0.0)
        return [Evaluation(size, gradient, association="planes along its sides"), own]
    mating: Association = "inscribed" if sign > 0.0 else "circumscribed"
    asked = [
        msgspec.structs.replace(characteristic, kind="diameter", association=word)
        for word in (mating, "least squares")
    ]
    return [*(associated_size(one, feature) for one in asked), own]

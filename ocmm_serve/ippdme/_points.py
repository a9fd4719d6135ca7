"""Points: their text for the client, their note in the job, and whether they are the ones asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ocmm_core.geometry import Float
from ocmm_core.measuring import MeasuredPoint, RefusalCode
from ocmm_serve.ippdme._grammar import DmeDialect, call_text
from ocmm_serve.ippdme._state import AXES, BallPose, CommandedTouch, DmeState

ABSENT = ("R", "Tool.A", "Tool.B", "Tool.C")
"""Axes that a hand-held probe lacks."""
_ITEMS = (*AXES, "IJK", "ER", *ABSENT)
POINT_ITEMS = {
    DmeDialect.V14: _ITEMS, DmeDialect.V25: (*_ITEMS, "Q", "IJKAct", "Tool.Alignment")
}  # fmt: skip
_UNKNOWN = {"IJK": (0.0, 0.0, 0.0), "Tool.Alignment": (0.0, 0.0, 0.0)}
_NUMBERS = {
    RefusalCode.LOST: 1501, RefusalCode.UNIDENTIFIED: 1501, RefusalCode.NOT_READY: 1000,
    RefusalCode.CALIBRATION: 1000, RefusalCode.REFERENCE: 1000, RefusalCode.PAUSED: 1000,
    RefusalCode.TIP: 2000, RefusalCode.OUTSIDE: 1008, RefusalCode.STORAGE: 511,
}  # fmt: skip
FINAL = (
    RefusalCode.CALIBRATION, RefusalCode.TIP, RefusalCode.REFERENCE, RefusalCode.STORAGE,
    RefusalCode.PAUSED,
)  # fmt: skip
"""Refusals that another touch cannot avoid."""
_LEAST_COSINE = 0.5
"""Of the angle between the approach and the nominal normal, 60 degrees: else another face."""


def refusal_number(code: RefusalCode) -> int:
    """Return the error of a refused touch: by default an illegal touch."""
    return _NUMBERS.get(code, 1001)


def pose_text(state: DmeState, items: Sequence[str], pose: BallPose, radius: float = 0.0) -> str:
    """Return the text of a position in the active system; it has no direction."""
    place = state.frames.active_from_machine().apply(pose.tip_world)
    values = dict(zip(AXES, place.tolist(), strict=True)) | {"ER": radius, "Q": 0.0, "IJKAct": 0.0}
    return ", ".join(_item(state, one, values, _UNKNOWN) for one in items)


def point_text(state: DmeState, point: MeasuredPoint, normal: Float | None) -> str:
    """Return the text of a point in the active system and in the format of the report.

    `normal`: nominal of the client in the machine's system, (3,), unit; None: the direction in
    which the ball came, which shows the side of the material.
    """
    to_active = state.frames.active_from_machine()
    out = point.direction if normal is None else normal
    place, radius = point.tip_world, point.tip_radius
    if state.surface:
        # Radius 0: the program must not compensate a second time.
        place, radius = place - radius * out, 0.0
    values = dict(zip(AXES, to_active.apply(place).tolist(), strict=True))
    values |= {"ER": radius, "Q": 0.0, "IJKAct": 1.0 if normal is None else 2.0}
    way = to_active.rotation @ out
    # The handle is along z of the probe.
    handle = to_active.rotation @ point.rotation_world_from_probe[:, 2]
    vectors = {"IJK": way.tolist(), "Tool.Alignment": handle.tolist()}
    return ", ".join(_item(state, one, values, vectors) for one in state.report)


def _item(
    state: DmeState, name: str, values: Mapping[str, float], vectors: Mapping[str, Sequence[float]]
) -> str:
    if name in vectors:
        return call_text(name, *vectors[name])
    if name in ABSENT:
        return call_text(name, 0.0) if state.dialect is DmeDialect.V14 else f"{name}(NULL)"
    return call_text(name, values[name])


def point_note(
    state: DmeState, tag: str, point: MeasuredPoint, answer: str, target: CommandedTouch | None
) -> Mapping[str, object]:
    """Return the note of an answer for the job."""
    kind = "surface" if state.surface else "ball"
    note = {"point": point.number, "tag": tag, "answer": answer, "tool": state.tool, "kind": kind}
    nominal = normal = None
    if target is not None:
        nominal = target.surface.tolist()
        normal = None if target.normal is None else target.normal.tolist()
    return {**note, **state.frames.note(), "nominal": nominal, "normal": normal}


def fault_of(point: MeasuredPoint, target: CommandedTouch) -> str:
    """Return why a point is not that of a target, for the operator; empty if it is."""
    normal, expected = target.normal, target.surface
    if normal is not None:
        expected = expected + point.tip_radius * normal
    off = float(np.linalg.norm(point.tip_world - expected))
    if off > target.search_mm + (point.tip_radius if normal is None else 0.0):
        return (
            f"The touch was {off:.1f} mm off the nominal, more than the search distance of "
            f"{target.search_mm:g} mm. {target.words}"
        )
    if normal is not None and float(point.direction @ normal) < _LEAST_COSINE:
        return f"The touch came from another side than the nominal direction. {target.words}"
    return ""

"""What the virtual hand does in a step of a guided procedure: what that step still lacks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from ocmm_core.calibration.cameras import KnownPointsProcedure
from ocmm_core.calibration.relocation import RelocationProcedure
from ocmm_core.calibration.sweeping import AGAIN, SECOND, SWEEPS, PivotProcedure
from ocmm_core.calibration.tip import TipCheckProcedure, TipQualificationProcedure
from ocmm_core.calibration.verification import VerificationProcedure
from ocmm_core.camera import Rig
from ocmm_core.composition import (
    VirtualSite,
    relocation_by_step,
    scene_of_tip,
    scenes_of_known_points,
    verification_by_step,
)
from ocmm_core.simulation.calibration_scenes import Scene, SweepProbe, TipFault

_FIRST_CONE, _SECOND_CONE = (0.0, 0.0, -150.0), (70.0, 10.0, -130.0)
_SECONDS, _REACH_DEG, _REST_S = 30.0, (30.0, 30.0, 13.0), 3.0

Scenes = tuple[Scene, ...]


def scenes_of_step(site: VirtualSite, rig: Rig, procedure: Any) -> Scenes:
    """Return what a procedure wants to see in the step it is in; empty where it wants nothing.

    Parameters
    ----------
    rig
        The calibration that is worked with.
    procedure
        One of those that the table knows.
    """
    base = procedure.base
    if base.step.gate.open and base.step.wanted == 0:
        return ()
    for kind, scenes in _SCENES.items():
        if isinstance(procedure, kind):
            return scenes(site, rig, procedure).get(base.step.name, ())
    return ()


def _known_points(site: VirtualSite, _rig: Rig, procedure: KnownPointsProcedure) -> (
    Mapping[str, Scenes]
):  # fmt: skip
    return {"collect": scenes_of_known_points(site, procedure.view, procedure.points)}


def _relocation(
    site: VirtualSite, rig: Rig, procedure: RelocationProcedure
) -> Mapping[str, Scenes]:
    found = relocation_by_step(site, rig, procedure.view, procedure.bar, procedure.control)
    return {step: (scene,) for step, scene in found.items()}


def _verification(site: VirtualSite, rig: Rig, procedure: VerificationProcedure) -> (
    Mapping[str, Scenes]
):  # fmt: skip
    return verification_by_step(site, rig, procedure.view, procedure.bar, procedure.spheres)


def _pivot(site: VirtualSite, _rig: Rig, procedure: PivotProcedure) -> Mapping[str, Scenes]:
    step, view = procedure.base.step.name, procedure.view
    # A hand never sweeps the same way twice.
    begun = view.sweep.poses if view.sweep is not None else 0
    sweep = SweepProbe(
        cone=_FIRST_CONE, seconds=_SECONDS, seed=site.seed + 10 * begun, reach_deg=_REACH_DEG
    )
    if step == AGAIN:
        sweep = msgspec.structs.replace(sweep, seconds=_REST_S, reach_deg=(0.0, 0.0, 0.0))
    elif step == SECOND:
        sweep = msgspec.structs.replace(sweep, cone=_SECOND_CONE, seed=sweep.seed + 1)
    return {step: (sweep,)} if step in (*SWEEPS, AGAIN) else {}


def _tip(
    site: VirtualSite, rig: Rig, procedure: TipQualificationProcedure | TipCheckProcedure
) -> Mapping[str, Scenes]:
    scene = scene_of_tip(procedure.view, procedure.sphere, rig, site.seed, TipFault())
    return {
        "sphere": (msgspec.structs.replace(scene, handles=()),),
        "cone": (msgspec.structs.replace(scene, normals=()),),
    }


_SCENES: Mapping[type, Callable[[VirtualSite, Rig, Any], Mapping[str, Scenes]]] = {
    KnownPointsProcedure: _known_points,
    RelocationProcedure: _relocation,
    VerificationProcedure: _verification,
    PivotProcedure: _pivot,
    TipQualificationProcedure: _tip,
    TipCheckProcedure: _tip,
}

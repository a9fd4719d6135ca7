"""Probe, cameras and placement for the choice of targets."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from ocmm_cad.reach import TILT_DEG, Setting
from ocmm_cad.step.brep import Triple
from ocmm_core.calibration.probe_design import load_design, shipped_design
from ocmm_core.camera import Rig, load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.part_model import Placement
from ocmm_core.tracking import ProbeBody, load_probe


class StepRequest(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    ball_mm: float
    probe: str = ""
    """Document of the probe; empty to ignore stylus and body."""
    design: str = ""
    """Document of its design; empty for the shipped one of that name, if any."""
    rig: str = ""
    """Document of the cameras; empty to ignore sight."""
    up: Triple = (0.0, 0.0, 1.0)
    """Direction of the model that points up."""
    turn_deg: float = 0.0
    """Rotation about the vertical, applied after ``up``."""
    offset_world: Triple = (0.0, 0.0, 0.0)
    """mm: of the middle of the part from that of the measuring volume."""
    tilt_deg: float = TILT_DEG
    """Largest angle of the handle from upright."""


def usual_request(
    probe: Path | None = None, rig: Path | None = None, *, ball_mm: float | None = None
) -> StepRequest:
    """Return a request, by default with shipped documents, upright; InputError for a bad probe."""
    probe = resource("probes", "standard.toml") if probe is None else probe
    rig = resource("rigs", "recommended.toml") if rig is None else rig
    ball = 2.0 * load_probe(probe).tip_radius if ball_mm is None else ball_mm
    return StepRequest(ball_mm=ball, probe=str(probe), rig=str(rig))


def setting_for(body: ProbeBody, rig: Rig, up: Triple) -> Setting:
    """Return a setting with ``up`` upwards; InputError if the probe design is unusable."""
    design = shipped_design(body)
    return Setting(
        body=body,
        design=None if design is None else load_design(design, body),
        rig=rig,
        placement=Placement(up),
    )


def up_of(word: str) -> Triple:
    """Return the direction of a word such as ``+z``, ``-y`` or ``x``; InputError otherwise."""
    sign, axis = (word[0], word[1:]) if word[:1] in ("+", "-") else ("+", word)
    if axis.lower() not in ("x", "y", "z"):
        raise InputError(
            "plan.placement",
            f"'{word}' is no axis of the model.",
            "Give the axis that points up: +x, -x, +y, -y, +z or -z.",
        )
    x, y, z = ((-1.0 if sign == "-" else 1.0) * (axis.lower() == one) + 0.0 for one in "xyz")
    return (x, y, z)


def setting_of(request: StepRequest) -> Setting | None:
    """Return probe, cameras and placement of a request; None for the ball alone.

    InputError if a document cannot be used, or no direction points up.
    """
    sizes = (*request.up, *request.offset_world, request.turn_deg, request.tilt_deg)
    if not np.isfinite(sizes).all() or np.linalg.norm(request.up) < 1e-6:
        raise InputError(
            "plan.placement",
            f"The part cannot stand with {request.up} pointing up.",
            "Name an axis of the model, such as +z or -y.",
        )
    if not request.probe:
        return None
    body = load_probe(request.probe)
    design = Path(request.design) if request.design else shipped_design(body)
    return Setting(
        body=body,
        design=None if design is None else load_design(design, body),
        rig=load_rig(request.rig) if request.rig else None,
        placement=Placement(request.up, request.turn_deg, request.offset_world),
        ball_mm=request.ball_mm,
        tilt_deg=request.tilt_deg,
    )

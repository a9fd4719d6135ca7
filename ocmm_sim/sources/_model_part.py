"""Virtual part with the nominal geometry of a plan imported from a CAD model.

Surfaces as drawn, touch points and outward normals on trimmed faces, mid volume.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import platformdirs
from scipy.spatial.transform import Rotation

from ocmm_core.camera import Rig, Vector3
from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation import places_of
from ocmm_core.inspection.plan import Plan, part_of_plan
from ocmm_core.part_model import Placement
from ocmm_core.side_files import has_content
from ocmm_sim.scene import PartDocument, PartPose, TouchedEntry

_AS_MANY = 2
"""Touch points per required point of a feature that lists none."""
_OPEN_MM = 1000.0
_MOST_KEPT = 20
_DECIMALS = 9


def part_as_planned(
    plan: Plan, folder: Path | None, rig: Rig, placement: Placement | None = None
) -> PartDocument:
    """Return the nominal part of a plan.

    `folder`: folder of the plan and its CAD model. The part is centred in the volume by the model
    if present, else by its touch points. `placement`: orientation in the volume; upright if None.
    InputError: a feature has no touch points.
    """
    entries = [_entry(feature) for feature in plan.features]
    model = part_of_plan(plan, folder).model
    places = np.array([place for entry in entries for place in entry.places])
    box = np.stack([places.min(axis=0), places.max(axis=0)]) if model is None else model.box
    volume = np.asarray(rig.volume_world)
    pose = (placement or Placement()).pose(box.mean(axis=0), volume.mean(axis=0))
    return PartDocument(
        schema="ocmm.part/1", unit="mm", name=plan.part, pose=_pose(pose), features=list(entries)
    )


def part_text(part: PartDocument) -> str:
    """Return a part as a TOML document."""
    lines = [f"{field} = {_value(getattr(part, field))}" for field in ("schema", "unit", "name")]
    lines += ["", "[pose]", *_fields(msgspec.to_builtins(part.pose))]
    for entry in part.features:
        lines += ["", "[[features]]", *_fields(msgspec.to_builtins(entry))]
    return "\n".join(lines) + "\n"


def kept_part(plan: Plan, plan_file: Path, rig: Rig) -> Path:
    """Return the part document in the user's cache; InputError as `part_as_planned`."""
    content = part_text(part_as_planned(plan, plan_file.absolute().parent, rig)).encode()
    folder = platformdirs.user_cache_path("ocmm") / "virtual-parts"
    path = folder / f"{hashlib.sha256(content).hexdigest()}.toml"
    if has_content(path, content):
        return path
    try:
        folder.mkdir(parents=True, exist_ok=True)
        write_atomic(path, content)
        older = sorted(folder.glob("*.toml"), key=lambda one: one.stat().st_mtime)
        for old in older[:-_MOST_KEPT]:
            old.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(
            "part.not_kept",
            f"{path}: the virtual part of the plan cannot be written ({error.strerror or error}).",
            "Make room there, or write it with 'ocmm plan part' and measure that part.",
        ) from error
    return path


def _entry(feature: NominalFeature) -> TouchedEntry:
    count = max(_AS_MANY * feature.points, len(feature.targets))
    places = places_of(feature, count)
    if not len(places.points) or not np.linalg.norm(places.normals, axis=1).all():
        raise InputError(
            "part.places",
            f"Feature '{feature.name}' does not say where a virtual part could be touched.",
            "Give its sizes or targets in the plan, or measure the document of a part.",
        )
    spec = feature.shape.spec
    return TouchedEntry(
        name=feature.name,
        point=feature.point,
        direction=feature.direction,
        places=_triples(places.points),
        normals=_triples(places.normals),
        free=_free(feature, places.points),
        true_diameter=feature.diameter,
        true_width=feature.width if spec.has_size("width") else 0.0,
        apex_deg=feature.angle_deg,
    )


def _free(feature: NominalFeature, places: Float) -> float:
    """Return the width of a hollow surface at its narrowest touch point, mm."""
    if feature.side == "outer" or feature.diameter <= 0.0:
        return _OPEN_MM
    if feature.shape is not Shape.CONE:
        return feature.diameter
    axis = np.array(feature.direction) / np.linalg.norm(feature.direction)
    arms = places - np.array(feature.point)
    radii = np.linalg.norm(arms - (arms @ axis)[:, None] * axis, axis=1)
    return 2.0 * float(radii.min())


def _pose(motion: RigidTransform) -> PartPose:
    turn, shift = _triples(
        np.stack([Rotation.from_matrix(motion.rotation).as_rotvec(), motion.translation])
    )
    return PartPose(translation=shift, rotation_vector=turn)


def _triples(rows: Float) -> list[Vector3]:
    return [(x, y, z) for x, y, z in (np.round(rows, _DECIMALS) + 0.0).tolist()]


def _fields(values: dict[str, Any]) -> list[str]:
    return [f"{name} = {_value(value)}" for name, value in values.items()]


def _value(value: object) -> str:
    """Return a text, number or list in TOML syntax, here the same as JSON."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)

"""The plan: features to probe, characteristics that decide over the part, its thermal expansion.

Text, picture and compensation of a step are checked when the plan is loaded.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import Any, Literal

import msgspec
import numpy as np

from ocmm_core.alignment import OLDEST, Alignment, BoundAlignment, alignment_fault, doubt_of
from ocmm_core.calibration.probe_design import MaterialExpansion
from ocmm_core.documents import Document, load_with_text, shortened, stays_inside
from ocmm_core.errors import InputError
from ocmm_core.features import measured
from ocmm_core.features.shapes import (
    MINIMUM_POINTS,
    MOST_POINTS,
    NominalFeature,
    Shape,
    shape_fault,
)
from ocmm_core.inspection.plan._environment import EnvironmentLimits, environment_fault
from ocmm_core.inspection.plan._requirements import PlanSource, Requirement, requirements_fault
from ocmm_core.measuring import Climate, FeatureUncertainty, FrameDoubt, check_part
from ocmm_core.names import label_fault, name_fault, normal_text
from ocmm_core.part_model import model_endings
from ocmm_core.tolerances.kinds import characteristic_fault, involved_features
from ocmm_core.tolerances.zones import Characteristic

LONGEST_TEXT = 500
WITH_TARGETS = (Shape.PLANE, Shape.CYLINDER, Shape.CONE, Shape.SPHERE, Shape.TORUS)
"""Shapes whose surface has a normal at any place."""
WITH_PATHS = (Shape.PLANE, Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER, Shape.CONE)
"""Shapes measured by continuous probing."""
SPACINGS_MM = (0.2, 50.0)
_SCANS = {
    "ring": (Shape.CIRCLE,),
    "spiral": (Shape.CYLINDER, Shape.CONE, Shape.SPHERE),
    "raster": (Shape.PLANE,),
}
MOST_TARGETS = 1000
FARTHEST_MM = 1e6
PICTURES = (".png", ".jpg", ".jpeg", ".svg", ".webp")


def step_fault(feature: NominalFeature, by_plan: str) -> tuple[str, str] | None:
    """Return field and fault of a feature's text, picture or compensation; None if valid."""
    if len(feature.text) > LONGEST_TEXT or not feature.text.replace("\n", " ").isprintable():
        return "text", f"is longer than {LONGEST_TEXT} characters, or contains non-printing ones"
    fault = picture_fault(feature.picture)
    if fault:
        return "picture", fault
    fault = targets_fault(feature)
    if fault:
        return "targets", fault
    fault = spacing_fault(feature)
    if fault:
        return "spacing", fault
    method = feature.compensation or by_plan
    shape = feature.shape.value.lower()
    # The axis of the probe is normal to a face; along a bore it is parallel to the wall.
    if method == "shank" and feature.shape.spec.is_curved:
        return "compensation", (
            f"is 'shank', but the probe axis does not determine the probe side of a {shape}"
        )
    if feature.sheet and feature.shape is Shape.POINT and method != "nominal":
        return "compensation", "must be 'nominal' for a point on the other side of a sheet"
    # A line does not name its face; all other shapes have a normal.
    if method == "nominal" and feature.shape is Shape.LINE:
        return "compensation", f"is 'nominal', but the plan does not say which way a {shape} faces"
    return None


def _only_for(shapes: Iterable[Shape]) -> str:
    words = ", ".join(shape.value.lower() for shape in shapes)
    return f"is only for: {words}"


def spacing_fault(feature: NominalFeature) -> str:
    """Return the fault of the point distance of a feature's paths; empty if none."""
    low, high = SPACINGS_MM
    options = (bool(feature.interval), bool(feature.turn_deg), any(feature.gates))
    if feature.spacing == 0.0:
        given = any(options) or feature.scan
        return "is missing: the options of paths go with it" if given else ""
    allowed = 0.0 <= feature.interval <= 10.0 and 0.0 <= feature.turn_deg <= 90.0
    if sum(options) > 1 or not allowed:
        return "goes with one of: 'interval' to 10 s, 'turn_deg' to 90 degrees, 'gates'"
    if feature.shape not in WITH_PATHS:
        return _only_for(WITH_PATHS)
    if feature.scan:
        if feature.shape not in _SCANS[feature.scan]:
            return f"with the scan {feature.scan!r} {_only_for(_SCANS[feature.scan])}"
        missing = not feature.length or (feature.scan == "raster" and not feature.width)
        if missing and feature.shape not in (Shape.SPHERE, Shape.CIRCLE):
            return "with a scan needs the length of the feature, and the width of a raster"
    if not low <= feature.spacing <= high:
        return f"is {feature.spacing:g}; it is {low:g} to {high:g} mm, or 0 for single touches"
    return ""


def targets_fault(feature: NominalFeature) -> str:
    """Return the fault of a feature's targets; empty if none."""
    if not feature.targets:
        return ""
    if feature.shape not in WITH_TARGETS:
        return _only_for(WITH_TARGETS)
    if len(feature.targets) > MOST_TARGETS:
        return f"has {len(feature.targets)} places; at most {MOST_TARGETS}"
    if not all(abs(value) <= FARTHEST_MM for target in feature.targets for value in target):
        return f"has a place farther away than {FARTHEST_MM:g} mm"
    return ""


def picture_fault(picture: str) -> str:
    """Return the fault of a picture's name; empty if none."""
    return file_fault(picture, "picture", PICTURES) if picture else ""


def file_fault(name: str, what: str, endings: Sequence[str]) -> str:
    """Return the fault of the name of a file next to the plan; empty if none.

    An absolute path or ``..`` would read any file of the computer, on every computer another one.
    """
    if not stays_inside(name):
        return f"is {shortened(name)}, which does not stay beside the plan"
    if PurePosixPath(name).suffix.lower() not in endings:
        return f"is {shortened(name)}; a {what} ends in one of: {', '.join(endings)}"
    return ""


_PPM = 1e-6


def material_expansion(plan: Plan) -> MaterialExpansion | None:
    """Return the expansion of the plan's material; None without material."""
    material = plan.material
    if material is None:
        return None
    return MaterialExpansion(
        material.name, _PPM * material.expansion_ppm, _PPM * material.expansion_sigma_ppm
    )


def climate_for(climate: Climate, before: Plan, plan: Plan) -> Climate:
    """Return the climate of a job after a change of the plan.

    The operator's expansion is kept, the plan's replaced by the new one. InputError if results are
    to be reported at 20 °C, and the plan names no material.
    """
    if climate.part.expansion != material_expansion(before):
        return climate
    part = replace(climate.part, expansion=material_expansion(plan))
    check_part(part)
    return replace(climate, part=part)


SCHEMA = "ocmm.plan/1"
MAX_EXPANSION_PPM = 200.0
"""Upper limit for solids, 1e-6/K."""

_HASH = re.compile(r"[0-9a-f]{64}")


class Material(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Material of the part: its thermal expansion and standard uncertainty, 1e-6/K."""

    name: str
    expansion_ppm: float
    expansion_sigma_ppm: float = 1.0


class CadModel(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The STEP file of the nominals: its place next to the plan, and its hash."""

    file: str
    """Relative to the folder of the plan, and inside it."""
    sha256: str
    """Of the file, or of the names and bytes of all files of an assembly: 64 hex digits."""


class Plan(Document, frozen=True, kw_only=True):
    """A plan as stored; lengths in mm."""

    name: str
    part: str
    features: list[NominalFeature]
    """In the order of probing."""
    characteristics: list[Characteristic]
    """In the order of the report."""
    constructions: list[measured.Construction] = msgspec.field(default_factory=list)
    """In any order."""
    alignment: Alignment | None = None
    """Required by characteristics that are coordinates."""
    rule: Literal["iso14253-1", "ilac-g8", "simple"] = "iso14253-1"
    """Decision rule: ISO 14253-1 (default), ILAC-G8 with the guard band w = U, or simple acceptance
    (`tolerances.decision`)."""
    material: Material | None = None
    """Required for results at 20 °C."""
    compensation: Literal["approach", "pulled", "shank", "nominal"] = "approach"
    """Default detection of the side of the material (`measuring.compensation.METHODS`)."""
    model: CadModel | None = None
    """The CAD model in whose frame the nominals are; shown only, nothing is computed from it."""
    cameras: Literal["proven", "unproven"] = "proven"
    """``"proven"``: data prove their age and order; ``"unproven"``: also others, knowingly."""
    environment: EnvironmentLimits | None = None
    """Ambient limits from the first to the last point; None for none."""
    sources: list[PlanSource] = msgspec.field(default_factory=list)
    requirements: list[Requirement] = msgspec.field(default_factory=list)
    """`sources`, `requirements`: Imported files and their account; empty if made by hand."""

    @classmethod
    def completed(cls, data: dict[str, Any]) -> dict[str, Any]:
        """Return ``data`` in NFC, with the kind of alignment that the first plans omitted."""
        data = normal_text(data)
        alignment = data.get("alignment")
        if isinstance(alignment, dict):
            data = {**data, "alignment": {"type": OLDEST, **alignment}}
        return data

    @property
    def shapes(self) -> dict[str, Shape]:
        """Return the shapes of all features, probed and constructed, by name."""
        return measured.shapes_with(
            {item.name: item.shape for item in self.features}, self.constructions
        )

    @property
    def bound_alignment(self) -> BoundAlignment | None:
        """Return the alignment with the nominals it may need; None without one."""
        if self.alignment is None:
            return None
        nominals = measured.nominal_geometries(self.features, self.constructions)
        return BoundAlignment(self.alignment, self.shapes, nominals)

    @property
    def common_uncertainties(self) -> tuple[FrameDoubt | FeatureUncertainty, ...]:
        """Return the uncertainty of a saved frame, of sheets, and of gauges in threads."""
        # Uniform within the limit, and in a circle of that radius.
        sheets = [one for one in self.features if one.sheet_limit]
        holes = [one for one in self.constructions if isinstance(one, measured.TappedHole)]
        return (
            *filter(None, [doubt_of(self.alignment)]),
            *(FeatureUncertainty(one.name, one.sheet_limit / np.sqrt(3.0)) for one in sheets),
            *(
                FeatureUncertainty(
                    one.features[0], 0.5 * one.play, True, one.features[1], one.engaged
                )
                for one in holes
            ),
        )

    def probed(self, name: str) -> tuple[str, ...]:
        """Return the probed features of a feature, probed or constructed."""
        return measured.probed_features(name, self.constructions)

    def rests_on(self, item: Characteristic, bound: BoundAlignment | None = None) -> list[str]:
        """Return the probed features of a characteristic, also those projected onto.

        ``bound`` is `bound_alignment`, if already computed.
        """
        found: dict[str, None] = {}
        for name in involved_features(item, bound or self.bound_alignment):
            found |= dict.fromkeys(self.probed(name))
        for name in list(found):
            plane = self.feature(name).projection
            found |= dict.fromkeys(self.probed(plane) if plane else ())
        return list(found)

    def feature(self, name: str) -> NominalFeature:
        """Return a feature by name; KeyError if unknown."""
        for feature in self.features:
            if feature.name == name:
                return feature
        raise KeyError(name)


def load_plan(path: Path | str) -> Plan:
    """Return the plan of a document; InputError, with the field, if malformed or unmeasurable."""
    return read_plan(path)[0]


def read_plan(path: Path | str) -> tuple[Plan, str]:
    """Return the plan of a document, and the text it was read from; InputError as `load_plan`."""
    plan, text = load_with_text(path, Plan, SCHEMA)
    check_plan(Path(path), plan)
    return plan, text


def check_plan(path: Path, plan: Plan) -> None:
    """Raise InputError if the plan is unmeasurable."""
    if not plan.features:
        raise _error(path, "features", "is empty: nothing to measure")
    _check_names(path, plan)
    for group in ("features", "characteristics"):
        seen: set[str] = set()
        for index, item in enumerate(getattr(plan, group)):
            if item.name in seen:
                raise _error(path, f"{group}[{index}].name", f"repeats the name {item.name!r}")
            seen.add(item.name)
    probed = {item.name: item.shape for item in plan.features}
    if fault := measured.construction_fault(probed, plan.constructions):
        raise _error(path, *fault)
    for index, feature in enumerate(plan.features):
        _check_feature(path, plan, index, feature)
    _check_characteristics(path, plan)
    if plan.alignment is not None and (fault := alignment_fault(plan.alignment, plan.shapes)):
        raise _error(path, *fault)
    if plan.material is not None:
        _check_material(path, plan.material)
    if plan.environment is not None and (fault := environment_fault(plan.environment)):
        raise _error(path, *fault)
    if fault := requirements_fault(plan):
        raise _error(path, *fault)
    if plan.model is not None:
        if wrong := file_fault(plan.model.file, "CAD model", model_endings()):
            raise _error(path, "model.file", wrong)
        if not _HASH.fullmatch(plan.model.sha256):
            raise _error(path, "model.sha256", "is no SHA-256: 64 digits from 0 to f")


def _check_names(path: Path, plan: Plan) -> None:
    names = [("name", plan.name), ("part", plan.part)]
    names += [(f"features[{i}].name", item.name) for i, item in enumerate(plan.features)]
    names += [(f"constructions[{i}].name", item.name) for i, item in enumerate(plan.constructions)]
    names += [(f"characteristics[{i}].name", c.name) for i, c in enumerate(plan.characteristics)]
    for field, name in names:
        if fault := label_fault(name) if "." not in field else name_fault(name):
            raise _error(path, field, f"is {shortened(name)}, which {fault}")


def _check_feature(path: Path, plan: Plan, index: int, feature: NominalFeature) -> None:
    at = f"features[{index}]"
    minimum, most = MINIMUM_POINTS[feature.shape], MOST_POINTS
    if not minimum <= feature.points <= most:
        shape = feature.shape.value.lower()
        raise _error(
            path, f"{at}.points", f"is {feature.points}; a {shape} needs {minimum} to {most}"
        )
    if sum(value * value for value in feature.direction) < 1e-12:
        raise _error(path, f"{at}.direction", "is a zero vector")
    wrong = shape_fault(feature)
    if wrong is not None:
        raise _error(path, f"{at}.{wrong[0]}", wrong[1])
    fault = step_fault(feature, plan.compensation)
    if fault is not None:
        raise _error(path, f"{at}.{fault[0]}", fault[1])
    if feature.projection:
        _need(path, plan, f"{at}.projection", feature.projection, (Shape.PLANE,))
        if feature.projection in {item.name for item in plan.constructions}:
            raise _error(
                path,
                f"{at}.projection",
                f"names {feature.projection!r}, which is constructed: use a construction to "
                "project the circle onto it",
            )


def _check_characteristics(path: Path, plan: Plan) -> None:
    nominals = measured.nominal_geometries(plan.features, plan.constructions)
    probed = {item.name for item in plan.features}
    for index, item in enumerate(plan.characteristics):
        fault = characteristic_fault(
            item, plan.shapes, nominals, probed, aligned=plan.alignment is not None
        )
        if fault is not None:
            raise _error(path, f"characteristics[{index}].{fault[0]}", fault[1])


def _check_material(path: Path, material: Material) -> None:
    if abs(material.expansion_ppm) > MAX_EXPANSION_PPM:
        raise _error(
            path, "material.expansion_ppm", f"is {material.expansion_ppm:g}; steel has 11.5"
        )
    if not 0.0 <= material.expansion_sigma_ppm <= MAX_EXPANSION_PPM:
        raise _error(path, "material.expansion_sigma_ppm", f"is {material.expansion_sigma_ppm:g}")


def _need(path: Path, plan: Plan, field: str, name: str, shapes: tuple[Shape, ...]) -> None:
    shape = plan.shapes.get(name)
    if shape is None:
        raise _error(path, field, f"names {name!r}, which is not a feature of the plan")
    if shape not in shapes:
        words = ", ".join(shape.value.lower() for shape in shapes)
        raise _error(path, field, f"names {name!r}, but needs one of: {words}")


def _error(path: Path, field: str, fault: str) -> InputError:
    return InputError(
        "plan.field", f"{path}: field '{field}' {fault}.", "Correct that field of the plan."
    )

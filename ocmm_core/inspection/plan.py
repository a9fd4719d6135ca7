"""The plan: which features to probe, and which characteristics decide over the part."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

import msgspec

from ocmm_core.alignment.datums import DatumAlignment
from ocmm_core.documents import Document, load_document
from ocmm_core.errors import InputError
from ocmm_core.features.nominal import NominalFeature
from ocmm_core.features.shapes import MINIMUM_POINTS, Shape
from ocmm_core.tolerances.characteristic import Characteristic

SCHEMA = "ocmm.plan/1"
MAX_EXPANSION_PPM = 200.0
"""No solid grows more for a kelvin."""

NAME_PATTERN = re.compile(r"[A-Za-z0-9_][A-Za-z0-9 _.\-]{0,59}")
"""Names that every export takes as they are: no comma, quote, dollar or leading sign."""


class Material(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What the part is made of: its thermal expansion and standard uncertainty, 1e-6/K."""

    name: str
    expansion_ppm: float
    expansion_sigma_ppm: float = 1.0


class Plan(Document, frozen=True, kw_only=True):
    """A plan as it is written down; lengths in mm.

    Attributes
    ----------
    name, part
        Names of the plan and of the part.
    features
        In the order of probing.
    characteristics
        In the order of the report.
    alignment
        Needed as soon as a characteristic is a coordinate.
    rule
        Decision rule: ISO 14253-1 with a guard band (default), or simple acceptance.
    material
        Needed where results are to be reported at 20 °C.
    """

    name: str
    part: str
    features: list[NominalFeature]
    characteristics: list[Characteristic]
    alignment: DatumAlignment | None = None
    rule: Literal["iso14253-1", "simple"] = "iso14253-1"
    material: Material | None = None

    def feature(self, name: str) -> NominalFeature:
        """Return the feature called ``name``; KeyError if there is none."""
        for feature in self.features:
            if feature.name == name:
                return feature
        raise KeyError(name)


def load_plan(path: Path | str) -> Plan:
    """Return the plan of the document at ``path``.

    Raises
    ------
    InputError
        The document is malformed or asks for something that cannot be measured; the sentence
        names the field.
    """
    plan = load_document(path, Plan, SCHEMA)
    check_plan(Path(path), plan)
    return plan


def check_plan(path: Path, plan: Plan) -> None:
    """Raise InputError if the plan asks for something that cannot be measured."""
    if not plan.features:
        raise _error(path, "features", "is empty: there is nothing to measure")
    names = [("name", plan.name), ("part", plan.part)]
    names += [(f"features[{i}].name", item.name) for i, item in enumerate(plan.features)]
    names += [(f"characteristics[{i}].name", c.name) for i, c in enumerate(plan.characteristics)]
    for field, name in names:
        if not NAME_PATTERN.fullmatch(name):
            raise _error(
                path,
                field,
                f"is {name!r}; a name has 1 to 60 letters, digits, spaces, '_', '.' or '-' "
                "and begins with a letter, a digit or '_'",
            )
    for group in ("features", "characteristics"):
        seen: set[str] = set()
        for index, item in enumerate(getattr(plan, group)):
            if item.name in seen:
                raise _error(path, f"{group}[{index}].name", f"repeats the name {item.name!r}")
            seen.add(item.name)
    for index, feature in enumerate(plan.features):
        _check_feature(path, plan, index, feature)
    for index, characteristic in enumerate(plan.characteristics):
        _check_characteristic(path, plan, index, characteristic)
    if plan.alignment is not None:
        _check_alignment(path, plan, plan.alignment)
    if plan.material is not None:
        _check_material(path, plan.material)


_ROUND = (Shape.CIRCLE, Shape.SPHERE, Shape.CYLINDER)
_CENTRED = (Shape.POINT, Shape.CIRCLE, Shape.SPHERE)


def _check_feature(path: Path, plan: Plan, index: int, feature: NominalFeature) -> None:
    at = f"features[{index}]"
    minimum = MINIMUM_POINTS[feature.shape]
    if not minimum <= feature.points <= 1000:
        raise _error(
            path,
            f"{at}.points",
            f"is {feature.points}; a {feature.shape.value.lower()} needs {minimum} to 1000",
        )
    if sum(value * value for value in feature.direction) < 1e-12:
        raise _error(path, f"{at}.direction", "is a zero vector")
    if (feature.shape in _ROUND) != (feature.diameter > 0.0):
        raise _error(
            path,
            f"{at}.diameter",
            f"is {feature.diameter}; circle, sphere and cylinder have a diameter greater than "
            "zero, other shapes have none",
        )
    if feature.projection:
        if feature.shape is not Shape.CIRCLE:
            raise _error(path, f"{at}.projection", "is only for circles")
        _need(path, plan, f"{at}.projection", feature.projection, (Shape.PLANE,))


def _check_characteristic(
    path: Path, plan: Plan, index: int, characteristic: Characteristic
) -> None:
    at = f"characteristics[{index}]"
    count = 2 if characteristic.kind == "distance" else 1
    if len(characteristic.features) != count:
        raise _error(
            path,
            f"{at}.features",
            f"names {len(characteristic.features)} feature(s); a {characteristic.kind} needs "
            f"{count}",
        )
    wanted = {
        "diameter": _ROUND,
        "distance": (*_CENTRED, Shape.PLANE),
        "coordinate": _CENTRED,
        "form": tuple(Shape),
    }[characteristic.kind]
    for name in characteristic.features:
        _need(path, plan, f"{at}.features", name, wanted)
    if characteristic.upper < characteristic.lower:
        raise _error(path, f"{at}.upper", "is below 'lower'")
    if (characteristic.kind == "coordinate") != (characteristic.axis != ""):
        raise _error(path, f"{at}.axis", "goes with coordinates, and only with them")
    if characteristic.kind == "coordinate" and plan.alignment is None:
        raise _error(path, "alignment", "is missing, but a coordinate needs a part frame")


def _check_alignment(path: Path, plan: Plan, alignment: DatumAlignment) -> None:
    _need(path, plan, "alignment.primary", alignment.primary, (Shape.PLANE,))
    for name in (*alignment.secondary, alignment.origin):
        _need(path, plan, "alignment", name, _CENTRED)
    if alignment.secondary[0] == alignment.secondary[1]:
        raise _error(path, "alignment.secondary", "names one feature twice")


def _check_material(path: Path, material: Material) -> None:
    if abs(material.expansion_ppm) > MAX_EXPANSION_PPM:
        raise _error(
            path, "material.expansion_ppm", f"is {material.expansion_ppm:g}; steel has 11.5"
        )
    if not 0.0 <= material.expansion_sigma_ppm <= MAX_EXPANSION_PPM:
        raise _error(path, "material.expansion_sigma_ppm", f"is {material.expansion_sigma_ppm:g}")


def _need(path: Path, plan: Plan, field: str, name: str, shapes: tuple[Shape, ...]) -> None:
    try:
        feature = plan.feature(name)
    except KeyError:
        raise _error(path, field, f"names {name!r}, which is not a feature of the plan") from None
    if feature.shape not in shapes:
        words = ", ".join(shape.value.lower() for shape in shapes)
        raise _error(path, field, f"names {name!r}, but needs one of: {words}")


def _error(path: Path, field: str, fault: str) -> InputError:
    return InputError(
        "plan.field", f"{path}: field '{field}' {fault}.", "Correct that field of the plan."
    )

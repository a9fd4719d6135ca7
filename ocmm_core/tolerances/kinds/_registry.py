"""Registry of all kinds, extended by a file with entries and a line here.

The characteristics of a plan are checked against the requirements of their kinds.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from types import MappingProxyType

from ocmm_core.errors import InputError, InternalError
from ocmm_core.features.shapes import Shape
from ocmm_core.geometry import Float
from ocmm_core.part_model import face_fault
from ocmm_core.tolerances.kinds import _angle, _distance, _form, _location, _related, _size
from ocmm_core.tolerances.kinds._spec import ALL, Fault, KindSpec, PlannedCharacteristic, Symbol
from ocmm_core.tolerances.zones import AXES, Characteristic


def registered(entries: Iterable[KindSpec]) -> Mapping[str, KindSpec]:
    """Return entries by name, in order; InternalError for duplicate names, or a missing kind."""
    found: dict[str, KindSpec] = {}
    for entry in entries:
        if entry.name in found:
            raise InternalError(
                "kind.twice", f"Two kinds are named {entry.name!r}.", "Rename one of them."
            )
        found[entry.name] = entry
    for entry in found.values():
        for other in entry.stands_for.values():
            if other not in found or found[other].stands_for:
                raise InternalError(
                    "kind.stands_for",
                    f"Kind {entry.name!r} stands for {other!r}, which has no entry of its own.",
                    "Name a kind that stands for no other.",
                )
    return MappingProxyType(found)


KINDS = registered(
    (
        *_size.KINDS,
        *_distance.KINDS,
        *_angle.KINDS,
        *_form.KINDS,
        *_related.ORIENTATIONS,
        *_location.KINDS,
        *_related.PROFILES,
        *_related.RUNOUTS,
    )
)
"""All kinds by name, in the order of the plan editor."""


def spec_of(kind: str) -> KindSpec:
    """Return the entry of a kind; raise InputError if unknown."""
    found = KINDS.get(kind)
    if found is None:
        raise InputError(
            "characteristic.kind",
            f"Unknown kind of characteristic {kind!r}.",
            f"Use one of: {', '.join(KINDS)}.",
        )
    return found


def spec_for(kind: str, shape: Shape | None) -> KindSpec:
    """Return the equivalent entry for a first shape (None: unknown); InputError: unknown kind."""
    entry = spec_of(kind)
    if shape is None or shape not in entry.stands_for:
        return entry
    return spec_of(entry.stands_for[shape])


def symbol_of(kind: str, shape: Shape | None) -> Symbol | None:
    """Return the symbol of a kind for a first feature's shape, or None."""
    entry = spec_for(kind, shape)
    return entry.symbol if shape is None else entry.symbol_of_shape.get(shape, entry.symbol)


_MODIFIED = re.compile(r"(?P<name>.+?)\s*(?:[ⓂⓁ]|\((?:M|L|MMB|LMB|MMC|LMC)\))", re.IGNORECASE)
"""A datum with a material modifier in drawing notation: ``A (M)``, ``A Ⓜ``."""


def characteristic_fault(
    item: Characteristic,
    shapes: Mapping[str, Shape],
    nominals: Mapping[str, Float],
    probed: Collection[str],
    *,
    aligned: bool,
) -> Fault | None:
    """Return field and fault of an impossible characteristic, else None.

    ``shapes``: of all features; ``nominals``: (12,), part frame; ``probed``: names.
    """
    spec = KINDS.get(item.kind)
    if spec is None:
        return "kind", f"is {item.kind!r}; known kinds: {', '.join(KINDS)}"
    asked = PlannedCharacteristic(item, shapes, nominals, probed, aligned)
    fault = _names_fault(asked, spec) or _limits_fault(item, spec)
    if fault is None and item.association:
        fault = spec.association_fault(asked)
    for check in (_axis_fault, _zone_fault, _number_fault, _known_fault, _faces_fault):
        fault = fault or check(asked, spec)
    for own in spec.checks:
        fault = fault or own(asked)
    return fault


def _names_fault(asked: PlannedCharacteristic, spec: KindSpec) -> Fault | None:
    item, shapes = asked.item, asked.shapes
    for field, names, (least, most), wanted in (
        ("features", item.features, spec.features, spec.shapes),
        ("datums", item.datums, spec.datums, spec.datum_shapes),
    ):
        if not least <= len(names) <= most:
            count = f"{least}" if least == most else f"{least} to {most}"
            article = "an" if item.kind[0] in "aeiou" else "a"
            return field, f"names {len(names)} feature(s); {article} {item.kind} needs {count}"
        for place, name in enumerate(names):
            allowed = wanted if field == "features" or place == 0 else ALL
            if name not in shapes:
                meant = _MODIFIED.fullmatch(name) if field == "datums" else None
                if meant and meant["name"] in shapes:
                    return field, (
                        f"asks for {meant['name']!r} with a modifier of material; datums are taken "
                        "regardless of their size. Leave the modifier out: what conforms then "
                        "conforms with it too"
                    )
                return field, f"names {name!r}, which is not a feature of the plan"
            if shapes[name] not in allowed:
                words = ", ".join(shape.value.lower() for shape in allowed)
                return field, f"names {name!r}, but needs one of: {words}"
        if len(set(names)) < len(names):
            return field, "names one feature twice"
    for name in item.datums:
        if name in item.features:
            return "datums", f"names {name!r}, which is toleranced itself"
    return None


def _limits_fault(item: Characteristic, spec: KindSpec) -> Fault | None:
    if spec.one_sided:
        if item.nominal != 0.0:
            return "nominal", f"is {item.nominal:g}; a {item.kind} tolerance has no nominal"
        if item.lower != 0.0:
            return "lower", f"is {item.lower:g}; a {item.kind} tolerance has an upper limit only"
        if not item.upper > 0.0:
            return "upper", f"is {item.upper:g}; a tolerance is greater than zero"
    return ("upper", "is below 'lower'") if item.upper < item.lower else None


def _axis_fault(asked: PlannedCharacteristic, spec: KindSpec) -> Fault | None:
    # For kinds with a choice of zones, the axis orients two planes.
    may = "axis" in spec.takes and (asked.of_planes or not spec.zones)
    if asked.item.axis and not may:
        return "axis", (
            "goes with coordinates, distances and zones of two planes about a centre or an axis, "
            "and only with them"
        )
    return None


def _zone_fault(asked: PlannedCharacteristic, spec: KindSpec) -> Fault | None:
    zone = asked.item.zone
    if not zone:
        return None
    if not spec.zones:
        return "zone", "goes with position and orientation only"
    if asked.first is Shape.PLANE and zone != "planes":
        return "zone", f"is {zone!r}; that of a plane is two planes"
    if zone not in spec.zones or (zone == "sphere" and asked.first in AXES):
        return "zone", f"is {zone!r}, which is for the position of a centre"
    return None


def _number_fault(asked: PlannedCharacteristic, spec: KindSpec) -> Fault | None:
    item = asked.item
    if item.modifier and "modifier" not in spec.takes:
        return "modifier", "goes with the position of a feature that has a size only"
    if bool(item.modifier) != (item.material_size > 0.0):
        return "material_size", (
            f"is {item.material_size:g}; with a modifier it is the limit of size in mm; without "
            "one it is omitted"
        )
    if item.length < 0.0:
        return "length", f"is {item.length:g}"
    if item.length and (asked.first not in AXES or "length" not in spec.takes):
        return "length", "goes with the orientation and place of an axis only"
    if item.offset and "offset" not in spec.takes:
        return "offset", "goes with profiles only"
    if item.at and not ("at" in spec.takes and item.datums):
        return "at", "goes with the diameter of a cone only"
    return None


def _faces_fault(asked: PlannedCharacteristic, spec: KindSpec) -> Fault | None:
    faces = asked.item.faces
    if faces and "faces" not in spec.takes:
        return "faces", "go with profiles only"
    if any(asked.item.cut) and "cut" not in spec.takes:
        return "cut", "goes with the profile of a line only"
    for place, face in enumerate(faces):
        if fault := face_fault(face):
            return f"faces[{place}]", f"is no face of a model: {fault}"
    if faces and not asked.item.datums and not asked.aligned:
        return "faces", "need datums or an alignment, which say where the model is"
    return None


def _known_fault(asked: PlannedCharacteristic, spec: KindSpec) -> Fault | None:
    """Return a fault for missing points or nominals required by the kind."""
    item = asked.item
    flat = spec.probed == "faces" and asked.first is Shape.PLANE
    if spec.probed == "all" or flat:
        for name in item.features:
            if name not in asked.probed:
                return "features", f"names {name!r}, which is constructed and has no surface"
    if spec.datums_make_frame:
        for field, names in (("features", item.features), ("datums", item.datums)):
            for name in names:
                if name not in asked.nominals:
                    return field, f"names {name!r}, of which the nominal place is not known"
    return None

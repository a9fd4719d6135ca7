"""Labels and explanations of a plan's fields in the editor."""

from __future__ import annotations

import re
from collections.abc import Mapping
from enum import Enum

import msgspec

from ocmm_core.tolerances.kinds import KINDS
from ocmm_core.tolerances.zones import Characteristic
from ocmm_gui.kit import later, said_word, tr, tr_all, unit_word

Words = tuple[str, str]

_NAME = (later("Name"), later("Letters, digits, spaces, _ . - /"))
_LIST = later("Names, separated by commas")

_ALL: Mapping[str, Words] = {
    "name": _NAME,
    "features": (later("Features"), _LIST),
    "direction": (later("Direction"), later("Normal or axis, part frame: x y z")),
    "diameter": (later("Diameter, mm"), later("Round shapes only; else 0")),
    "length": (later("Length, mm"), later("Slots and rectangles; others if known, else 0")),
    "towards": (later("Positive side"), later("Feature on the positive side; or empty")),
    "start": (later("Starts from"), later("Initial alignment; or empty")),
    "type": (later("Alignment"), later("How the part frame is found; empty: no alignment")),
    "covariance": (
        later("Covariance"),
        later("Of rotation and translation of the frame, rad and mm"),
    ),
    "simulated": (later("Simulated"), later("Frame measured on a virtual rig")),
    "digest": (later("SHA-256"), later("Hash of the frame document; Shift+F9 imports one")),
}

_ROOM = later("E.g. 19 – 21; empty: no limit")

_OF_TYPE: Mapping[str, Mapping[str, Words]] = {
    "EnvironmentLimits": {
        "temperature_c": (later("Room, °C"), _ROOM),
        "humidity_percent": (later("Humidity, %"), _ROOM),
        "pressure_hpa": (later("Air pressure, hPa"), _ROOM),
    },
    "NominalFeature": {
        "shape": (later("Shape"), later("Features to probe")),
        "points": (later("Points"), later("Number of points")),
        "side": (later("Side"), later("Probe side: outer for shafts and faces, inner for bores")),
        "point": (later("Point, mm"), later("Centre or a point on it, part frame: x y z")),
        "width": (later("Width, mm"), later("Slots, rectangles, tube of a torus; edge: sheet")),
        "angle_deg": (later("Apex angle, °"), later("Cone: full angle; else 0")),
        "across": (later("Along"), later("Direction of the length, part frame: x y z")),
        "criterion": (later("Association"), later("Fit criterion")),
        "projection": (
            later("Projected on"),
            later("Plane of circles and slots, face of an edge; or empty"),
        ),
        "compensation": (later("Probe side by"), later("Empty: as in the plan")),
        "spacing": (
            later("Path points, mm"),
            later("Continuous probing: distance of the points; 0: single touches"),
        ),
        "scan": (later("Scan"), later("Continuous probing: way over the surface; empty: free")),
        "interval": (
            later("Path by time, s"),
            later("Continuous probing: least time between points; else 0"),
        ),
        "turn_deg": (
            later("Path by turn, °"),
            later("Continuous probing: change of direction between points; else 0"),
        ),
        "gates": (
            later("Path by gates"),
            later("Continuous probing: normal of the planes that give points; else 0 0 0"),
        ),
        "sheet": (
            later("Sheet, mm"),
            later("Thickness between the touched side and that of the plan; else 0"),
        ),
        "sheet_limit": (later("Its limit, mm"), later("Largest deviation of the sheet; else 0")),
        "targets": (
            later("Targets, mm"),
            later("Where to touch, from a model; empty: spread over the sizes"),
        ),
        "text": (later("Instruction"), later("Instruction shown at this step")),
        "picture": (later("Picture"), later("Picture file beside the plan; Shift+F7 attaches one")),
        "free": (
            later("Fitted in space"),
            later("Circle fitted in space at once, not plane first"),
        ),
    },
    "Characteristic": {
        "kind": (later("Kind"), later("Toleranced features")),
        "datums": (later("Datums"), later("Names by precedence, with commas; or empty")),
        "nominal": (later("Nominal"), later("mm, or degrees for angles; 0 for zones")),
        "lower": (later("Lower limit"), later("Of the deviation; 0 for zones")),
        "upper": (later("Upper limit"), later("Of the deviation; the tolerance of a zone")),
        "axis": (later("Axis"), later("Of coordinates and distances")),
        "limits": (later("Limits"), later("proposed: not yet set; change or confirm them")),
        "association": (later("Association"), later("Empty: default of the kind")),
        "zone": (later("Zone"), later("Position and orientation; empty: default")),
        "modifier": (later("Modifier"), later("Bonus: departure of the size from its limit")),
        "material_size": (later("Limit size, mm"), later("Limit the modifier refers to; else 0")),
        "length": (later("Length, mm"), later("Toleranced length of an axis; 0: probed length")),
        "offset": (later("Offset, mm"), later("Offset of a profile zone; else 0")),
        "at": (later("At, mm"), later("Cone: height of the diameter; else 0")),
        "cut": (
            later("Section"),
            later("Profile of a line: normal of the plane that cuts the features; else 0 0 0"),
        ),
        "cut_at": (later("Section at, mm"), later("A point of that plane, part frame: x y z")),
        "within": (later("Section width, mm"), later("Largest distance of points from the plane")),
        "faces": (
            later("Faces"),
            later("Of the model, for a profile: what points are held against"),
        ),
    },
    "Plan": {
        "name": (later("Plan"), later("Plan name, used for file names")),
        "part": (later("Part"), later("Name of the part")),
        "rule": (later("Decision rule"), later("Decision rule")),
        "compensation": (later("Probe side by"), later("How the probe side is found")),
        "cameras": (
            later("Cameras"),
            later("unproven: also such that cannot prove the age of their data"),
        ),
        "environment": (later("Room"), _ROOM),
        "material": (later("Material"), later("Needed to report results at 20 °C; or empty")),
    },
    "Material": {
        "name": (later("Its name"), later("Of the material")),
        "expansion_ppm": (later("Expansion"), later("1e-6/K; steel 11.5, aluminium 23.1")),
        "expansion_sigma_ppm": (
            later("Its uncertainty"),
            later("Standard uncertainty, 1e-6/K; handbook value: 1"),
        ),
    },
    "Intersection": {
        "kind": (later("Construction"), later("Constructed features")),
        "features": (
            later("Features"),
            later("Two planes; plane and axis; three planes; two axes"),
        ),
    },
    "Projection": {
        "features": (later("Features"), later("Feature to project; plane or axis to project onto"))
    },
    "Midpoint": {"features": (later("Features"), later("Two points or centres"))},
    "Bisector": {
        "features": (later("Features"), later("Two planes, or two lines or axes")),
        "which": (later("Which"), later("between: midway between two faces; across: square to it")),
    },
    "Symmetry": {"features": (later("Features"), later("Pairs of centres in turn, or two faces"))},
    "Offset": {
        "features": (
            later("Features"),
            later("Feature to move, and direction; one alone: its own"),
        ),
        "distance": (later("Distance, mm"), later("Negative: opposite direction")),
    },
    "FitThrough": {
        "features": (later("Features"), later("Three centres or more; or features with points")),
        "shape": (later("Shape"), later("Of the element")),
        "through": (later("Through"), later("Centres, or all probed points")),
        "plane": (later("Section"), later("Plane near which points count; or empty")),
        "within": (later("Section width, mm"), later("Largest distance of points from the plane")),
    },
    "BoltCircle": {"features": (later("Features"), later("Three holes or more"))},
    "ConeSection": {
        "features": (later("Features"), later("A cone; or a cone and a plane")),
        "diameter": (later("Diameter, mm"), later("Of the gauge circle; 0 with a plane")),
        "distance": (later("Distance, mm"), later("From the plane, along its normal; else 0")),
    },
    "HiddenPoint": {
        "features": (
            later("Features"),
            later("The two balls: the farther first, the nearer second"),
        ),
        "distance": (later("Distance, mm"), later("From the second centre, as certified")),
    },
    "TappedHole": {
        "features": (later("Features"), later("The gauge in the thread; the face of the hole")),
        "play": (later("Play, mm"), later("Largest distance of the axes of gauge and thread")),
        "engaged": (later("Engaged, mm"), later("Length of the gauge in the thread; 0: no tilt")),
    },
    "PartOf": {
        "features": (later("Feature"), later("One")),
        "part": (later("Part"), later("Surface, axis, centre; middle of a line")),
    },
    "DatumAlignment": {
        "primary": (later("Primary"), later("Plane whose normal, or axis, is z of the part")),
        "secondary": (
            later("Secondary"),
            later("Two centres separated by a comma, or one line: x"),
        ),
        "origin": (later("Origin"), later("Feature whose centre is the origin")),
        "primary_axis": (later("Primary gives"), later("Axis of the part")),
        "secondary_axis": (later("Secondary gives"), later("Axis of the part")),
    },
    "PlaneAxisPoint": {
        "plane": (later("Plane"), later("Aligned to its nominal first")),
        "axis": (later("Axis"), later("Second: line, axis or normal")),
        "point": (later("Point"), later("Third: a centre")),
    },
    "DatumReferenceFrame": {
        "datums": (later("Datums"), later("One to three, in order of precedence"))
    },
    "BestFit": {
        "points": (later("Points"), later("Three or more features with centres")),
        "weights": (later("Weights"), later("One number per point; empty: equal weights")),
        "locked": (later("Locked"), later("Of x, y, z, rx, ry, rz, separated by commas")),
    },
    "ModelBestFit": {
        "points": (later("Points"), later("Seven or more single points on the faces")),
        "faces": (later("Faces"), later("Of the model; they come with an import")),
    },
    "ReferencePoints": {
        "conditions": (
            later("Six conditions"),
            later("One per line: feature, then direction x y z"),
        )
    },
    "SavedFrame": {
        "rotation": (later("Rotation"), later("From the world to the frame, row by row")),
        "translation": (later("Translation, mm"), later("In the frame")),
    },
    "Relocation": {
        "control": (later("Control points"), later("Feature and its position in the frame, mm")),
        "limit": (later("Limit, mm"), later("A control point off by more than this has moved")),
    },
}


_UNIT = re.compile(r"\bmm\b")


class FieldUnit(Enum):
    """Kind of a field's numbers."""

    NONE = "no lengths"
    LENGTH = "lengths"
    BY_KIND = "lengths, or degrees for an angle"


def words_of(struct: type[msgspec.Struct], field: str) -> Words:
    """Return label and explanation of a field; KeyError if missing."""
    own = _OF_TYPE.get(struct.__name__, {})
    label, tip = tr_all(own[field] if field in own else _ALL[field])
    if measure_of(struct, field) is FieldUnit.NONE or "digest" in struct.__struct_fields__:
        return label, tip
    # The unit is at the end of the label, or in the explanation.
    return _UNIT.sub(unit_word(), label), _UNIT.sub(unit_word(), tip)


def measure_of(struct: type[msgspec.Struct], field: str) -> FieldUnit:
    own = _OF_TYPE.get(struct.__name__, {})
    label, tip = own[field] if field in own else _ALL[field]
    if struct is Characteristic and field in ("nominal", "lower", "upper"):
        return FieldUnit.BY_KIND
    is_length = label.endswith(", mm") or tip.endswith(", mm")
    return FieldUnit.LENGTH if is_length else FieldUnit.NONE


def choices_of(struct: type[msgspec.Struct], field: str) -> tuple[str, ...]:
    """Return the possible words of a text field; empty for free text."""
    return tuple(KINDS) if (struct, field) == (Characteristic, "kind") else ()


_OWN_WORDS = frozenset(
    (
        later("outer"), later("inner"), later("approach"), later("pulled"), later("shank"),
        later("nominal"), later("proven"), later("unproven"), later("between"), later("centres"),
        later("all"), later("middle"), later("planes"), later("intersection"), later("projection"),
        later("midpoint"), later("bisector"), later("offset"), later("plane-axis-point"),
        later("given"), later("yes"), later("no"), later("set"), later("proposed"),
        later("ring"), later("spiral"), later("raster"),
    )
)  # fmt: skip
"""Words of a plan that the core does not translate."""


def choice_word(word: str) -> str:
    """Return the displayed word; the plan has the English one."""
    return tr(word) if word in _OWN_WORDS else said_word(word)

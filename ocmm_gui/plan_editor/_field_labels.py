"""What the fields of a plan are called in the forms of the editor, and what is said about them."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from ocmm_core.tolerances.kinds import KINDS
from ocmm_core.tolerances.zones import Characteristic

Words = tuple[str, str]
"""Label and explanation."""

_NAME = ("Name", "Letters, digits, spaces, _ . -")
_LIST = "Names, separated by commas"

_ALL: Mapping[str, Words] = {
    "name": _NAME,
    "features": ("Features", _LIST),
    "direction": ("Direction", "Normal or axis, part frame: x y z"),
    "diameter": ("Diameter, mm", "Round shapes only; else 0"),
    "length": ("Length, mm", "Slots and rectangles; others if known, else 0"),
    "towards": ("Positive side", "Feature on the positive side; or empty"),
    "start": ("Starts from", "Initial alignment; or empty"),
    "type": ("Alignment", "How the part frame is found; empty: no alignment"),
    "covariance": ("Covariance", "Of rotation and translation of the frame, rad and mm"),
    "simulated": ("Simulated", "Frame measured on a virtual rig"),
    "digest": ("SHA-256", "Hash of the frame document; F12 imports one"),
}

_OF_TYPE: Mapping[str, Mapping[str, Words]] = {
    "NominalFeature": {
        "shape": ("Shape", "Features to probe"),
        "points": ("Points", "Number of points"),
        "side": ("Side", "Probe side: outer for shafts and faces, inner for bores"),
        "point": ("Point, mm", "Centre or a point on it, part frame: x y z"),
        "width": ("Width, mm", "Slots and rectangles, tube of a torus; else 0"),
        "angle_deg": ("Apex angle, °", "Cone: full angle; else 0"),
        "across": ("Along", "Direction of the length, part frame: x y z"),
        "criterion": ("Association", "Fit criterion"),
        "projection": ("Projected on", "Projection plane of circles and slots; or empty"),
        "compensation": ("Probe side by", "Empty: as in the plan"),
        "text": ("Instruction", "Instruction shown at this step"),
        "picture": ("Picture", "Picture file beside the plan; Shift+F7 attaches one"),
        "free": ("Fitted in space", "Circle fitted in space at once, not plane first"),
    },
    "Characteristic": {
        "kind": ("Kind", "Toleranced features"),
        "datums": ("Datums", "Names in order of precedence, separated by commas; or empty"),
        "nominal": ("Nominal", "mm, or degrees for angles; 0 for zones"),
        "lower": ("Lower limit", "Of the deviation; 0 for zones"),
        "upper": ("Upper limit", "Of the deviation; the tolerance of a zone"),
        "axis": ("Axis", "Of coordinates and distances"),
        "association": ("Association", "Empty: default of the kind"),
        "zone": ("Zone", "Position and orientation; empty: default"),
        "modifier": ("Modifier", "Bonus: departure of the size from its limit"),
        "material_size": ("Limit size, mm", "Limit the modifier refers to; else 0"),
        "length": ("Length, mm", "Toleranced length of an axis; 0: probed length"),
        "offset": ("Offset, mm", "Offset of a profile zone; else 0"),
        "at": ("At, mm", "Cone: height of the diameter; else 0"),
    },
    "Plan": {
        "name": ("Plan", "Plan name, used for file names"),
        "part": ("Part", "Name of the part"),
        "rule": ("Decision rule", "Decision rule"),
        "compensation": ("Probe side by", "How the probe side is found"),
        "material": ("Material", "Needed to report results at 20 °C; or empty"),
    },
    "Material": {
        "name": ("Its name", "Of the material"),
        "expansion_ppm": ("Expansion", "1e-6/K; steel 11.5, aluminium 23.1"),
        "expansion_sigma_ppm": (
            "Its uncertainty",
            "Standard uncertainty, 1e-6/K; handbook value: 1",
        ),
    },
    "Intersection": {
        "kind": ("Construction", "Constructed features"),
        "features": ("Features", "Two planes; plane and axis; three planes; two axes"),
    },
    "Projection": {"features": ("Features", "Feature to project; plane or axis to project onto")},
    "Midpoint": {"features": ("Features", "Two points or centres")},
    "Bisector": {
        "features": ("Features", "Two planes, or two lines or axes"),
        "which": ("Which", "between: midway between two faces; across: square to it"),
    },
    "Symmetry": {"features": ("Features", "Pairs of centres in turn, or two faces")},
    "Offset": {
        "features": ("Features", "Feature to move, and direction; one alone: its own"),
        "distance": ("Distance, mm", "Negative: opposite direction"),
    },
    "FitThrough": {
        "features": ("Features", "Three centres or more; or features with points"),
        "shape": ("Shape", "Of the element"),
        "through": ("Through", "Centres, or all probed points"),
    },
    "BoltCircle": {"features": ("Features", "Three holes or more")},
    "ConeSection": {
        "features": ("Features", "A cone; or a cone and a plane"),
        "diameter": ("Diameter, mm", "Of the gauge circle; 0 with a plane"),
        "distance": ("Distance, mm", "From the plane, along its normal; else 0"),
    },
    "HiddenPoint": {
        "features": ("Features", "The two balls: the farther first, the nearer second"),
        "distance": ("Distance, mm", "From the second centre, as certified"),
    },
    "PartOf": {
        "features": ("Feature", "One"),
        "part": ("Part", "Surface, axis or centre"),
    },
    "DatumAlignment": {
        "primary": ("Primary", "Plane whose normal, or axis, is z of the part"),
        "secondary": ("Secondary", "Two centres separated by a comma, or one line: x"),
        "origin": ("Origin", "Feature whose centre is the origin"),
        "primary_axis": ("Primary gives", "Axis of the part"),
        "secondary_axis": ("Secondary gives", "Axis of the part"),
    },
    "PlaneAxisPoint": {
        "plane": ("Plane", "Aligned to its nominal first"),
        "axis": ("Axis", "Second: line, axis or normal"),
        "point": ("Point", "Third: a centre"),
    },
    "DatumReferenceFrame": {"datums": ("Datums", "One to three, in order of precedence")},
    "BestFit": {
        "points": ("Points", "Three or more features with centres"),
        "weights": ("Weights", "One number per point; empty: equal weights"),
        "locked": ("Locked", "Of x, y, z, rx, ry, rz, separated by commas"),
    },
    "ReferencePoints": {
        "conditions": ("Six conditions", "One per line: feature, then direction x y z"),
    },
    "SavedFrame": {
        "rotation": ("Rotation", "From the world to the frame, row by row"),
        "translation": ("Translation, mm", "In the frame"),
    },
    "Relocation": {
        "control": ("Control points", "Feature and its position in the frame, mm"),
        "limit": ("Limit, mm", "A control point off by more than this has moved"),
    },
}


def words_of(struct: type[msgspec.Struct], field: str) -> Words:
    """Return label and explanation of a field; KeyError where nobody wrote them."""
    own = _OF_TYPE.get(struct.__name__, {})
    return own[field] if field in own else _ALL[field]


def choices_of(struct: type[msgspec.Struct], field: str) -> tuple[str, ...]:
    """Return the words that are possible in a text field; none where every text is."""
    return tuple(KINDS) if (struct, field) == (Characteristic, "kind") else ()

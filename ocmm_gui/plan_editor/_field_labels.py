"""What the fields of a plan are called in the forms of the editor, and what is said about them."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from ocmm_core.tolerances.kinds import KINDS
from ocmm_core.tolerances.zones import Characteristic

Words = tuple[str, str]
"""Label and explanation."""

_NAME = ("Name", "Letters, digits, spaces, _ . -")
_LIST = "Names with commas between them"

_ALL: Mapping[str, Words] = {
    "name": _NAME,
    "features": ("Features", _LIST),
    "direction": ("Direction", "Normal or axis, part frame: x y z"),
    "diameter": ("Diameter, mm", "Of round shapes; else 0"),
    "length": ("Length, mm", "Of slots and rectangles; of others where known, else 0"),
    "towards": ("Positive side", "Feature at the side that counts as positive; or empty"),
    "start": ("Begins with", "Alignment that comes first; or empty"),
    "type": ("Alignment", "How it is found where the part is; empty: it is not"),
    "covariance": ("Covariance", "Of a turn and a shift of the frame, rad and mm"),
    "simulated": ("Simulated", "The frame was measured on a virtual rig"),
    "digest": ("SHA-256", "Of the document of the frame; F12 imports one"),
}

_OF_TYPE: Mapping[str, Mapping[str, Words]] = {
    "NominalFeature": {
        "shape": ("Shape", "What is probed"),
        "points": ("Points", "Touches to take"),
        "side": ("Side", "Where the probe stands: outer for shafts and faces, inner for bores"),
        "point": ("Point, mm", "Centre or a point on it, part frame: x y z"),
        "width": ("Width, mm", "Of slots and rectangles, tube of a torus; else 0"),
        "angle_deg": ("Apex angle, °", "Full angle of a cone; else 0"),
        "across": ("Along", "Direction of the length, part frame: x y z"),
        "criterion": ("Association", "How the element is found from its points"),
        "projection": ("Projected on", "Name of a plane; for circles and slots, or empty"),
        "compensation": ("Side found by", "Empty: as the plan says"),
        "text": ("Instruction", "What the inspector reads at this step"),
        "picture": ("Picture", "File beside the plan that he sees; Shift+F7 attaches one"),
        "free": ("Fitted in space", "A circle fitted as one problem instead of its plane first"),
    },
    "Characteristic": {
        "kind": ("Kind", "What is toleranced"),
        "datums": ("Datums", "Names in their precedence, with commas between them; or empty"),
        "nominal": ("Nominal", "mm, or degrees for angles; 0 for zones"),
        "lower": ("Lower limit", "Of the deviation; 0 for zones"),
        "upper": ("Upper limit", "Of the deviation; the tolerance of a zone"),
        "axis": ("Axis", "Of coordinates and distances"),
        "association": ("Association", "Empty: what is usual for the kind"),
        "zone": ("Zone", "Of position and orientation; empty: what is usual"),
        "modifier": ("Modifier", "Widens a position by what the size is off its limit"),
        "material_size": ("Limit size, mm", "That the modifier counts from; else 0"),
        "length": ("Length, mm", "Toleranced length of an axis; 0: what was probed"),
        "offset": ("Offset, mm", "Of a profile's zone; else 0"),
        "at": ("At, mm", "Height of the diameter of a cone; else 0"),
    },
    "Plan": {
        "name": ("Plan", "Its name; files are called after it"),
        "part": ("Part", "Name of the part"),
        "rule": ("Decision rule", "How verdicts are made"),
        "compensation": ("Side found by", "How the side of the material is found"),
        "material": ("Material", "Needed where results are reported at 20 °C; or empty"),
    },
    "Material": {
        "name": ("Its name", "Of the material"),
        "expansion_ppm": ("Expansion", "1e-6/K; steel 11.5, aluminium 23.1"),
        "expansion_sigma_ppm": ("Its uncertainty", "Standard, 1e-6/K; 1 from a handbook"),
    },
    "Intersection": {
        "kind": ("Construction", "What is made of the features"),
        "features": ("Features", "Two planes; plane and axis; three planes; two axes"),
    },
    "Projection": {"features": ("Features", "What is dropped, onto which plane or axis")},
    "Midpoint": {"features": ("Features", "Two points or centres")},
    "Bisector": {
        "features": ("Features", "Two planes, or two lines or axes"),
        "which": ("Which", "between: the middle of two faces; across: square to it"),
    },
    "Symmetry": {"features": ("Features", "Pairs of centres in turn, or two faces")},
    "Offset": {
        "features": ("Features", "What is moved, and along what; one alone by itself"),
        "distance": ("Distance, mm", "Negative the other way"),
    },
    "FitThrough": {
        "features": ("Features", "Three centres or more; or features with points"),
        "shape": ("Shape", "Of the element"),
        "through": ("Through", "The centres, or all touched points"),
    },
    "BoltCircle": {"features": ("Features", "Three holes or more")},
    "ConeSection": {
        "features": ("Features", "A cone; or a cone and a plane"),
        "diameter": ("Diameter, mm", "Of the gauge circle; 0 with a plane"),
        "distance": ("Distance, mm", "From the plane, along its normal; else 0"),
    },
    "HiddenPoint": {
        "features": ("Features", "The two balls: farther first, nearer to the point second"),
        "distance": ("Distance, mm", "From the second centre, as certified"),
    },
    "PartOf": {
        "features": ("Feature", "One"),
        "part": ("Part", "All of it, its axis, or its centre"),
    },
    "DatumAlignment": {
        "primary": ("Primary", "Plane whose normal, or axis, is z of the part"),
        "secondary": ("Secondary", "Two centres, or one line, with a comma between them: x"),
        "origin": ("Origin", "Feature whose centre it is"),
        "primary_axis": ("Primary gives", "Axis of the part"),
        "secondary_axis": ("Secondary gives", "Axis of the part"),
    },
    "PlaneAxisPoint": {
        "plane": ("Plane", "Brought to its nominal place first"),
        "axis": ("Axis", "Second: line, axis or normal"),
        "point": ("Point", "Third: a centre"),
    },
    "DatumReferenceFrame": {"datums": ("Datums", "One to three in their precedence")},
    "BestFit": {
        "points": ("Points", "Three features with centres, or more"),
        "weights": ("Weights", "One number for each point; empty: all alike"),
        "locked": ("Locked", "Of x, y, z, rx, ry, rz, with commas between them"),
    },
    "ReferencePoints": {
        "conditions": ("Six conditions", "A line each: feature, then direction x y z"),
    },
    "SavedFrame": {
        "rotation": ("Rotation", "From the world to the frame, row by row"),
        "translation": ("Translation, mm", "In the frame"),
    },
    "Relocation": {
        "control": ("Control points", "Feature and its place in the frame, mm"),
        "limit": ("Limit, mm", "A control point that is farther off was moved"),
    },
}


def words_of(struct: type[msgspec.Struct], field: str) -> Words:
    """Return label and explanation of a field; KeyError where nobody wrote them."""
    own = _OF_TYPE.get(struct.__name__, {})
    return own[field] if field in own else _ALL[field]


def choices_of(struct: type[msgspec.Struct], field: str) -> tuple[str, ...]:
    """Return the words that are possible in a text field; none where every text is."""
    return tuple(KINDS) if (struct, field) == (Characteristic, "kind") else ()

"""Sections of the points of a job: a plane, the points near it, as CSV, DXF (R12) and STEP.

In: a report and planes in part coordinates. Out: files that have been read back. Section
coordinates start at the point of the plane. Their first axis is the part's x axis in the plane (its
y axis if the normal is nearly x), the second is square to it and to the normal.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ocmm_cad.point_files import DensePoints, accepted_points, head_lines
from ocmm_core.alignment import nominal_frame
from ocmm_core.errors import InputError, MeasuringError, StorageError
from ocmm_core.export import report
from ocmm_core.features.elements import nominal_distances
from ocmm_core.features.shapes import Shape, nominal_geometry
from ocmm_core.geometry import Float, Int, unit
from ocmm_core.names import ascii_text

_COLUMNS = (
    "Curve", "Number", "Feature", "S", "T", "Offset", "X", "Y", "Z", "Deviation", "U", "Unit",
    "Section", "JobState",
)  # fmt: skip
_SHAPE = report.TableProfile(header=True, columns=list(_COLUMNS))
_GAP = 5.0
"""Of the usual distance along the path: a new curve starts beyond it."""
_NEARLY = 0.9
_LARGEST = 1e6
_SHARE = 0.1
"""Of the size of the section: largest deviation as drawn."""
OF_PLAN = "plan"
"""In place of a section: all sections of the plan."""
_STEP_PRODUCT = (
    "APPLICATION_CONTEXT('configuration controlled 3d designs of mechanical parts and assemblies')",
    "APPLICATION_PROTOCOL_DEFINITION('international standard','config_control_design',1994,#1)",
    "MECHANICAL_CONTEXT('',#1,'mechanical')",
    "PRODUCT('{name}','{name}','',(#3))",
    "PRODUCT_DEFINITION_FORMATION_WITH_SPECIFIED_SOURCE('','',#4,.NOT_KNOWN.)",
    "DESIGN_CONTEXT('',#1,'design')",
    "PRODUCT_DEFINITION('','',#5,#6)",
    "PRODUCT_DEFINITION_SHAPE('','',#7)",
    "(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))",
    "(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))",
    "(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())",
    "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-06),#9,'distance_accuracy_value','')",
    "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#12))"
    "GLOBAL_UNIT_ASSIGNED_CONTEXT((#9,#10,#11))REPRESENTATION_CONTEXT('',''))",
)
"""Head of a STEP file of curves; #13 is the context of the geometry."""
_COLOURS = {"NOMINAL": 3, "MEASURED": 7, "DEVIATION": 1}


@dataclass(frozen=True, slots=True)
class SectionPlane:
    """A plane in part coordinates, and the distance within which points belong to it."""

    text: str
    """As given."""
    point: Float
    """(3,), mm."""
    axes: Float
    """(3, 3), unit, rows: both section axes, and the normal."""
    within: float
    """mm."""

    @classmethod
    def of_text(cls, text: str) -> SectionPlane:
        """Return the section of ``x,y,z;nx,ny,nz;distance``, mm; InputError."""
        try:
            parts = [[float(number) for number in part.split(",")] for part in text.split(";")]
        except ValueError:
            parts = []
        numbers = [number for part in parts for number in part]
        if (
            [len(part) for part in parts] != [3, 3, 1]
            or not all(abs(number) < _LARGEST for number in numbers)
            or not (numbers[6] > 0.0 and math.hypot(*numbers[3:6]) > 1e-6)
        ):
            raise InputError(
                "section.text",
                f"--section {text!r} is not a point, a normal and a distance above 0.",
                'Give "x,y,z;nx,ny,nz;distance" in part coordinates and mm, such as '
                '"0,0,10;0,0,1;0.5".',
            )
        return cls.of_plane(text, np.array(parts[0]), np.array(parts[1]), numbers[6])

    @classmethod
    def of_plane(cls, text: str, point: Float, normal: Float, within: float) -> SectionPlane:
        """Return the section at a plane by its point (3,), mm, and normal (3,)."""
        across = unit(normal)
        first = np.eye(3)[0 if abs(across[0]) < _NEARLY else 1]
        first = unit(first - (first @ across) * across)
        return cls(text, point, np.array([first, np.cross(across, first), across]), within)

    @property
    def words(self) -> str:
        """Return the plane in words, which no spreadsheet computes and no delimiter splits."""
        point, normal = (" ".join(f"{one:g}" for one in v) for v in (self.point, self.axes[2]))
        return f"point {point} mm normal {normal} within {self.within:g} mm"


@dataclass(frozen=True, slots=True)
class SectionPoints:
    """N points of a section."""

    points: DensePoints
    curves: Int
    """(N,): number of the curve, from 1; consecutive."""
    flat: Float
    """(N, 3), mm: section coordinates, and height above the plane."""
    deviations: Float
    """(N,), mm: from the nominal surface, positive outside the material; NaN if unknown."""
    outward: Float
    """(N, 2): normal of the nominal surface in section coordinates, shorter if it is inclined."""


def sections_of(
    data: report.ReportData, given: Sequence[SectionPlane], *, of_plan: bool
) -> list[SectionPlane]:
    """Return given sections and, on demand, those of the job's plan; InputError without any."""
    bound, found = data.plan.bound_alignment, list(given)
    if of_plan and bound is not None:
        T_part_from_nominal = nominal_frame(bound)
        found += [
            SectionPlane.of_plane(
                item.name, T_part_from_nominal.apply(np.array(item.cut_at)),
                T_part_from_nominal.rotation @ np.array(item.cut), item.within,
            )
            for item in data.plan.characteristics
            if any(item.cut)
        ]  # fmt: skip
    if of_plan and len(found) == len(given):
        raise InputError(
            "section.plan",
            f"The plan of job {data.job} has no section, or no alignment.",
            "Give the profile of a line a 'cut' in the plan, or state the plane.",
        )
    return found


def cut(
    data: report.ReportData, section: SectionPlane, every: DensePoints | None = None
) -> SectionPoints:
    """Return the accepted surface points near a plane, along their paths.

    ``every``: all accepted points, if computed before. MeasuringError: the job has no alignment, or
    no point is near the plane.
    """
    if data.T_part_from_world is None:
        raise MeasuringError(
            "section.frame",
            f"Job {data.job} has no alignment, but a section is in part coordinates.",
            "Add an alignment to the plan and measure its datums.",
        )
    every = accepted_points(data) if every is None else every
    heights = (every.places - section.point) @ section.axes[2]
    rows = np.flatnonzero((np.abs(heights) <= section.within) & ~every.are_centres)
    if not len(rows):
        raise MeasuringError(
            "section.empty",
            f"No accepted point of job {data.job} is within {section.within:g} mm of section "
            f"{section.text!r}.",
            "Give a larger distance, or check point and normal (part coordinates, mm).",
        )
    points = every.chosen(rows)
    deviations, outward = _deviations(data, points)
    return SectionPoints(
        points, _curves(data, every, points), (points.places - section.point) @ section.axes.T,
        deviations, outward @ section.axes[:2].T,
    )  # fmt: skip


def _curves(data: report.ReportData, every: DensePoints, points: DensePoints) -> Int:
    """Return the number of the curve of each point: a path that leaves the plane is cut."""
    limits = {}
    for feature in data.features:
        own = every.places[[name == feature.name for name in every.features]]
        steps = np.linalg.norm(np.diff(own, axis=0), axis=1)
        is_path = feature.seen.spacing > 0.0 and len(steps)
        limits[feature.name] = _GAP * float(np.median(steps)) if is_path else math.inf
    names, steps = points.features, np.linalg.norm(np.diff(points.places, axis=0), axis=1)
    starts = [
        name != before or step > limits[name]
        for before, name, step in zip(names[:-1], names[1:], steps.tolist(), strict=True)
    ]
    return np.cumsum([1, *starts], dtype=np.int64)


def _deviations(data: report.ReportData, points: DensePoints) -> tuple[Float, Float]:
    """Return deviations (n,), mm, from the nominals, and outward nominal normals (n, 3), part."""
    deviations = np.full(len(points.features), np.nan)
    outward = np.zeros((len(points.features), 3))
    bound = data.plan.bound_alignment
    for nominal in (one.nominal for one in data.features if one.nominal_element is not None):
        # The direction of a line is not the normal of its face.
        if bound is None or nominal is None or nominal.shape is Shape.LINE:
            continue
        T_nominal_from_part = nominal_frame(bound).inverse()
        rows = np.flatnonzero([name == nominal.name for name in points.features])
        places = T_nominal_from_part.apply(points.places[rows])
        distances, normals = nominal_distances(nominal.shape, nominal_geometry(nominal), places)
        normals = normals @ T_nominal_from_part.rotation
        # From the material to the probe, on the inside of a bore also.
        inside = np.einsum("ni,ni->n", normals, points.normals[rows]) < 0.0
        deviations[rows] = np.where(inside, -distances, distances)
        outward[rows] = np.where(inside[:, None], -normals, normals)
    return deviations, outward


def section_tables(
    data: report.ReportData, sections: Sequence[SectionPlane], units: report.Units
) -> list[report.ReportTable]:
    """Return the points of sections; errors as `cut`."""
    every = accepted_points(data) if sections else None
    return [_table(data, one, cut(data, one, every), units) for one in sections]


def _table(
    data: report.ReportData, section: SectionPlane, found: SectionPoints, units: report.Units
) -> report.ReportTable:
    points = found.points
    rows = [
        (
            curve, number, name, *units.place(name, flat), *units.place(name, place),
            *(units.length(name, None if math.isnan(one) else one) for one in (deviation, u)),
            units.lengths, section.words, data.state_words,
        )
        for curve, number, name, flat, place, deviation, u in zip(
            found.curves.tolist(), points.numbers.tolist(), points.features, found.flat,
            points.places, found.deviations.tolist(), points.uncertainties.tolist(), strict=True,
        )
    ]  # fmt: skip
    return report.ReportTable(f"Section {section.text}", _COLUMNS, tuple(rows))


def section_files(
    data: report.ReportData, sections: Sequence[SectionPlane], profile: report.Profile
) -> dict[str, bytes]:
    """Return the files of sections by name, read back; MeasuringError as `cut`, StorageError."""
    files: dict[str, bytes] = {}
    every = accepted_points(data) if sections else None
    for index, section in enumerate(sections, start=1):
        name = f"{data.stem}_section{index}"
        found = cut(data, section, every)
        table = _table(data, section, found, profile.units)
        content = files[f"{name}.csv"] = report.delimited(table, profile, _SHAPE)
        drawing = files[f"{name}.dxf"] = _dxf(data, section, found, profile.units)
        curves = files[f"{name}.stp"] = _step(data, section, found)
        places = np.array(re.findall(rb"CARTESIAN_POINT\('',\(([^,]+),([^,]+),([^,]+)\)\)", curves))
        wanted = found.flat[:, :2] * profile.units.scaled(1.0)
        read = _points_of(drawing)
        if (
            report.compare_delimited(name, content, table, profile, _SHAPE)
            or read.shape != wanted.shape
            or not np.allclose(read, wanted, rtol=0.0, atol=1e-6)
            or not np.allclose(places.astype(np.float64), found.points.places, rtol=0.0, atol=1e-6)
        ):
            raise StorageError(
                "section.differs",
                f"Section {section.text!r} was read back and differs from job {data.job}.",
                "Nothing was written. Send the job file to the maintainers of this program.",
            )
    return files


def _dxf(
    data: report.ReportData, section: SectionPlane, found: SectionPoints, units: report.Units
) -> bytes:
    """Return the drawing; R12 has no units in its header, so that they are a text."""
    factor = units.scaled(1.0)
    flat, known = found.flat[:, :2] * factor, np.isfinite(found.deviations)
    size = max(float(np.ptp(flat, axis=0).max()), 1e-3)
    off = np.where(known, found.deviations, 0.0)[:, None] * found.outward * factor
    scale = _scale(size, float(np.abs(off).max()))
    nominal = flat - off
    pairs: list[tuple[int, object]] = [
        (0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (0, "ENDSEC"),
        (0, "SECTION"), (2, "TABLES"), (0, "TABLE"), (2, "LAYER"), (70, len(_COLOURS)),
    ]  # fmt: skip
    for layer, colour in _COLOURS.items():
        pairs += [(0, "LAYER"), (2, layer), (70, 0), (62, colour), (6, "CONTINUOUS")]
    pairs += [(0, "ENDTAB"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES")]
    for curve in range(1, int(found.curves[-1]) + 1):
        own = found.curves == curve
        pairs += _polyline("MEASURED", flat[own])
        pairs += _polyline("NOMINAL", nominal[own & known])
        pairs += _polyline("DEVIATION", nominal[own & known] + scale * off[own & known])
    for place in flat:
        pairs += [(0, "POINT"), (8, "MEASURED"), *_place(place)]
    texts = [*head_lines(data, units), f"section: {section.words}", f"deviation x {scale:g}"]
    height = 0.02 * size
    for line, text in enumerate(texts, start=2):
        place = flat.min(axis=0) - [0.0, 2.0 * line * height]
        layer = "DEVIATION" if line == len(texts) + 1 else "MEASURED"
        pairs += [(0, "TEXT"), (8, layer), *_place(place), (40, f"{height:.6f}"), (1, text)]
    pairs += [(0, "ENDSEC"), (0, "EOF")]
    return "".join(f"{code:3d}\r\n{value}\r\n" for code, value in pairs).encode("ascii")


def _step(data: report.ReportData, section: SectionPlane, found: SectionPoints) -> bytes:
    """Return the measured curves as polylines in part coordinates, mm (AP203, wireframe)."""
    name = ascii_text(f"{data.stem} {section.text}").replace("'", " ")
    rows = [row.format(name=name) for row in _STEP_PRODUCT]
    curves = []
    for curve in range(1, int(found.curves[-1]) + 1):
        own = found.points.places[found.curves == curve].tolist()
        ends = [f"#{len(rows) + 1 + number}" for number in range(len(own))]
        rows += [f"CARTESIAN_POINT('',({','.join(f'{v:.6f}' for v in one)}))" for one in own]
        if len(own) > 1:
            rows.append(f"POLYLINE('MEASURED {curve}',({','.join(ends)}))")
            ends = [f"#{len(rows)}"]
        curves += ends
    last = len(rows)
    rows += [
        f"GEOMETRIC_CURVE_SET('',({','.join(curves)}))",
        f"GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION('{name}',(#{last + 1}),#13)",
        f"SHAPE_DEFINITION_REPRESENTATION(#8,#{last + 2})",
    ]
    head = "; ".join(head_lines(data, report.Units())).replace("'", " ")
    lines = [
        "ISO-10303-21;", "HEADER;", f"FILE_DESCRIPTION(('{head}'),'2;1');",
        f"FILE_NAME('{name}','',(''),(''),'','OCMM','');",
        "FILE_SCHEMA(('CONFIG_CONTROL_DESIGN'));", "ENDSEC;", "DATA;",
        *(f"#{number}={row};" for number, row in enumerate(rows, start=1)),
        "ENDSEC;", "END-ISO-10303-21;", "",
    ]  # fmt: skip
    return "\n".join(lines).encode("ascii")


def _scale(size: float, largest: float) -> float:
    """Return 1, 2, 5, 10 ...: the largest deviation becomes a visible share of the section."""
    wanted = _SHARE * size / max(largest, 1e-9)
    power = 10.0 ** math.floor(math.log10(wanted))
    return max([1.0, *(step * power for step in (1, 2, 5) if step * power <= wanted)])


def _polyline(layer: str, places: Float) -> list[tuple[int, object]]:
    if len(places) < 2:
        return []
    pairs: list[tuple[int, object]] = [(0, "POLYLINE"), (8, layer), (66, 1), *_place(np.zeros(2))]
    for place in places:
        pairs += [(0, "VERTEX"), (8, layer), *_place(place)]
    return [*pairs, (0, "SEQEND"), (8, layer)]


def _place(place: Float) -> Iterator[tuple[int, object]]:
    for code, value in zip((10, 20, 30), (*place.tolist(), 0.0), strict=True):
        yield code, f"{round(value, 6) + 0.0:.6f}"


def _points_of(drawing: bytes) -> Float:
    """Return the POINT entities of a drawing, (n, 2), read back."""
    lines = drawing.decode("ascii").split("\r\n")
    found: list[list[float]] = []
    entity = ""
    for code, value in zip(lines[::2], lines[1::2], strict=False):
        if int(code) == 0:
            entity = value
        elif entity == "POINT" and int(code) in (10, 20):
            found.append([float(value)])
    return np.array(found).reshape(-1, 2)

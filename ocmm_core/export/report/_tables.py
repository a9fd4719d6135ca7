"""Tables of a report, cell by cell, for all human-readable formats, and its head.

Compensated surface points; vectors leave the material: ball centre ``xyz + radius * ijk``. The head
has the verdict on the part first, then identification of the job. Words of the program are
translated for people; names are not, nor what programs read.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ocmm_core.errors import StorageError
from ocmm_core.export.report._names import check_name, clean_text
from ocmm_core.export.report._report_data import (
    Element,
    ReportData,
    ReportedFeature,
    ReportedResult,
)
from ocmm_core.features.shapes import MINIMUM_POINTS
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation import FeatureView
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.decisions import U_WORDS, Verdict
from ocmm_core.wording import Speech

MM_PER_INCH = 25.4

JOB_STATE = "JobState"
"""Column with SIMULATED and INCOMPLETE in every row of every table."""
FLAG, HELD_BACK = "Flag", "held back"

POINT_COLUMNS = (
    "Name", "X", "Y", "Z", "I", "J", "K", "Feature", "Number", "Taken", FLAG, JOB_STATE,
)  # fmt: skip
FEATURE_COLUMNS = (
    "Name", "Type", "Component", "X", "Y", "Z", "I", "J", "K", "Diameter", "Length", "Angle",
    "Form", "RMS", "NbPoints", "CoordinateSystem", "Unit", "Width", "U", "V", "W", "Criterion",
    "Note", "Verdict", "Deciding", JOB_STATE,
)  # fmt: skip
REPORT_COLUMNS = (
    "Name", "Control", "Nominal", "Measured", "Deviation", "TolLower", "TolUpper", "Test",
    "OutTol", "Uncertainty", "Unit", "Calibration", "Temperature", "Probe", "Reference",
    "Verdict", "Features", "Datums", "Association", "Frame", "Bonus", "Floor", "Rule", "Note",
    "PartVerdict", JOB_STATE,
)  # fmt: skip


TESTS = {
    Verdict.CONFORM: "Pass",
    Verdict.NOT_CONFORM: "Fail",
    Verdict.NOT_PROVEN: "Not proven",
    Verdict.NOT_MEASURED: "Not measured",
    Verdict.PROVISIONAL: "Not measured",
}
"""Column ``Test``: undecided results neither pass nor fail, in every profile."""


@dataclass(frozen=True, slots=True)
class Number:
    """A number and its displayed decimals."""

    value: float
    decimals: int

    def text(self, decimal: str = ".") -> str:
        """Return it as text, locale-independent and never as minus zero."""
        # Python's format ignores the locale; adding zero after rounding drops the sign of -0.0.
        written = f"{round(self.value, self.decimals) + 0.0:.{self.decimals}f}"
        return written.replace(".", decimal)


Cell = str | int | Number | None
"""None is an empty cell."""


@dataclass(frozen=True, slots=True)
class ReportTable:
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def chosen(self, columns: Sequence[str], when_needed: Sequence[str] = ()) -> ReportTable:
        """Return the table with these columns; those in ``when_needed`` unless they are empty."""
        filled = [
            name
            for name in when_needed
            if any(row[self.columns.index(name)] not in (None, "") for row in self.rows)
        ]
        places = [self.columns.index(name) for name in (*columns, *filled)]
        rows = tuple(tuple(row[place] for place in places) for row in self.rows)
        return ReportTable(self.title, tuple(self.columns[place] for place in places), rows)


@dataclass(frozen=True, slots=True)
class Units:
    """Unit of all lengths, and digits after the decimal sign."""

    lengths: Literal["mm", "inch"] = "mm"
    length_decimals: int = 4
    angle_decimals: int = 4
    vector_decimals: int = 6

    def scaled(self, mm: float) -> float:
        return mm / MM_PER_INCH if self.lengths == "inch" else mm

    def length(self, name: str, mm: float | None) -> Number | None:
        """Return a length; ``name`` is for errors."""
        return None if mm is None else self.finite(name, self.scaled(mm), self.length_decimals)

    def angle(self, name: str, degrees: float | None) -> Number | None:
        """Return an angle; ``name`` is for errors."""
        return None if degrees is None else self.finite(name, degrees, self.angle_decimals)

    def place(self, name: str, mm: Float) -> list[Cell]:
        return [self.length(name, float(value)) for value in mm]

    def vector(self, name: str, direction: Float | None) -> list[Cell]:
        """Return three components of a unit vector; empty cells for None."""
        if direction is None:
            return [None, None, None]
        return [self.finite(name, float(value), self.vector_decimals) for value in direction]

    @staticmethod
    def finite(name: str, value: float, decimals: int) -> Number:
        """Return a number; StorageError if it is not finite."""
        if not math.isfinite(value):
            raise StorageError(
                "export.not_finite",
                f"A value of {name!r} is {value}, which cannot be reported.",
                "Repeat that feature.",
            )
        return Number(float(value), decimals)


def points_table(data: ReportData, units: Units, *, centres: bool = False) -> ReportTable:
    """Return the points in the order of the plan: compensated surface points, or ball centres."""
    rows = [
        _point_row(data, units, feature, index, point, centres=centres)
        for feature in data.features
        for index, point in enumerate(feature.seen.points, start=1)
    ]
    return ReportTable("Ball centres" if centres else "Points", POINT_COLUMNS, tuple(rows))


def features_table(data: ReportData, units: Units) -> ReportTable:
    rows: list[tuple[Cell, ...]] = []
    for feature in data.features:
        check_name("feature", feature.name)
        told = _verdict_cells(data, feature)
        if feature.nominal_element is not None:
            # The verdict is in the measured row; without one, here.
            beside = told if feature.actual_element is None else ("", "", *told[2:])
            row = _row_of(feature, feature.nominal_element, "Nominal", "Part", units)
            rows.append((*row, *beside))
        if feature.actual_element is not None:
            row = _row_of(feature, feature.actual_element, "Measured", data.system, units)
            rows.append((*row, *told))
    return ReportTable("Features", FEATURE_COLUMNS, tuple(rows))


def _verdict_cells(data: ReportData, feature: ReportedFeature) -> tuple[Cell, ...]:
    summary = data.view.verdict_of(feature.name)
    verdict = "" if summary.verdict is None else summary.verdict.value
    return (verdict, summary.deciding, data.state_words)


def report_table(data: ReportData, units: Units) -> ReportTable:
    rows = [_result_row(data, reported, units) for reported in data.reported]
    return ReportTable("Characteristics", REPORT_COLUMNS, tuple(rows))


def _point_row(
    data: ReportData,
    units: Units,
    feature: ReportedFeature,
    index: int,
    point: MeasuredPoint,
    *,
    centres: bool,
) -> tuple[Cell, ...]:
    name = f"{check_name('feature', feature.name)}.{index:03d}"
    place = point.tip_world if centres else point.surface_world
    return (
        name,
        *units.place(feature.name, data.frame.apply(place)),
        *units.vector(feature.name, data.frame.rotation @ point.direction),
        feature.name,
        point.number,
        data.taken_utc.get(point.number, ""),
        _flag(data, feature, point),
        data.state_words,
    )


def _flag(data: ReportData, feature: ReportedFeature, point: MeasuredPoint) -> str:
    """Return the flags of a point; may be empty."""
    flags = []
    if point.number in data.view.held:
        flags.append(HELD_BACK)
    if point.number in feature.seen.outliers:
        flags.append("outlier")
    return " + ".join(flags)


def _row_of(
    feature: ReportedFeature, element: Element, component: str, system: str, units: Units
) -> tuple[Cell, ...]:
    name, fit, count = feature.name, feature.seen.fit, len(feature.seen.points)
    measured = component == "Measured" and fit is not None
    # With the minimum number of points the fit is exact: no measure of form.
    has_form = measured and count > MINIMUM_POINTS[feature.shape]
    return (
        name, feature.shape.value, component,
        *units.place(name, element.point),
        *units.vector(name, element.direction),
        units.length(name, element.diameter),
        units.length(name, element.length),
        units.angle(name, element.angle_deg),
        units.length(name, fit.form) if has_form and fit is not None else None,
        units.length(name, fit.rms) if has_form and fit is not None else None,
        count if measured else None, system, units.lengths,
        units.length(name, element.width),
        *units.vector(name, element.across),
        fit.criterion.name.lower().replace("_", " ") if measured and fit is not None else "",
        note_of(feature.seen) if component == "Measured" else "",
    )  # fmt: skip


def note_of(seen: FeatureView) -> str:
    """Return the remarks on a measured feature; may be empty."""
    notes = [clean_text(seen.note)] if seen.note else []
    if seen.provisional and seen.taken < seen.needed:
        notes.insert(0, f"Provisional: {seen.taken} of {seen.needed} points.")
    return " ".join(notes)


def _result_row(data: ReportData, reported: ReportedResult, units: Units) -> tuple[Cell, ...]:
    result = reported.result
    name = check_name("characteristic", result.name)
    tell = units.angle if reported.unit == "deg" else units.length
    cells: list[Cell] = [None, None, TESTS[Verdict.NOT_MEASURED], None, None]
    if result.stated is not None:
        measured, deviation, uncertainty = result.stated
        beyond = max(deviation - result.upper, result.lower - deviation, 0.0)
        cells = [
            tell(name, measured),
            tell(name, deviation),
            TESTS[result.verdict],
            tell(name, beyond),
            tell(name, uncertainty),
        ]
    return (
        name, result.kind.capitalize(), tell(name, result.nominal), *cells[:2],
        tell(name, result.lower), tell(name, result.upper), *cells[2:],
        "deg" if reported.unit == "deg" else units.lengths,
        data.calibration.label, data.climate.label, data.probe.label, data.reference.label,
        result.verdict.value, " + ".join(result.features), " | ".join(reported.datums),
        reported.association, result.frame, tell(name, result.bonus or None),
        tell(name, result.floor), result.rule or data.plan.rule, clean_text(result.note),
        clean_text(data.part.headline), data.state_words,
    )  # fmt: skip


_RESULT = "characteristic"
_LONGEST_LIST = 200
"""Characters of names in one cell; free text is cut at 250, and no name may be lost."""


def head_table(data: ReportData) -> ReportTable:
    """Return the summary of the job, as pairs of word and text."""
    view, head = data.view, data.head
    counts = dict.fromkeys(Verdict, 0)
    for result in data.results:
        counts[result.verdict] += 1
    part = data.part
    pairs: list[tuple[str, str | int]] = [
        ("Part verdict", part.headline),
        ("Job state", data.state_words),
        *((("Requirements", part.requirement_words),) if part.requirement_words else ()),
        *_named("Characteristics NOT CONFORM", _RESULT, part.failing),
        *_named("Characteristics NOT PROVEN", _RESULT, part.unproven),
        *_named("Features INCOMPLETE", "feature", part.missing_features),
        *_named("Characteristics NOT MEASURED", _RESULT, part.unmeasured),
        ("Job", data.job),
        ("Job identity", head.job_uuid),
        ("Part", clean_text(view.part)),
        ("Serial number", clean_text(head.serial)),
        ("Operator", clean_text(head.operator)),
        ("Order", clean_text(view.header.order)),
        ("Batch", clean_text(view.header.batch)),
        ("Begun (UTC)", head.created_utc),
        ("Last point (UTC)", data.last_taken_utc),
        ("Plan", data.plan.name),
        ("Plan SHA-256", head.plan_identity),
        ("Plan release", clean_text(data.release.summary)),
        *((verdict.value, count) for verdict, count in counts.items()),
        ("Decision rule", data.rule_words),
        ("Uncertainty", U_WORDS),
        ("Frame", data.system),
        ("Complete", "yes" if part.complete else "no"),
        ("Not proven because", clean_text(view.unproven)),
        ("Points held back", ", ".join(map(str, view.held))),
        ("Points taken back", ", ".join(map(str, data.annulled))),
        ("Cameras", clean_text(data.calibration.note or data.calibration.label)),
        ("Probe", clean_text(data.probe.note or data.probe.label)),
        ("Reference body", clean_text(data.reference.label)),
        ("Temperatures", clean_text(view.temperature)),
        ("Reported at 20 C", "yes" if view.at_20_c else "no"),
        ("Measured with", f"OCMM {head.software_version}"),
        ("Reported with", f"OCMM {data.written_by}"),
        *_numbered("Cameras", view.camera_doubts),
        *_numbered("Noise", view.noise),
        *_numbered("Doubt", data.notes),
    ]
    return ReportTable("Job", ("Item", "Value"), tuple(pairs))


def exact_preview(jobs: Sequence[ReportData], _profile: object) -> tuple[ReportTable, ...]:
    """Return the tables of a job whose file has all digits."""
    (data,) = jobs
    units = Units(length_decimals=6, angle_decimals=6)
    tables = (report_table(data, units), features_table(data, units), points_table(data, units))
    return head_table(data), *tables


def _numbered(title: str, sentences: Sequence[str]) -> Iterator[tuple[str, str]]:
    for index, sentence in enumerate(sentences, start=1):
        yield f"{title} {index}", clean_text(sentence)


def _named(title: str, kind: str, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield names under a title, on as many lines as needed."""
    lines: list[str] = []
    for name in names:
        checked = check_name(kind, name)
        if lines and len(lines[-1]) + len(checked) < _LONGEST_LIST:
            lines[-1] += f", {checked}"
        else:
            lines.append(checked)
    for number, line in enumerate(lines, start=1):
        yield (title if number == 1 else f"{title} {number}", line)


_SPOKEN = frozenset({
    "Verdict", "Test", "Control", "Type", "Component", "CoordinateSystem", "Criterion", "Note",
    "Association", "Frame", "Rule", "PartVerdict", FLAG, "Temperature", JOB_STATE,
})  # fmt: skip
"""Columns whose cells are words or sentences of the program."""

_SPOKEN_LINES = frozenset({
    "Part verdict", "Job state", "Decision rule", "Uncertainty", "Frame", "Complete",
    "Not proven because", "Temperatures", "Reported at 20 C", "Item", "Cameras", "Probe",
})  # fmt: skip
"""Lines of the front sheet with a translated value; others hold names, numbers and hashes."""

_NUMBERED = ("Cameras ", "Doubt ")
"""Start of numbered lines of sentences."""


def said_table(table: ReportTable, speech: Speech) -> ReportTable:
    """Return a translated table: its heads, and cells with words of the program."""
    spoken = [name in _SPOKEN for name in table.columns]
    rows = tuple(
        tuple(said(cell, speech) if say else cell for cell, say in zip(row, spoken, strict=True))
        for row in table.rows
    )
    return replace(table, columns=tuple(map(speech.word, table.columns)), rows=rows)


def said_line(name: Cell, told: Cell, speech: Speech) -> tuple[Cell, Cell]:
    head = str(name)
    if head in _SPOKEN_LINES or head.startswith(_NUMBERED):
        told = said(told, speech)
    word, blank, number = head.rpartition(" ")
    if blank and number.isdecimal():
        return f"{speech.text(word)} {number}", told
    return speech.text(head), told


def said(cell: Cell, speech: Speech) -> Cell:
    """Return translated words of the program: a sentence, a word, or a list with commas."""
    if not isinstance(cell, str) or not cell:
        return cell
    whole = speech.text(cell)
    if whole != cell:
        return whole
    for mark in (", ", " + "):
        parts = cell.split(mark)
        spoken = [speech.word(part) for part in parts]
        if len(parts) > 1 and spoken != parts:
            return mark.join(spoken)
    return cell

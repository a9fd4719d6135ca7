"""Requirements with balloon numbers: as an inspection plan, and as forms 1 to 3 of AS9102.

A first article inspection accounts for every requirement of the drawing. Requirements that the plan
lacks are listed as NOT MEASURED with the reason; no cell that could mean conformity is left empty.
Blocks that no job knows, such as materials and processes, are blank in forms 1 and 2, with the
reason; people fill them.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import msgspec
from lxml import etree

from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.export.report._exporter import (
    Exporter,
    Profile,
    TableProfile,
    compare_delimited,
    delimited,
    polyworks_profile,
)
from ocmm_core.export.report._names import clean_text
from ocmm_core.export.report._report_data import ReportData, ReportedResult
from ocmm_core.export.report._tables import JOB_STATE, Cell, Number, ReportTable, Units
from ocmm_core.export.report._xlsx import looks_computed, new_workbook
from ocmm_core.export.report._xlsx_reader import read_workbook
from ocmm_core.export.template import PaperLengths
from ocmm_core.inspection.plan import Plan, RequirementState, requirement_count, requirement_states
from ocmm_core.tolerances.decisions import Verdict
from ocmm_core.tolerances.zones import Characteristic

_FORM = (
    "5. Char. No.", "6. Reference Location", "7. Characteristic Designator", "8. Requirement",
    "9. Results", "10. Tooling", "11. Non-Conformance", "Comment", "Verdict", "PartVerdict",
    JOB_STATE,
)  # fmt: skip
_PLAN = (
    "Balloon", "Source", "Reference", "Group", "Label", "Requirement", "Nominal", "Lower", "Upper",
    "Unit", "In the plan", "Characteristics", "Features", "Reason", "Remark",
)  # fmt: skip
_BLOCKS = ("Block", "Content", "Why blank")
_PURCHASE = "Fill by hand: the job has no purchase data"
_DRAWING = "Fill by hand: the plan names files, not drawing numbers or revisions"
_PEOPLE = "Fill and sign by hand: the program does not sign for people"
_PROCESS = "Fill by hand: the machine measures geometry, not materials or processes"
_FORM_3 = "AS9102 form 3: characteristic accountability, verification and compatibility evaluation"
_NOT_MEASURED = Verdict.NOT_MEASURED.value
_BASIC = "Basic dimension: nominal of the feature, without a result of its own"
_DECIMALS = 6
_WIDEST = 70


def account_table(plan: Plan) -> ReportTable:
    """Return the requirements of a plan with their state, as an inspection plan."""
    rows = [_planned(one) for one in requirement_states(plan)]
    return ReportTable("Inspection plan", _PLAN, tuple(rows))


def account_file(plan: Plan, suffix: str) -> bytes:
    """Return the inspection plan as CSV (UTF-8), or as a workbook for ``.xlsx``."""
    table, count = account_table(plan), requirement_count(plan)
    if suffix.lower() == ".xlsx":
        about = () if count is None else (f"{count.sentence}.",)
        return _workbook(((f"{plan.name}, part {plan.part}", *about), table))
    return delimited(table, _csv_profile(), _shape(table))


def write_account(plan: Plan, path: Path) -> Path:
    """Write the plan as .csv or .xlsx; InputError: no requirements, other ending; StorageError."""
    if not plan.requirements:
        raise InputError(
            "plan.no_account",
            f"{plan.name}: the plan has no requirements of a model, QIF document or table.",
            "Import one: ocmm plan import, or Import on the plan page.",
        )
    if path.suffix.lower() not in (".csv", ".xlsx"):
        raise InputError("plan.output", f"{path}: not .csv or .xlsx.", "Give another name.")
    try:
        write_atomic(path, account_file(plan, path.suffix))
    except OSError as error:
        raise StorageError(
            "plan.output", f"{path}: cannot be written ({error.strerror}).", "Give another name."
        ) from error
    return path


def form_table(data: ReportData) -> ReportTable:
    """Return form 3 of AS9102: a row for each requirement, then for each other characteristic."""
    end = (clean_text(data.part.headline), data.state_words)
    known = {one.result.name: one for one in data.reported}
    lengths = PaperLengths(data.paper.template.lengths)
    states = requirement_states(data.plan)
    rows = [
        (*_accounted(data, state, known), *end)
        for state in states
        if state.counts or state.requirement.group == "note"
    ]
    drawn = {name for state in states for name in state.requirement.characteristics}
    numbers = [int(n) for state in states if (n := state.requirement.balloon).isdecimal()]
    others = [one for name, one in known.items() if name not in drawn]
    for number, one in enumerate(others, start=max(numbers, default=0) + 1):
        place = f"plan {data.plan.name}"
        asks = "" if one.asked is None else _text(one.asked, one.unit, lengths)
        cells = (str(number), place, one.result.name, asks)
        rows.append((*cells, *_results(data, [one], ""), *end))
    return ReportTable("Form 3", _FORM, tuple(rows))


def accountability_table(data: ReportData) -> ReportTable:
    """Return form 1 of AS9102: part number accountability."""
    laboratory, plan = data.paper.template.laboratory, data.plan
    is_full = data.part.complete and not data.part.is_partial
    why = "; ".join(filter(None, (data.part.requirement_words, *data.part.reasons)))
    scope = "Full" if is_full else f"Partial: {why or 'incomplete'}"
    rows: tuple[tuple[str, str, str], ...] = (
        *_identity(data),
        ("5. Part Revision Level", "", _DRAWING),
        ("6. Drawing Number", ", ".join(f"file {one.file}" for one in plan.sources), _DRAWING),
        ("7. Drawing Revision Level", "", _DRAWING),
        ("8. Additional Changes", "", _DRAWING),
        ("9. Manufacturing Process Reference", clean_text(data.view.header.order), _PURCHASE),
        ("10. Organization Name", clean_text(laboratory.name), "The report template has none"),
        ("11. Supplier Code", "", _PURCHASE),
        ("12. Purchase Order Number", "", _PURCHASE),
        ("13. Detail FAI or Assembly FAI", "", "Fill by hand: the plan does not say which"),
        ("14. Full FAI or Partial FAI", scope, ""),
        ("15-18. Index of part numbers of an assembly", "", "Fill by hand if it is an assembly"),
        ("19. FAI complete", "yes" if is_full else "no", ""),
        ("20-25. Signatures and dates", "", _PEOPLE),
    )  # fmt: skip
    return ReportTable("Form 1", _BLOCKS, tuple((a, b, "" if b else why) for a, b, why in rows))


def product_table(data: ReportData) -> ReportTable:
    """Return form 2 of AS9102: materials, special processes and functional tests, left blank."""
    names = (
        "5. Material or Process Name", "6. Specification Number", "7. Code", "8. Supplier",
        "9. Customer Approval Verification", "10. Certificate of Conformance Number",
        "11. Functional Test Procedure Number", "12. Acceptance Report Number", "13. Comments",
    )  # fmt: skip
    rows = (*_identity(data), *((name, "", _PROCESS) for name in names))
    return ReportTable("Form 2", _BLOCKS, tuple((a, b, "" if b else why) for a, b, why in rows))


def _identity(data: ReportData) -> tuple[tuple[str, str, str], ...]:
    """Return blocks 1 to 4, which all forms have."""
    part, serial = clean_text(data.head.part), clean_text(data.head.serial)
    return (
        ("1. Part Number", part, ""),
        ("2. Part Name", "", "Fill by hand: the job has one name of the part, in block 1"),
        ("3. Serial Number", "" if serial == "-" else serial, "The job has no serial number"),
        ("4. FAIR Identifier", data.job, ""),
    )


def _planned(one: RequirementState) -> tuple[Cell, ...]:
    item = one.requirement
    numbers = (item.nominal, item.lower, item.upper)
    return (
        item.balloon, one.source.file, item.reference, item.group, item.label, item.asks,
        *(None if x is None else Number(x, _DECIMALS) for x in numbers), item.unit,
        "no" if one.why else "yes", ", ".join(item.characteristics),
        ", ".join(item.nominals), one.why, item.remark,
    )  # fmt: skip


def _accounted(
    data: ReportData, one: RequirementState, known: Mapping[str, ReportedResult]
) -> tuple[Cell, ...]:
    item = one.requirement
    found = [known[name] for name in item.characteristics if name in known]
    cells = (item.balloon, f"{one.source.file} {item.reference}", item.label, item.asks)
    if found or one.why or item.group == "note":
        return (*cells, *_results(data, found, one.why or item.remark, is_partial=bool(one.why)))
    done = {seen.name for seen in data.features if seen.actual_element is not None}
    if not set(item.nominals) <= done:
        return (*cells, _NOT_MEASURED, "", _NOT_MEASURED, "", _NOT_MEASURED)
    words = _BASIC if item.group == "dimension" else "Measured; no tolerance in the plan"
    return (*cells, words, _tool(data), "No result", item.remark, "NO TOLERANCE")


def _results(
    data: ReportData, found: Sequence[ReportedResult], comment: str, *, is_partial: bool = False
) -> tuple[Cell, ...]:
    """Return results, tool, non-conformance, comment and verdict of a requirement."""
    lengths = PaperLengths(data.paper.template.lengths)
    told = [_result(one, lengths, name=len(found) > 1) for one in found]
    verdicts = [one.result.verdict for one in found]
    bad = [one.result.name for one in found if one.result.verdict is Verdict.NOT_CONFORM]
    # A part of a requirement cannot conform for the whole of it.
    missing = is_partial or any(one.result.stated is None for one in found) or not found
    if missing:
        told.append(_NOT_MEASURED)
    word = _NOT_MEASURED if missing else Verdict.CONFORM.value
    if bad:
        word = Verdict.NOT_CONFORM.value
    elif not missing and any(verdict is not Verdict.CONFORM for verdict in verdicts):
        word = Verdict.NOT_PROVEN.value
    fault = f"{word}: {', '.join(bad)}" if bad else "" if word == Verdict.CONFORM.value else word
    return "; ".join(dict.fromkeys(told)), _tool(data) if found else "", fault, comment, word


def _result(one: ReportedResult, lengths: PaperLengths, *, name: bool) -> str:
    lead = f"{one.result.name}: " if name else ""
    if one.result.stated is None:
        return f"{lead}{_NOT_MEASURED}"
    measured, _, u = one.result.stated
    is_length = one.unit == "mm"
    scale, decimals = (lengths.per_mm, lengths.decimals) if is_length else (1.0, 4)
    value, uncertainty = (
        Units.finite(one.result.name, scale * x, decimals).text() for x in (measured, u or 0.0)
    )
    unit = lengths.word if is_length else one.unit
    return f"{lead}{value} {unit} (U {uncertainty}), {one.result.verdict.value}"


def _text(one: Characteristic, unit: str, lengths: PaperLengths) -> str:
    scale, word = (lengths.per_mm, lengths.word) if unit == "mm" else (1.0, unit)
    nominal, upper, lower = scale * one.nominal, scale * one.upper, scale * one.lower
    size = f"{nominal:g} {upper:+g} {lower:+g}" if nominal else f"{upper:g}"
    return f"{one.kind} {size} {word}{''.join(f'|{name}' for name in one.datums)}"


def _tool(data: ReportData) -> str:
    return f"{data.paper.template.machine.name or 'OCMM'}, {data.probe.label}"


def _contents(jobs: Sequence[ReportData], profile: Profile) -> dict[str, bytes]:
    (data,) = jobs
    table = form_table(data)
    csv, book = _files(data)
    return {csv: delimited(table, _csv_profile(), _shape(table)), book: _workbook(*_sheets(data))}


def _differences(
    jobs: Sequence[ReportData], profile: Profile, files: Mapping[str, bytes]
) -> list[str]:
    (data,) = jobs
    table = form_table(data)
    csv, book = _files(data)
    found = compare_delimited(csv, files[csv], table, _csv_profile(), _shape(table))
    try:
        sheets = read_workbook(files[book])
    except (zipfile.BadZipFile, KeyError, ValueError, etree.XMLSyntaxError) as error:
        return [*found, f"{book}: it cannot be read ({error})."]
    for above, form in _sheets(data):
        rows, width = sheets.pop(form.title, []), len(form.columns)
        wanted: list[list[Cell]] = [[line] for line in above]
        wanted += [list(form.columns), *map(list, form.rows)]
        for line, (row, cells) in enumerate(zip(wanted, rows, strict=False), start=1):
            plain = [cell or None for cell in row] + [None] * (width - len(row))
            if plain != [*cells, *[None] * (width - len(cells))]:
                found.append(f"{book}: {form.title}, row {line} is not what was to be written.")
        if len(rows) != len(wanted):
            found.append(f"{book}: {form.title} lacks rows.")
    return found + [f"{book}: the sheet {name} was not written here." for name in sheets]


def _preview(jobs: Sequence[ReportData], profile: Profile) -> tuple[ReportTable, ...]:
    (data,) = jobs
    return tuple(table for _, table in _sheets(data))


def _files(data: ReportData) -> tuple[str, str]:
    return f"{data.stem}_fai.csv", f"{data.stem}_fai.xlsx"


def _sheets(data: ReportData) -> tuple[tuple[tuple[str, ...], ReportTable], ...]:
    return (
        (_above(data, "AS9102 form 1: part number accountability"), accountability_table(data)),
        (_above(data, "AS9102 form 2: product accountability"), product_table(data)),
        (_above(data, _FORM_3), form_table(data)),
    )


def _above(data: ReportData, title: str) -> tuple[str, ...]:
    """Return the lines above a form: its title, the part, and the verdict."""
    lines = (
        title,
        f"Part: {clean_text(data.head.part)}",
        f"Serial number: {clean_text(data.head.serial)}",
        f"Report: {data.job}",
        f"Part verdict: {data.part.headline}",
        data.part.requirement_words,
        data.state_words,
    )
    return tuple(filter(None, lines))


def _csv_profile() -> Profile:
    """Return commas, and an encoding with the signs of drawings, such as Ø."""
    return msgspec.structs.replace(polyworks_profile(), encoding="utf-8-sig")


def _shape(table: ReportTable) -> TableProfile:
    return TableProfile(header=True, columns=list(table.columns))


def _workbook(*sheets: tuple[Sequence[str], ReportTable]) -> bytes:
    """Return a workbook with tables below lines; texts stay texts."""
    stream = io.BytesIO()
    book = new_workbook(stream, created=datetime(1980, 1, 1, tzinfo=UTC))
    bold = book.add_format({"bold": True, "quote_prefix": True})
    text = book.add_format({"text_wrap": True, "valign": "top"})
    quoted = book.add_format({"text_wrap": True, "valign": "top", "quote_prefix": True})
    for above, table in sheets:
        sheet = book.add_worksheet(table.title)
        for row, line in enumerate(above):
            sheet.write_string(row, 0, line, bold)
        for column, name in enumerate(table.columns):
            longest = max((len(str(row[column] or "")) for row in table.rows), default=0)
            sheet.set_column(column, column, min(max(longest, len(name)) + 2, _WIDEST))
            sheet.write_string(len(above), column, name, bold)
        for place, cells in enumerate(table.rows, start=len(above) + 1):
            for column, cell in enumerate(cells):
                if isinstance(cell, Number):
                    sheet.write_number(place, column, cell.value, text)
                elif cell:
                    kind = quoted if looks_computed(str(cell)) else text
                    sheet.write_string(place, column, str(cell), kind)
        sheet.freeze_panes(len(above) + 1, 0)
        sheet.set_landscape()
        sheet.fit_to_pages(1, 0)
    book.close()
    return stream.getvalue()


AS9102 = Exporter(
    name="fai",
    title="First article (AS9102)",
    purpose="first article inspection: every requirement of the model with its result",
    suffixes=("_fai.csv", "_fai.xlsx"),
    profile="",
    contents=_contents, differences=_differences, preview=_preview,
)  # fmt: skip

"""The report as a workbook: verdict and job on the front sheet, then three of typed cells.

The states of the job (simulated, incomplete) are above the table of every sheet. Every sheet is
ready to print: on A4, one page wide, with its heads on every page and the page number in the foot.
Columns with the same content in every row are to the right of the printed ones.

Text is written as text in any case: nothing in the workbook is a formula or a link (xlsxwriter's
``strings_to_*`` are off). Numbers are numbers, shown with the digits of the profile. The file is
verified by reading back the archive, cell by cell.
"""

from __future__ import annotations

import io
import math
import textwrap
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from lxml import etree

from ocmm_core.export.report._exporter import Exporter, Profile
from ocmm_core.export.report._names import clean_text
from ocmm_core.export.report._report_data import ReportData
from ocmm_core.export.report._tables import (
    Cell,
    Number,
    ReportTable,
    Units,
    features_table,
    head_table,
    points_table,
    report_table,
    said,
    said_line,
    said_table,
)
from ocmm_core.export.report._xlsx_reader import read_workbook
from ocmm_core.export.template import PaperLengths
from ocmm_core.tolerances.decisions import Verdict
from ocmm_core.wording import Speech

if TYPE_CHECKING:
    import xlsxwriter
    from xlsxwriter.worksheet import Worksheet

_WIDEST = 60
_FRONT = "Verdict"
_FRONT_SIGNS = 100
"""Characters in a line of the front sheet."""
_LINE_PT = 15.0
_FILLED = 0.9
"""Usable share of a column's width, in characters: letters are wider than digits."""
_FRONT_WIDTHS = (32, 82)

_A4 = 9
_ROWS_A_PAGE = 95
"""Of a long table: letters are then as small as in a telephone book, but legible."""

PRINTED = {
    "Characteristics": (
        "Name", "Control", "Features", "Datums", "Nominal", "TolLower", "TolUpper", "Measured",
        "Deviation", "Uncertainty", "Unit", "OutTol", "Bonus", "Verdict",
    ),
    "Features": (
        "Name", "Type", "Component", "X", "Y", "Z", "I", "J", "K", "Diameter", "Length", "Width",
        "Angle", "Form", "RMS", "NbPoints", "CoordinateSystem", "Unit", "Verdict",
    ),
    "Points": (
        "Name", "X", "Y", "Z", "I", "J", "K", "Feature", "Number", "Taken", "Flag",
    ),
}  # fmt: skip
"""Printed columns by name of the sheet; the other columns are to the right of them."""

_LENGTHS = ("X", "Y", "Z")
_UPRIGHT = frozenset({_FRONT, "Points"})
_COLOURS: dict[Verdict | None, tuple[str, str]] = {
    Verdict.CONFORM: ("#006100", "#C6EFCE"),
    Verdict.NOT_CONFORM: ("#9C0006", "#FFC7CE"),
}
"""Of the letters and of the cell."""
_UNDECIDED = ("#7F4F00", "#FFEB9C")
_WARNING = "#B45309"


def _contents(jobs: Sequence[ReportData], profile: Profile) -> dict[str, bytes]:
    (data,) = jobs
    stream = io.BytesIO()
    book = new_workbook(
        stream, title=data.job, created=_begun(data), comments=f"OCMM {data.written_by}"
    )
    _write_front(book, data)
    for key, table in _tables(data, profile).items():
        _write_table(book, data, key, table)
    book.close()
    return {_name(data): stream.getvalue()}


def new_workbook(stream: io.BytesIO, **properties: object) -> xlsxwriter.Workbook:
    """Return a workbook with document properties, in which texts stay texts."""
    # Imported late: the window lists this format at its start, and writes it in a side process.
    import xlsxwriter

    book = xlsxwriter.Workbook(
        stream,
        {
            "in_memory": True,
            "strings_to_formulas": False,
            "strings_to_urls": False,
            "strings_to_numbers": False,
            "nan_inf_to_errors": False,
        },
    )
    # The same job gives the same bytes at any time.
    book.set_properties(properties)
    return book


def _write_front(book: xlsxwriter.Workbook, data: ReportData) -> None:
    """Write the front sheet: the verdict in large letters, then the reasons."""
    sheet = _new_sheet(book, data, _FRONT)
    ink, fill = _COLOURS.get(data.part.shown_as, _UNDECIDED)
    large = book.add_format(
        {"bold": True, "font_size": 36, "font_color": ink, "bg_color": fill, "align": "vcenter"}
    )
    warned = book.add_format({"bold": True, "font_size": 20, "font_color": _WARNING})
    plain = book.add_format({"font_size": 14, "quote_prefix": True})
    bold = book.add_format({"bold": True, "valign": "top"})
    value = book.add_format({"text_wrap": True, "valign": "top", "align": "left"})
    # A text that looks like a formula stays text even after editing its cell.
    quoted = book.add_format(
        {"text_wrap": True, "valign": "top", "align": "left", "quote_prefix": True}
    )
    lines = _front_lines(data)
    for column, width in enumerate(_FRONT_WIDTHS):
        sheet.set_column(column, column, width)
    sheet.set_row(0, 60)
    sheet.merge_range(0, 0, 0, 1, "", large)
    sheet.write_string(0, 0, lines[0], large)
    for row, line in enumerate(lines[1:], start=1):
        is_state = row <= len(data.states)
        sheet.set_row(row, 30 if is_state else 20)
        sheet.write_string(row, 0, line, warned if is_state else plain)
    for row, (name, told) in enumerate(_job_rows(data), start=len(lines)):
        sheet.write_string(row, 0, str(name), bold)
        # Some programs do not fit the row height to its text.
        high = len(textwrap.wrap(str(told), round(_FILLED * _FRONT_WIDTHS[1])))
        if high > 1:
            sheet.set_row(row, _LINE_PT * high)
        if isinstance(told, int):
            sheet.write_number(row, 1, told, value)
        elif told:
            sheet.write_string(row, 1, str(told), quoted if looks_computed(str(told)) else value)
    sheet.fit_to_pages(1, 0)


def _job_rows(data: ReportData) -> tuple[tuple[Cell, ...], ...]:
    """Return the lines of the front sheet below the verdict."""
    table, speech = head_table(data), _speech(data)
    return tuple(said_line(row[0], row[1], speech) for row in (table.columns, *table.rows))


def looks_computed(text: str) -> bool:
    """Return whether a spreadsheet could take a text for a formula."""
    return text.lstrip()[:1] in ("=", "+", "-", "@")


def _write_table(book: xlsxwriter.Workbook, data: ReportData, key: str, table: ReportTable) -> None:
    """Write a table on a separate sheet, below the states of the job."""
    sheet = _new_sheet(book, data, key)
    heads = {
        side: book.add_format(
            {"bold": True, "bottom": 1, "align": side, "indent": int(side == "left")}
        )
        for side in ("left", "right")
    }
    text = book.add_format({"indent": 1})
    # A text that looks like a formula stays text even after editing its cell.
    quoted = book.add_format({"indent": 1, "quote_prefix": True})
    digits = {
        count: book.add_format({"num_format": "0." + "0" * count if count else "0"})
        for count in range(10)
    }
    above = _above(data)
    for row, line in enumerate(above):
        warned = book.add_format({"bold": True, "font_size": 16, "font_color": _WARNING})
        sheet.write_string(row, 0, line, warned)
    top = len(above)
    for column, name in enumerate(table.columns):
        counts = any(isinstance(row[column], Number | int) for row in table.rows)
        sheet.write_string(top, column, name, heads["right" if counts else "left"])
        sheet.set_column(column, column, _width(table, column))
    for row, cells in enumerate(table.rows, start=top + 1):
        for column, cell in enumerate(cells):
            if isinstance(cell, Number):
                sheet.write_number(row, column, cell.value, digits[cell.decimals])
            elif isinstance(cell, int):
                sheet.write_number(row, column, cell)
            elif cell:
                sheet.write_string(row, column, cell, quoted if looks_computed(cell) else text)
    sheet.freeze_panes(top + 1, 0)
    last = top + len(table.rows)
    sheet.repeat_rows(top)
    sheet.print_area(0, 0, last, len(PRINTED[key]) - 1)
    sheet.fit_to_pages(1, math.ceil((last + 1) / _ROWS_A_PAGE))


def _new_sheet(book: xlsxwriter.Workbook, data: ReportData, title: str) -> Worksheet:
    sheet = book.add_worksheet(_speech(data).word(title))
    sheet.set_paper(_A4)
    if title not in _UPRIGHT:
        sheet.set_landscape()
    sheet.set_margins(left=0.5, right=0.4, top=0.6, bottom=0.6)
    # The command character of a foot is doubled.
    job = data.job.replace("&", "&&")
    sheet.set_footer(_speech(data).text(f"&L{job}&C&A&RPage &P of &N"))
    if data.states:
        # Also on paper, on every page of the sheet.
        sheet.set_header(f"&C&B{said(data.state_words, _speech(data))}")
        sheet.set_tab_color(_WARNING)
    return sheet


def _above(data: ReportData) -> tuple[str, ...]:
    return (str(said(data.state_words, _speech(data))),) if data.states else ()


def _front_lines(data: ReportData) -> tuple[str, ...]:
    """Return the lines of the front sheet: verdict, states, reasons, identification."""
    part, head, speech = data.part, data.head, _speech(data)
    about = (("Part", head.part), ("Serial number", head.serial), ("Operator", head.operator))
    return (
        ": ".join((speech.word(part.word.value), *map(speech.text, part.short_headline[1:]))),
        *map(speech.word, data.states),
        *(
            line
            for reason in filter(None, (part.requirement_words, *part.reasons))
            for line in textwrap.wrap(speech.text(reason), _FRONT_SIGNS)
        ),
        speech.text(part.summary.counted or "The plan has no characteristics."),
        *(f"{speech.text(name)}: {clean_text(text)}" for name, text in about),
        f"{speech.text('Job')}: {data.job}",
    )


def _speech(data: ReportData) -> Speech:
    return Speech(data.paper.template.language)


def _cells_of(data: ReportData, profile: Profile) -> dict[str, list[list[Cell]]]:
    above: list[list[Cell]] = [[line] for line in _above(data)]
    front: list[list[Cell]] = [[line] for line in _front_lines(data)]
    front += [list(row) for row in _job_rows(data)]
    word = _speech(data).word
    sheets: dict[str, list[list[Cell]]] = {word(_FRONT): front}
    for key, table in _tables(data, profile).items():
        sheets[word(key)] = [*above, list(table.columns), *(list(row) for row in table.rows)]
    return sheets


def _differences(
    jobs: Sequence[ReportData], profile: Profile, files: Mapping[str, bytes]
) -> list[str]:
    (data,) = jobs
    name = _name(data)
    try:
        sheets = read_workbook(files[name])
    except (zipfile.BadZipFile, KeyError, ValueError, etree.XMLSyntaxError) as error:
        return [f"{name}: it cannot be read ({error})."]
    different = []
    for title, rows in _cells_of(data, profile).items():
        found = sheets.get(title)
        wanted = [[_plain(cell) for cell in row] for row in rows]
        while wanted and not any(value is not None for value in wanted[-1]):
            wanted.pop()
        if found is None or len(found) != len(wanted):
            different.append(f"{name}: sheet {title} does not have the rows written.")
            continue
        for line, (row, cells) in enumerate(zip(wanted, found, strict=True), start=1):
            cells = cells + [None] * (len(row) - len(cells))
            for column, (value, cell) in enumerate(zip(row, cells, strict=False), start=1):
                if value != cell:
                    different.append(
                        f"{name}: sheet {title}, row {line}, column {column}: {cell!r} instead of "
                        f"{value!r}."
                    )
    return different


def _plain(cell: Cell) -> str | float | None:
    if isinstance(cell, Number):
        # The writer keeps 16 digits of a number.
        return float(f"{cell.value:.16G}")
    if isinstance(cell, int):
        return float(cell)
    return cell or None


def _preview(jobs: Sequence[ReportData], profile: Profile) -> tuple[ReportTable, ...]:
    (data,) = jobs
    front = tuple((line,) for line in _front_lines(data)[1:])
    return (
        ReportTable(_speech(data).word(_FRONT), (_front_lines(data)[0],), front),
        head_table(data),
        *_tables(data, profile).values(),
    )


def _tables(data: ReportData, profile: Profile) -> dict[str, ReportTable]:
    """Return the translated tables by untranslated names of their sheets."""
    units = _units(data, profile)
    tables = (report_table(data, units), features_table(data, units), points_table(data, units))
    return {table.title: _for_paper(table, units, _speech(data)) for table in tables}


def _units(data: ReportData, profile: Profile) -> Units:
    """Return the units of the profile, or inch if the report is in inch."""
    lengths = PaperLengths(data.paper.template.lengths)
    if lengths.unit == "mm" or profile.units.lengths == "inch":
        return profile.units
    decimals = max(profile.units.length_decimals, lengths.decimals)
    return replace(profile.units, lengths="inch", length_decimals=decimals)


def _for_paper(table: ReportTable, units: Units, speech: Speech) -> ReportTable:
    """Return a table with printed columns first; its heads state the unit if no column does."""
    printed = PRINTED[table.title]
    chosen = table.chosen((*printed, *(name for name in table.columns if name not in printed)))
    named = replace(said_table(chosen, speech), title=speech.word(table.title))
    if "Unit" in chosen.columns:
        return named
    unit = PaperLengths(units.lengths).word
    heads = tuple(f"{name}, {unit}" if name in _LENGTHS else name for name in named.columns)
    return replace(named, columns=heads)


def _width(table: ReportTable, column: int) -> int:
    longest = max((len(_shown(row[column])) for row in table.rows), default=0)
    return min(max(longest, len(table.columns[column])) + 3, _WIDEST)


def _shown(cell: Cell) -> str:
    return cell.text() if isinstance(cell, Number) else str(cell or "")


def _name(data: ReportData) -> str:
    return f"{data.stem}.xlsx"


def _begun(data: ReportData) -> datetime:
    try:
        return datetime.fromisoformat(data.head.created_utc).astimezone(UTC)
    except ValueError:
        return datetime(1980, 1, 1, tzinfo=UTC)


XLSX = Exporter(
    name="xlsx",
    title="Workbook (XLSX)",
    purpose="people",
    suffixes=(".xlsx",),
    profile="unit and digits",
    contents=_contents, differences=_differences, preview=_preview,
)  # fmt: skip

"""The report as a workbook: the verdict on the front sheet, then four sheets of typed cells.

What the job must not be taken for (simulated, incomplete) stands above the table of every sheet.

Text is written as text, whatever it begins with: nothing in the workbook is a formula, a link or a
guess (xlsxwriter's ``strings_to_*`` are off). Numbers are numbers, shown with the digits of the
profile. What was written is read back from the archive itself, cell by cell.
"""

from __future__ import annotations

import io
import re
import textwrap
import zipfile
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from lxml import etree

from ocmm_core.export.report._exporter import Exporter
from ocmm_core.export.report._head import head_table
from ocmm_core.export.report._names import clean_text
from ocmm_core.export.report._profile import Profile
from ocmm_core.export.report._report_data import ReportData
from ocmm_core.export.report._tables import (
    Cell,
    Number,
    Table,
    features_table,
    points_table,
    report_table,
)
from ocmm_core.tolerances.decisions import Verdict

if TYPE_CHECKING:
    import xlsxwriter
    from xlsxwriter.worksheet import Worksheet

_SPACE = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
_ESCAPED = re.compile(r"_x005F(_x[0-9A-Fa-f]{4}_)")
_WIDEST = 60
_FRONT = "Verdict"
_FRONT_SIGNS = 100
"""In a line of the front sheet."""
_COLOURS: dict[Verdict | None, tuple[str, str]] = {
    Verdict.CONFORM: ("#006100", "#C6EFCE"),
    Verdict.NOT_CONFORM: ("#9C0006", "#FFC7CE"),
}
"""Of the letters and of the cell."""
_UNDECIDED = ("#7F4F00", "#FFEB9C")
_WARNING = "#B45309"
_MOST_BYTES = 200_000_000
"""More than any sheet that was written here; a reader has a limit."""


def _contents(jobs: Sequence[ReportData], profile: Profile) -> dict[str, bytes]:
    (data,) = jobs
    stream = io.BytesIO()
    # The window knows this format from its start, and writes workbooks in a process of its own.
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
    # The same job gives the same bytes, whenever it is reported.
    book.set_properties(
        {"title": data.job, "created": _begun(data), "comments": f"OCMM {data.written_by}"}
    )
    _write_front(book, data)
    for table in _tables(data, profile):
        _write_table(book, data, table)
    book.close()
    return {_name(data): stream.getvalue()}


def _write_front(book: xlsxwriter.Workbook, data: ReportData) -> None:
    """Write the front sheet: the verdict in large letters, then why."""
    sheet = _new_sheet(book, data, _FRONT)
    ink, fill = _COLOURS.get(data.part.verdict, _UNDECIDED)
    large = book.add_format(
        {"bold": True, "font_size": 36, "font_color": ink, "bg_color": fill, "align": "vcenter"}
    )
    warned = book.add_format({"bold": True, "font_size": 20, "font_color": _WARNING})
    plain = book.add_format({"font_size": 14, "quote_prefix": True})
    lines = _front_lines(data)
    sheet.set_column(0, 0, 110)
    sheet.set_row(0, 60)
    sheet.write_string(0, 0, lines[0], large)
    for row, line in enumerate(lines[1:], start=1):
        is_state = row <= len(data.states)
        sheet.set_row(row, 30 if is_state else 20)
        sheet.write_string(row, 0, line, warned if is_state else plain)


def _write_table(book: xlsxwriter.Workbook, data: ReportData, table: Table) -> None:
    """Write a table on a sheet of its own, below the states of the job."""
    sheet = _new_sheet(book, data, table.title)
    bold = book.add_format({"bold": True})
    # A text that looks like a formula stays text also when somebody edits its cell.
    plain = book.add_format({"quote_prefix": True})
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
        sheet.write_string(top, column, name, bold)
        sheet.set_column(column, column, _width(table, column))
    for row, cells in enumerate(table.rows, start=top + 1):
        for column, cell in enumerate(cells):
            if isinstance(cell, Number):
                sheet.write_number(row, column, cell.value, digits[cell.decimals])
            elif isinstance(cell, int):
                sheet.write_number(row, column, cell)
            elif cell:
                style = plain if cell.lstrip()[:1] in ("=", "+", "-", "@") else None
                sheet.write_string(row, column, cell, style)
    sheet.freeze_panes(top + 1, 0)


def _new_sheet(book: xlsxwriter.Workbook, data: ReportData, title: str) -> Worksheet:
    sheet = book.add_worksheet(title)
    if data.states:
        # On paper, too, whatever page of the sheet it is.
        sheet.set_header(f"&C&B{data.state_words}")
        sheet.set_tab_color(_WARNING)
    return sheet


def _above(data: ReportData) -> tuple[str, ...]:
    """Return what stands above the table of every sheet."""
    return (data.state_words,) if data.states else ()


def _front_lines(data: ReportData) -> tuple[str, ...]:
    """Return the lines of the front sheet: verdict, states, reasons, whom it is about."""
    part, head = data.part, data.head
    about = (("Part", head.part), ("Serial number", head.serial), ("Operator", head.operator))
    return (
        part.word.value,
        *data.states,
        *(line for reason in part.reasons for line in textwrap.wrap(reason, _FRONT_SIGNS)),
        part.summary.counted or "The plan has no characteristics.",
        *(f"{name}: {clean_text(text)}" for name, text in about),
        f"Job: {data.job}",
    )


def _cells_of(data: ReportData, profile: Profile) -> dict[str, list[list[Cell]]]:
    """Return what every sheet holds, row by row."""
    above: list[list[Cell]] = [[line] for line in _above(data)]
    sheets: dict[str, list[list[Cell]]] = {_FRONT: [[line] for line in _front_lines(data)]}
    for table in _tables(data, profile):
        sheets[table.title] = [*above, list(table.columns), *(list(row) for row in table.rows)]
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


def read_workbook(content: bytes) -> dict[str, list[list[str | float | None]]]:
    """Return the cells of every sheet of a workbook by its name, row by row.

    Raises
    ------
    ValueError
        It holds a formula, a link or more than can be.
    """
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        parts = {info.filename: info for info in archive.infolist()}
        if sum(info.file_size for info in parts.values()) > _MOST_BYTES:
            raise ValueError("it is too large")

        def tree(name: str) -> etree._Element:
            parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=False)
            return etree.fromstring(archive.read(name), parser)

        texts: list[str] = []
        if "xl/sharedStrings.xml" in parts:
            texts = [
                _unescaped("".join(str(text) for text in item.itertext()))
                for item in tree("xl/sharedStrings.xml").iter(f"{_SPACE}si")
            ]
        names = [str(item.get("name")) for item in tree("xl/workbook.xml").iter(f"{_SPACE}sheet")]
        return {
            name: _rows(tree(f"xl/worksheets/sheet{index}.xml"), texts)
            for index, name in enumerate(names, start=1)
        }


def _rows(sheet: etree._Element, texts: Sequence[str]) -> list[list[str | float | None]]:
    if sheet.find(f".//{_SPACE}f") is not None or sheet.find(f".//{_SPACE}hyperlink") is not None:
        raise ValueError("it holds a formula or a link")
    rows: list[list[str | float | None]] = []
    for row in sheet.iter(f"{_SPACE}row"):
        while len(rows) < int(row.get("r", "0")):
            rows.append([])
        cells = rows[-1]
        for cell in row.iter(f"{_SPACE}c"):
            column = _column(cell.get("r", "A1"))
            cells += [None] * (column + 1 - len(cells))
            value = cell.findtext(f"{_SPACE}v")
            if value is not None:
                cells[column] = texts[int(value)] if cell.get("t") == "s" else float(value)
    return rows


def _column(place: str) -> int:
    """Return the number of a column, from zero, of a place such as ``AB12``."""
    number = 0
    for sign in place:
        if sign.isalpha():
            number = 26 * number + ord(sign) - 64
    return number - 1


def _unescaped(text: str) -> str:
    """Return text without the one escape that the writer uses for itself."""
    return _ESCAPED.sub(r"\1", text)


def _plain(cell: Cell) -> str | float | None:
    if isinstance(cell, Number):
        # The writer keeps 16 digits of a number.
        return float(f"{cell.value:.16G}")
    if isinstance(cell, int):
        return float(cell)
    return cell or None


def _preview(jobs: Sequence[ReportData], profile: Profile) -> tuple[Table, ...]:
    (data,) = jobs
    front = tuple((line,) for line in _front_lines(data)[1:])
    return (Table(_FRONT, (data.part.word.value,), front), *_tables(data, profile))


def _tables(data: ReportData, profile: Profile) -> tuple[Table, ...]:
    units = profile.units
    return (
        head_table(data),
        report_table(data, units),
        features_table(data, units),
        points_table(data, units),
    )


def _width(table: Table, column: int) -> int:
    longest = max((len(_shown(row[column])) for row in table.rows), default=0)
    return min(max(longest, len(table.columns[column])) + 2, _WIDEST)


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
    contents=_contents,
    differences=_differences,
    preview=_preview,
    batch=False,
)

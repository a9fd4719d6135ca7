"""Independent reader of workbooks for verification: from the archive, cell by cell."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Sequence

from lxml import etree

_SPACE = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
_ESCAPED = re.compile(r"_x005F(_x[0-9A-Fa-f]{4}_)")
_MOST_BYTES = 200_000_000
"""Limit of a sheet, above any that was written here."""


def read_workbook(content: bytes) -> dict[str, list[list[str | float | None]]]:
    """Return the cells of every sheet; ValueError for formulas, links or too large books."""
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
                _ESCAPED.sub(r"\1", "".join(str(text) for text in item.itertext()))
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
    """Return the number of a column, from zero, of a cell such as ``AB12``."""
    number = 0
    for sign in place:
        if sign.isalpha():
            number = 26 * number + ord(sign) - 64
    return number - 1

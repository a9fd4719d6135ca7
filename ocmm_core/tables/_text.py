"""Text of a file: encodings, and formats that are not tables of points."""

from __future__ import annotations

import re
from pathlib import Path

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError

LARGEST_BYTES = 100_000_000
_MOST_LINES = 1_100_000
_FOREIGN = (
    (b"PK\x03\x04", "a workbook or an archive", "Save the sheet as CSV."),
    (b"\xd0\xcf\x11\xe0", "an old Excel workbook", "Save the sheet as CSV."),
    (b"%PDF", "a PDF document", "Export the points as text."),
    (b"\x1f\x8b", "compressed", "Unpack it."),
    (b"\x93NUMPY", "an array of NumPy", "Save it with numpy.savetxt."),
    (b"\x89HDF", "an HDF5 file", "Export the points as text."),
    (b"ASTM-E57", "an E57 point cloud", "Export the points as text or PLY."),
    (b"LASF", "a LAS point cloud", "Export the points as text or PLY."),
    (b"ISO-10303-21", "a STEP model", "Export the points as text."),
    (b"# vtk DataFile", "a VTK data set", "Export the points as text or PLY."),
    (b"{", "a JSON document", "Export the points as text."),
    (b"<", "an XML document", "Export the points as text."),
)
_STRANGE = re.compile("([^\0-\x7f])(?!\\1)[^\0-\x7f]{3}")
"""Four different signs that are not ASCII in a row."""
_RARE = re.compile("[\u0192\u02c6\u02dc\u2020\u2021\u2039\u203a]")
_GRID = ("ncols", "nrows", "cellsize", "dsaa")


def decoded(content: bytes) -> str:
    """Decode UTF-8, Windows-1252, or UTF-16/32 with byte order mark; or UnicodeDecodeError."""
    if content.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        return content.decode("utf-32")
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16")
    if b"\0" in content:
        raise UnicodeDecodeError("utf-8", content[:1], 0, 1, "it contains NUL bytes")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        text = content.decode("cp1252")
        # Texts of other scripts look like runs of accented letters, or have letters of no language.
        if _STRANGE.search(text) or len(_RARE.findall(text)) > 1:
            raise UnicodeDecodeError("cp1252", content[:1], 0, 1, "another encoding") from error
        return text


def text_lines(path: Path, content: bytes) -> list[str]:
    """Return the lines of a table (LF, CR LF or CR); InputError if it is not text."""
    for mark, what, remedy in _FOREIGN:
        if content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(mark):
            raise InputError("table.format", f"{path}: the file is {what}.", remedy)
    try:
        text = decoded(content)
    except UnicodeDecodeError as error:
        raise InputError(
            "table.not_text",
            f"{path}: the file is not text in UTF-8, in UTF-16 with its mark, or in Windows-1252.",
            "Save the table as text in UTF-8.",
        ) from error
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if text.count("\n") > _MOST_LINES:
        raise InputError(
            "table.lines",
            f"{path}: more than {_MOST_LINES:,} lines.",
            "Give a file with the points of one feature.",
        )
    lines = text.split("\n")
    first = lines[0].strip().lower().split()
    if first and first[0] in _GRID:
        raise InputError(
            "table.format",
            f"{path}, line 1: {first[0]!r} starts a grid of heights, not rows of points.",
            "Export the points as x, y and z.",
        )
    if lines and not lines[-1]:
        lines.pop()
    return lines


def bytes_of(path: Path, most: int = LARGEST_BYTES) -> bytes:
    """Return the content of a table; InputError if it cannot be read."""
    return read_bytes(path, most)

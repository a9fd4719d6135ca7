"""Vertices of PLY, OBJ, OFF, STL and PCD files, as their formats prescribe."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ocmm_core.documents import shortened
from ocmm_core.errors import InputError
from ocmm_core.geometry import Points3
from ocmm_core.tables._account import SkippedRows
from ocmm_core.tables._text import decoded

_PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_OBJ = re.compile(rb"^[ \t]*(?:vn|vt|f|usemtl|mtllib|o|g|s)[ \t]+\S", re.MULTILINE)
_STL_RECORD = 50


@dataclass(frozen=True, slots=True)
class Mesh:
    """Vertices of a file."""

    form: str
    points: Points3
    """(n, 3), in the unit of the file."""
    comments: tuple[tuple[int, str], ...] = ()
    lines: tuple[int, int] = (0, 0)
    skipped: tuple[SkippedRows, ...] = ()


class _FormatError(Exception):
    """A part of the file that contradicts its format."""


def read_mesh(path: Path, content: bytes) -> Mesh | None:
    """Return the vertices of a mesh or cloud, None for other formats; InputError if invalid."""
    head = content[:4096].lstrip(b"\xef\xbb\xbf")
    suffix = path.suffix.lower()
    read = None
    if re.match(rb"ply\r?\n", head):
        read = _ply
    elif re.match(rb"(?:ST)?C?N?(?:4|n)?OFF\b", head):
        read = _off
    elif re.match(rb"(?:#.*\r?\n)*VERSION\s+\.?\d.*\r?\nFIELDS\s", head):
        read = _pcd
    elif suffix == ".stl" or re.match(rb"\s*solid\b[\s\S]*?\bfacet\s+normal", head):
        read = _stl
    elif suffix == ".obj" or (re.search(rb"^[ \t]*v[ \t]+[-+.\d]", head, re.MULTILINE)
                              and _OBJ.search(content)):  # fmt: skip
        read = _obj
    elif suffix in (".ply", ".off", ".pcd"):
        raise _refused(path, f"does not start as a {suffix[1:].upper()} file")
    if read is None:
        return None
    try:
        return read(content)
    except _FormatError as error:
        raise _refused(path, str(error)) from error
    except (ValueError, IndexError, KeyError, UnicodeDecodeError, OverflowError) as error:
        raise _refused(path, "is damaged or incomplete") from error


def _refused(path: Path, what: str) -> InputError:
    return InputError("table.mesh", f"{path}: the file {what}.", "Export the file again.")


def _whole(name: str, first: int, last: int, why: str) -> SkippedRows:
    return SkippedRows(first, max(first, last), why, name)


def _finite(
    form: str,
    points: Points3,
    more: Sequence[SkippedRows] = (),
    comments: Sequence[tuple[int, str]] = (),
    lines: tuple[int, int] = (0, 0),
) -> Mesh:
    """Return a mesh without vertices that are not numbers, with an entry for them."""
    good = np.isfinite(points).all(axis=1)
    skipped = [
        *more,
        *(SkippedRows(line, line, "is a comment", shortened(text)) for line, text in comments),
    ]
    if not good.all():
        count = int(np.sum(~good))
        skipped.append(
            _whole(f"{count} of {len(points)} points", 1, len(points), "coordinates missing (NaN)")
        )
    found = np.ascontiguousarray(points[good], dtype=np.float64)
    return Mesh(form, found, tuple(comments), lines, tuple(skipped))


def _numbers(line: str) -> list[float]:
    words = line.split()
    if not all(re.fullmatch(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|nan|-nan|NaN", word)
               for word in words):  # fmt: skip
        raise _FormatError(f"has a vertex {shortened(line.strip())} that is not numbers")
    return [float(word) for word in words]


def _ply(content: bytes) -> Mesh:
    end = re.search(rb"\nend_header\r?\n", content)
    if end is None:
        raise _FormatError("has no end_header")
    head = content[: end.start()].decode("latin-1").splitlines()
    form, elements, comments = "", list[tuple[str, int, list[tuple[str, str]]]](), []
    for number, line in enumerate(head, start=1):
        words = line.split()
        if line.startswith(("comment", "obj_info")):
            comments.append((number, line.partition(" ")[2]))
        elif words[:1] == ["format"]:
            form = words[1]
        elif words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            kind = "list" if words[1] == "list" else _PLY_TYPES[words[1]]
            elements[-1][2].append((words[-1], kind))
    vertices = [place for place, one in enumerate(elements) if one[0] == "vertex"]
    if len(vertices) != 1:
        raise _FormatError("has no element 'vertex', or several")
    place = vertices[0]
    _, count, properties = elements[place]
    names = [name for name, _ in properties]
    kinds = [kind for _, kind in properties]
    if not {"x", "y", "z"} <= set(names) or "list" in kinds or len(set(names)) < len(names):
        raise _FormatError("has vertices without x, y and z")
    lines = (0, 0)
    if form == "ascii":
        rest = content[end.end() :].decode("latin-1").splitlines()
        start = sum(one[1] for one in elements[:place])
        rows = [_numbers(line) for line in rest[start : start + count]]
        if len(rows) != count or any(len(row) != len(names) for row in rows):
            raise _FormatError(
                f"declares {count} vertices with {len(names)} numbers, but has others"
            )
        table = np.array(rows).reshape(count, len(names))
        points = table[:, [names.index(axis) for axis in "xyz"]]
        first = len(head) + 2 + start
        lines = (first, first + count - 1)
    elif form in ("binary_little_endian", "binary_big_endian"):
        order = "<" if form == "binary_little_endian" else ">"
        start = end.end()
        for _, number, before in elements[:place]:
            if any(kind == "list" for _, kind in before):
                raise _FormatError("has lists before its vertices")
            start += number * np.dtype([(n, order + k) for n, k in before]).itemsize
        kind_of = np.dtype([(name, order + kind) for name, kind in properties])
        if len(content) < start + count * kind_of.itemsize:
            raise _FormatError(f"declares {count} vertices, but is shorter")
        raw = np.frombuffer(content, kind_of, count, start)
        points = np.column_stack([raw[axis].astype(np.float64) for axis in "xyz"])
    else:
        raise _FormatError(f"has the unknown format {shortened(form)}")
    others = [
        _whole(name, 1, max(number, 1), f"{number} elements {name!r} are not points")
        for name, number, _ in elements if name != "vertex" and number
    ]  # fmt: skip
    return _finite("PLY", points, others, comments=comments, lines=lines)


def _obj(content: bytes) -> Mesh:
    points, comments, others = [], [], Counter[str]()
    seen: dict[str, list[int]] = {}
    lines: list[int] = []
    for number, line in enumerate(decoded(content).splitlines(), start=1):
        text, sign, comment = line.partition("#")
        if sign:
            comments.append((number, comment))
        words = text.split()
        if not words:
            continue
        if words[0] != "v":
            others[words[0]] += 1
            seen.setdefault(words[0], [number, number])[1] = number
            continue
        values = _numbers(" ".join(words[1:]))
        # Six numbers are a colour behind the place, four a weight.
        if len(values) not in (3, 4, 6, 7) or (len(values) == 4 and values[3] != 1.0):
            raise _FormatError(f"has a vertex {shortened(text.strip())} in line {number}")
        points.append(values[:3])
        lines.append(number)
    skipped = [
        _whole(word, seen[word][0], seen[word][1], f"{count} rows {word!r} are not vertices")
        for word, count in others.items()
    ]
    ends = (lines[0], lines[-1]) if lines else (0, 0)
    return _finite("OBJ", np.array(points).reshape(-1, 3), skipped, comments=comments, lines=ends)


def _off(content: bytes) -> Mesh:
    comments, rows = [], list[tuple[int, str]]()
    for number, line in enumerate(decoded(content).splitlines(), start=1):
        text, sign, comment = line.partition("#")
        if sign:
            comments.append((number, comment))
        if text.strip():
            rows.append((number, text.strip()))
    kind = re.match(r"(?:ST)?C?N?OFF(?=\s|$)", rows[0][1])
    if kind is None or "BINARY" in rows[0][1]:
        raise _FormatError(f"is of the kind {shortened(rows[0][1])}, which is not read")
    rest = rows[0][1][kind.end() :].strip()
    rows = ([(rows[0][0], rest)] if rest else []) + rows[1:]
    count, faces = map(int, rows[0][1].split()[:2])
    vertices = rows[1 : count + 1]
    found = [_numbers(text) for _, text in vertices]
    widths = {len(row) for row in found}
    more = (3 if "N" in kind[0] else 0) + (2 if "ST" in kind[0] else 0)
    wanted = {3 + more} if "C" not in kind[0].removeprefix("ST") else {6 + more, 7 + more}
    if len(found) != count or not widths <= wanted or len(rows) < count + 1 + faces:
        raise _FormatError(f"declares {count} vertices and {faces} faces, but has others")
    skipped = []
    if len(rows) > count + 1:
        first, last = rows[count + 1][0], rows[-1][0]
        skipped.append(_whole("faces", first, last, f"{faces} faces are not points"))
    lines = (vertices[0][0], vertices[-1][0]) if vertices else (0, 0)
    points = np.array([row[:3] for row in found]).reshape(-1, 3)
    return _finite("OFF", points, skipped, comments=comments, lines=lines)


def _stl(content: bytes) -> Mesh:
    count = int.from_bytes(content[80:84], "little") if len(content) >= 84 else -1
    if len(content) == 84 + _STL_RECORD * count:
        raw = np.frombuffer(
            content, np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]), count, 84
        )
        corners = raw["v"].reshape(-1, 3).astype(np.float64)
    elif content.lstrip().startswith(b"solid"):
        text = decoded(content)
        rows = re.findall(r"^\s*vertex\s+(.*)$", text, re.MULTILINE | re.IGNORECASE)
        corners = np.array([_numbers(row) for row in rows]).reshape(-1, 3)
        if len(corners) != 3 * len(re.findall(r"^\s*facet\b", text, re.MULTILINE | re.IGNORECASE)):
            raise _FormatError("has facets without three vertices")
    else:
        raise _FormatError("is neither binary nor text STL, or is incomplete")
    _, first = np.unique(corners, axis=0, return_index=True)
    points = corners[np.sort(first)]
    again = len(corners) - len(points)
    skipped = [_whole("vertex", 1, len(corners), f"{again} corners are shared")] if again else []
    return _finite("STL", points, skipped)


def _pcd(content: bytes) -> Mesh:
    end = re.search(rb"^DATA\s+(\w+)[ \t]*\r?\n", content, re.MULTILINE)
    if end is None:
        raise _FormatError("has no DATA line")
    comments, head = [], dict[str, list[str]]()
    lines = content[: end.end()].decode("latin-1").splitlines()
    for number, line in enumerate(lines, start=1):
        if line.startswith("#"):
            comments.append((number, line))
        elif line.split():
            head[line.split()[0]] = line.split()[1:]
    names, count = head["FIELDS"], int(head["POINTS"][0])
    counts = [int(word) for word in head.get("COUNT", ["1"] * len(names))]
    if not {"x", "y", "z"} <= set(names) or len(counts) != len(names):
        raise _FormatError("has no fields x, y and z")
    turned = head.get("VIEWPOINT", [])
    skipped = []
    if turned and [float(word) for word in turned] != [0, 0, 0, 1, 0, 0, 0]:
        skipped.append(_whole("VIEWPOINT", 1, 1, "the pose of the sensor is not applied"))
    ends = (0, 0)
    if end[1] == b"ascii":
        starts = [sum(counts[:place]) for place in range(len(names))]
        rows = [_numbers(line) for line in content[end.end() :].decode("latin-1").splitlines()
                if line.strip()]  # fmt: skip
        if len(rows) != count or any(len(row) != sum(counts) for row in rows):
            raise _FormatError(f"declares {count} points, but has {len(rows)}")
        points = np.array(rows).reshape(count, sum(counts))[
            :, [starts[names.index(axis)] for axis in "xyz"]
        ]
        ends = (len(lines) + 1, len(lines) + count)
    elif end[1] == b"binary":
        kinds = [f"<{kind.lower()}{size}" for kind, size in
                 zip(head["TYPE"], head["SIZE"], strict=True)]  # fmt: skip
        of_row = np.dtype(
            [(f"{place}", kind, (many,)) for place, (kind, many) in
             enumerate(zip(kinds, counts, strict=True))]
        )  # fmt: skip
        if len(content) < end.end() + count * of_row.itemsize:
            raise _FormatError(f"declares {count} points, but is shorter")
        raw = np.frombuffer(content, of_row, count, end.end())
        points = np.column_stack(
            [raw[str(names.index(axis))][:, 0].astype(np.float64) for axis in "xyz"]
        )
    else:
        raise _FormatError(f"has {end[1].decode()} data, which is not read")
    return _finite("PCD", points, skipped, comments=comments, lines=ends)

"""Draw the architecture from the imports, and write the table of the rooms into its page.

Run ``python -m docs.images.make_architecture`` after rooms, their imports or the first line of a
face have changed; `tests/core/test_architecture.py` compares. Files are read as text: nothing of
the product is imported. No text is measured, so that the picture is the same on every machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from itertools import pairwise
from pathlib import Path

from docs.images.architecture_layers import Graph, layered, levels, reduced
from docs.images.architecture_rooms import Rooms, read_rooms, with_table

ROOT = Path(__file__).resolve().parents[2]
PICTURE = ROOT / "docs" / "images" / "architecture.svg"
PAGE = ROOT / "docs" / "developer" / "architecture.md"

_WIDTH = 1000
_MARGIN = 16
# Arrows that pass rows run to the right of all houses.
_GUTTER = 44
_LANE = 12
_GAP = 34
_BETWEEN = 16
_BOX = 26
_PASS = 10
_SPACE = 8
_COLUMNS_APART = 30
_HEAD = 24
_LINE = 16
# Width of a character of 12 px, px, with some more: that of names is fixed, that of texts a mean.
_NAME = 7.4
_TEXT = 6.1
_BESIDE = "#fff6e0"
_ENTRANCE = "#e8f1fb"
_CHAIN = "#f3f5f7"
_FILL = {"simulation": _BESIDE, "composition": _ENTRANCE, "cli": _ENTRANCE, "ocmm_gui": _ENTRANCE}


@dataclass(frozen=True, slots=True)
class Band:
    """A house as it is drawn: its place (px), its name, and the lines of its summary."""

    house: str
    x: float
    y: float
    width: float
    height: float
    lines: tuple[str, ...]


def main() -> None:
    """Write picture and table."""
    rooms = read_rooms(ROOT)
    PICTURE.write_text(picture(rooms), encoding="utf-8")
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8"), rooms), encoding="utf-8")


def picture(rooms: Rooms) -> str:
    """Return the picture as SVG."""
    arrows = reduced(rooms.houses)
    bands, bottom = _bands(rooms, arrows)
    height = bottom + _GAP + 58
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height:.0f}" '
        f'width="{_WIDTH}" height="{height:.0f}" font-family="Helvetica, Arial, sans-serif">',
        "<title>The houses of OCMM and their rooms; an arrow points to what is imported</title>",
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0.5 8 4 0 7.5z" '
        'fill="#50606e"/></marker></defs>',
        f'<rect width="{_WIDTH}" height="{height:.0f}" fill="#ffffff"/>',
        _text(_MARGIN, 22, "An arrow points from who imports to what is imported; arrows that "
              "follow from others are left out.", "#50606e"),
        _text(_MARGIN, 38, "The data flow upwards, and to the right inside a house.", "#50606e"),
    ]  # fmt: skip
    for band in bands:
        parts += _drawn(rooms, band)
    parts += _arrows({band.house: band for band in bands}, arrows)
    parts += _for_everybody(rooms.common, bottom + _GAP)
    return "\n".join([*parts, "</svg>", ""])


def _bands(rooms: Rooms, arrows: Graph) -> tuple[list[Band], float]:
    """Place the packages, the last layer on top; return them and the end of the lowest one."""
    of = levels(rooms.houses)
    passing = {one for name in arrows for one in arrows[name] if of[name] - of[one] > 1}
    bands: list[Band] = []
    y = 56.0
    for level in range(max(of.values()), -1, -1):
        # Packages reached from the gutter are on the right.
        row = sorted((n for n in of if of[n] == level), key=lambda n: (n in passing, n))
        for part in _lines_of(rooms, row):
            placed = _row(rooms, part, y)
            bands += placed
            y = placed[0].y + placed[0].height + _GAP
    return bands, y - _GAP


def _lines_of(rooms: Rooms, row: list[str]) -> list[list[str]]:
    """Part a layer into lines that are no wider than the picture."""
    found: list[list[str]] = [[]]
    room = _WIDTH - 2 * _MARGIN - _GUTTER
    for name in row:
        used = sum(_least_width(rooms, one) + _BETWEEN for one in found[-1])
        if found[-1] and used + _least_width(rooms, name) > room:
            found.append([])
        found[-1].append(name)
    return found


def _row(rooms: Rooms, names: list[str], y: float) -> list[Band]:
    least = [_least_width(rooms, name) for name in names]
    room = _WIDTH - 2 * _MARGIN - _GUTTER - _BETWEEN * (len(names) - 1)
    more = (room - sum(least)) / len(names)
    lines = [
        _wrapped(rooms.summaries[name].replace("`", ""), width + more - 24)
        for name, width in zip(names, least, strict=True)
    ]
    heights = [
        _HEAD + _LINE * len(text) + 6 + _inner_height(rooms, name)
        for name, text in zip(names, lines, strict=True)
    ]
    bands = []
    x = float(_MARGIN)
    for name, width, text in zip(names, least, lines, strict=True):
        bands.append(Band(name, x, y, width + more, max(heights), text))
        x += width + more + _BETWEEN
    return bands


def _least_width(rooms: Rooms, name: str) -> float:
    return max(280.0, sum(w + _COLUMNS_APART for w in _column_widths(rooms, name)) + 24)


def _column_widths(rooms: Rooms, name: str) -> list[float]:
    inside = rooms.inside[name]
    if len(inside) < 2:
        return []
    return [
        max((_width(_label(name, one)) for one in layer if one in inside), default=20.0)
        for layer in layered(inside).layers
    ]


def _inner_height(rooms: Rooms, name: str) -> float:
    inside = rooms.inside[name]
    if len(inside) < 2:
        return 4.0
    return max(_stack(layer, inside) for layer in layered(inside).layers) + 14


def _stack(layer: tuple[str, ...], inside: Graph) -> float:
    return sum(_BOX if one in inside else _PASS for one in layer) + _SPACE * (len(layer) - 1)


def _label(house: str, room: str) -> str:
    return room.removeprefix(f"{house}.").removeprefix("ocmm_core.")


def _width(label: str) -> float:
    return len(label) * _NAME + 16


def _wrapped(text: str, width: float) -> tuple[str, ...]:
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and len(longer) * _TEXT > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return tuple(lines)


def _drawn(rooms: Rooms, band: Band) -> list[str]:
    """Draw a package: its name, its purpose, and its subpackages from the first to the last."""
    fill = _FILL.get(band.house.rpartition(".")[2], _CHAIN)
    parts = [
        f'<rect x="{band.x:.1f}" y="{band.y:.1f}" width="{band.width:.1f}" '
        f'height="{band.height:.1f}" rx="6" fill="{fill}" stroke="#b4c0ca"/>',
        _name(band.x + 12, band.y + 20, band.house, 'font-weight="bold" font-size="13"'),
    ]
    for number, line in enumerate(band.lines):
        parts.append(_text(band.x + 12, band.y + _HEAD + 13 + _LINE * number, line, "#50606e"))
    inside = rooms.inside[band.house]
    if len(inside) < 2:
        return parts
    plan = layered(inside)
    top = band.y + _HEAD + _LINE * len(band.lines) + 8
    inner = max(_stack(layer, inside) for layer in plan.layers)
    left: dict[str, tuple[float, float]] = {}
    right: dict[str, tuple[float, float]] = {}
    boxes = []
    x = band.x + 12
    for layer, width in zip(plan.layers, _column_widths(rooms, band.house), strict=True):
        y = top + (inner - _stack(layer, inside)) / 2
        for one in layer:
            tall = _BOX if one in inside else _PASS
            left[one], right[one] = (x, y + tall / 2), (x + width, y + tall / 2)
            if one in inside:
                boxes += _box(x, y, width, _label(band.house, one))
            y += tall + _SPACE
        x += width + _COLUMNS_APART
    for path in plan.paths:
        data = f"M{_point(left[path[0]])}"
        for one, other in pairwise(path):
            (x0, y0), (x1, y1) = left[one], right[other]
            middle = (x0 + x1) / 2
            data += f" C{middle:.1f} {y0:.1f} {middle:.1f} {y1:.1f} {x1:.1f} {y1:.1f}"
            if other != path[-1]:
                data += f" L{_point(left[other])}"
        parts.append(_arrow(data))
    return parts + boxes


def _arrows(bands: dict[str, Band], arrows: Graph) -> list[str]:
    """Draw the arrows between houses: straight to the next row, by the gutter past others."""
    parts = []
    rows = sorted({band.y for band in bands.values()})
    lane = _WIDTH - _MARGIN - _GUTTER + _LANE
    for name in sorted(arrows):
        for one in sorted(arrows[name]):
            upper, lower = bands[name], bands[one]
            end = lower.y - 1
            begin = upper.y + upper.height
            if rows.index(lower.y) - rows.index(upper.y) > 1:
                x0, x1 = upper.x + upper.width, lower.x + lower.width
                y0, y1 = upper.y + upper.height / 2, lower.y + 10
                parts.append(_arrow(f"M{x0:.1f} {y0:.1f} H{lane:.1f} V{y1:.1f} H{x1 + 1:.1f}"))
                lane += _LANE
                continue
            shared = max(upper.x, lower.x), min(upper.x + upper.width, lower.x + lower.width)
            if shared[1] - shared[0] > 2 * _BETWEEN:
                x = (shared[0] + shared[1]) / 2
                parts.append(_arrow(f"M{x:.1f} {begin:.1f} V{end:.1f}"))
                continue
            # It turns in the gap between the rows.
            x0 = upper.x + upper.width / 2
            x1 = lower.x + (lower.width - 40 if lower.x < upper.x else 40)
            turn = (upper.y + upper.height + end) / 2
            parts.append(_arrow(f"M{x0:.1f} {begin:.1f} V{turn:.1f} H{x1:.1f} V{end:.1f}"))
    return parts


def _for_everybody(rooms: tuple[str, ...], y: float) -> list[str]:
    parts = [_text(_MARGIN, y + 12, "Rooms of one file in ocmm_core, for everybody:", "#50606e")]
    x = float(_MARGIN)
    for room in rooms:
        label = room.rpartition(".")[2]
        parts += _box(x, y + 22, _width(label), label)
        x += _width(label) + 10
    return parts


def _box(x: float, y: float, width: float, label: str) -> list[str]:
    return [
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{_BOX}" rx="4" '
        'fill="#ffffff" stroke="#8494a2"/>',
        _name(x + width / 2, y + 17, label, 'text-anchor="middle" font-size="12"'),
    ]


def _name(x: float, y: float, text: str, looks: str) -> str:
    family = "DejaVu Sans Mono, Menlo, Consolas, monospace"
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-family="{family}" {looks} '
        f'fill="#1c2730">{escape(text)}</text>'
    )


def _text(x: float, y: float, text: str, colour: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="12" fill="{colour}">{escape(text)}</text>'


def _arrow(data: str) -> str:
    return (
        f'<path d="{data}" fill="none" stroke="#50606e" stroke-width="1.3" marker-end="url(#tip)"/>'
    )


def _point(place: tuple[float, float]) -> str:
    return f"{place[0]:.1f} {place[1]:.1f}"


if __name__ == "__main__":
    main()

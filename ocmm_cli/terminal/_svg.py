"""Pictures as files, without a library: plots as SVG text, 16 bit images as PNG and PGM.

Histograms, points in space, maps of the tip's error and deflection lines of a probe; images by
ISO/IEC 15948 and netpbm.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from xml.sax.saxutils import escape

import numpy as np

from ocmm_core.calibration.probe_design import TipMap
from ocmm_core.geometry import Float, Points3, rotation_xyz
from ocmm_core.measuring import Mechanics, colour_at

WIDTH, HEIGHT = 760, 480
_LEFT, _RIGHT, _TOP, _BOTTOM = 70, 20, 60, 60
_COLOURS = ("#2a78d6", "#d4552a", "#1f9d72", "#8b5fbf", "#b58900", "#c0397b", "#4a6572", "#7a9a01")
_TEXT = 'font-family="sans-serif" fill="#333"'
_VIEW = rotation_xyz(-np.radians(65.0), 0.0, 0.0) @ rotation_xyz(0.0, 0.0, np.radians(35.0))
"""Oblique view from above; x to the right, y up on the page."""


def histogram(values: Float, title: str, subtitle: str, x_label: str, bins: int = 50) -> str:
    top = nice_limit(float(values.max()))
    counts, edges = np.histogram(values, bins=bins, range=(0.0, top))
    most = nice_limit(float(counts.max()))

    def at_x(value: float) -> float:
        return _LEFT + value / top * (WIDTH - _LEFT - _RIGHT)

    def at_y(value: float) -> float:
        return HEIGHT - _BOTTOM - value / most * (HEIGHT - _TOP - _BOTTOM)

    parts = [*_grid(top, most, at_x(0.0), at_y(0.0), at_x(top), at_y(most))]
    for count, low, high in zip(counts, edges[:-1], edges[1:], strict=True):
        if count:
            parts.append(
                f'<rect x="{at_x(low) + 0.5:.1f}" y="{at_y(count):.1f}" '
                f'width="{at_x(high) - at_x(low) - 1.0:.1f}" '
                f'height="{at_y(0.0) - at_y(count):.1f}" fill="{_COLOURS[0]}"/>'
            )
    parts.append(label(0.5 * WIDTH, HEIGHT - 14, x_label, 15, "middle"))
    parts.append(
        f'<text transform="translate(20 {0.5 * HEIGHT:.0f}) rotate(-90)" font-size="15" '
        f'text-anchor="middle" {_TEXT}>runs</text>'
    )
    return page(title, subtitle, parts)


def points_in_space(
    groups: Sequence[Points3], names: Sequence[str], title: str, subtitle: str
) -> str:
    """Return groups of points (n, 3), mm, in an oblique view, with a cross at the origin."""
    everything = np.concatenate([*groups, np.zeros((1, 3))])
    low, high = everything.min(axis=0), everything.max(axis=0)
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    box = (low + corners * (high - low)) @ _VIEW.T
    size = np.ptp(box, axis=0)[:2]
    scale = min((WIDTH - 180) / size[0], (HEIGHT - _TOP - 40) / size[1])
    middle = 0.5 * (box.min(axis=0) + box.max(axis=0))

    def place(points: Points3) -> Float:
        seen = (points @ _VIEW.T - middle)[..., :2] * scale
        centre = np.array([0.5 * (WIDTH - 100), 0.5 * (HEIGHT + _TOP - 20)])
        placed: Float = centre + seen * np.array([1.0, -1.0])
        return placed

    parts = []
    for first in range(8):
        for bit in (1, 2, 4):
            if not first & bit:
                (x1, y1), (x2, y2) = place(low + corners[[first, first | bit]] * (high - low))
                parts.append(
                    f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="#ccc"/>'
                )
    for axis, name in enumerate("XYZ"):
        ends = np.stack([low, low])
        ends[1, axis] = high[axis]
        x, y = place(ends.mean(axis=0))
        words = f"{name} {low[axis]:.0f} to {high[axis]:.0f} mm"
        parts.append(label(x, y + 16, words, 12, "middle"))
    for number, (group, name) in enumerate(zip(groups, names, strict=True)):
        colour = _COLOURS[number % len(_COLOURS)]
        dots = "".join(f"M{x:.1f} {y:.1f}h.1" for x, y in place(group))
        parts.append(
            f'<path d="{dots}" stroke="{colour}" stroke-width="2" stroke-linecap="round"/>'
        )
        y = 80 + 22 * number
        parts.append(f'<circle cx="{WIDTH - 90}" cy="{y - 4}" r="5" fill="{colour}"/>')
        parts.append(label(WIDTH - 78, y, name, 13, "start"))
    x, y = place(np.zeros(3))
    parts.append(f'<path d="M{x - 7:.1f} {y:.1f}h14m-7 -7v14" stroke="#000" stroke-width="2"/>')
    parts.append(label(x + 10, y + 14, "tip", 13, "start"))
    return page(title, subtitle, parts)


def _grid(
    top: float, most: float, left: float, bottom: float, right: float, upper: float
) -> Iterator[str]:
    for step in range(6):
        x, y = left + step / 5 * (right - left), bottom + step / 5 * (upper - bottom)
        yield f'<path d="M{left:.1f} {y:.1f}H{right:.1f}M{x:.1f} {bottom:.1f}v5" stroke="#ccc"/>'
        yield label(x, bottom + 20, f"{step / 5 * top:g}", 13, "middle")
        yield label(left - 8, y + 4, f"{step / 5 * most:g}", 13, "end")


def label(x: float, y: float, words: str, size: int, anchor: str) -> str:
    """Return a text element; ``anchor`` is start, middle or end."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" {_TEXT}>'
        f"{escape(words)}</text>"
    )


def page(title: str, subtitle: str, parts: Sequence[str]) -> str:
    """Return the whole picture with its title above the parts."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" viewBox="0 0 '
        f'{WIDTH} {HEIGHT}" fill="none"><rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>'
    )
    words = [label(20, 26, title, 18, "start"), label(20, 46, subtitle, 13, "start")]
    return "\n".join([head, *words, *parts, "</svg>", ""])


def nice_limit(largest: float) -> float:
    """Return a round number that is not below ``largest`` and divides well by five."""
    if not largest > 0.0:
        return 1.0
    size = 10.0 ** np.floor(np.log10(largest))
    return float(next(step * size for step in (1.0, 1.5, 2.0, 2.5, 3, 4, 5, 7.5, 10.0)
                      if step * size >= largest * (1.0 - 1e-12)))  # fmt: skip


_MAP_LEFT, _MAP_RIGHT, _MAP_TOP, _MAP_BOTTOM = 90, 130, 66, 66
_UNSEEN = "#bbbbbb"


def tip_map(found: TipMap, limits: tuple[float, float], subtitle: str) -> str:
    """Return a map as coloured cells, with its scale."""
    rows, columns = found.space_um.shape
    wide = (WIDTH - _MAP_LEFT - _MAP_RIGHT) / columns
    high = (HEIGHT - _MAP_TOP - _MAP_BOTTOM) / rows
    low, top = limits
    parts = []
    for row in range(rows):
        for column in range(columns):
            value = float(found.space_um[row, column])
            share = (value - low) / (top - low)
            colour = colour_at(share) if np.isfinite(value) else _UNSEEN
            parts.append(
                f'<rect x="{_MAP_LEFT + column * wide:.1f}" '
                f'y="{HEIGHT - _MAP_BOTTOM - (row + 1) * high:.1f}" '
                f'width="{wide + 0.2:.1f}" height="{high + 0.2:.1f}" fill="{colour}"/>'
            )
    for share in (0.0, 0.5, 1.0):
        x = _MAP_LEFT + (0.5 + share * (columns - 1)) * wide
        y = HEIGHT - _MAP_BOTTOM - (0.5 + share * (rows - 1)) * high
        parts.append(
            label(x, HEIGHT - _MAP_BOTTOM + 20, f"{_at(found.columns, share):.0f}", 13, "middle")
        )
        parts.append(label(_MAP_LEFT - 8, y + 4, f"{_at(found.rows, share):.0f}", 13, "end"))
    parts.append(label(_MAP_LEFT + 0.5 * columns * wide, HEIGHT - 14, found.names[0], 15, "middle"))
    parts.append(
        f'<g transform="translate(24 {0.5 * (HEIGHT + _MAP_TOP - _MAP_BOTTOM):.0f}) rotate(-90)">'
        f"{label(0, 0, found.names[1], 15, 'middle')}</g>"
    )
    parts += _scale(limits)
    return page(f"Uncertainty of the tip. {found.title}", subtitle, parts)


def bending(found: Mechanics, title: str) -> str:
    """Return the sag of a probe, and its deflection by a force on the ball."""
    left, right = _MAP_LEFT, WIDTH - 30
    length = float(found.x_mm[-1])
    parts = []
    for index, (line, words) in enumerate(
        (
            (found.sag_line_nm, "held level: sag / nm"),
            (found.side_line_nm, "1 N on the ball, across the panel: movement / nm"),
        )
    ):
        top, bottom = 76 + 195 * index, 226 + 195 * index
        least, most = float(min(line.min(), 0.0)), float(max(line.max(), 0.0))
        span = max(most - least, 1e-9)
        dots = [
            f"{left + x / length * (right - left):.1f},"
            f"{bottom - (y - least) / span * (bottom - top):.1f}"
            for x, y in zip(found.x_mm[::8], line[::8], strict=True)
        ]
        zero = bottom + least / span * (bottom - top)
        parts.append(f'<path d="M{left} {zero:.1f}H{right}" stroke="#bbb"/>')
        parts.append(
            f'<polyline points="{" ".join(dots)}" stroke="{colour_at(0.4)}" stroke-width="2.5"/>'
        )
        parts.append(label(left, top - 6, words, 14, "start"))
        parts.append(label(left - 8, top + 5, f"{round(most)}", 13, "end"))
        parts.append(label(left - 8, bottom + 5, f"{round(least)}", 13, "end"))
        for place in sorted(set(found.leds_mm)):
            x = left + place / length * (right - left)
            parts.append(f'<path d="M{x:.1f} {zero - 5:.1f}v10" stroke="#333" stroke-width="2"/>')
        x = left + found.handle_mm / length * (right - left)
        parts.append(f'<path d="M{x:.1f} {top}V{bottom}" stroke="#999" stroke-dasharray="4 4"/>')
        if index:
            parts.append(label(x, HEIGHT - 30, f"hand, {found.handle_mm:.0f} mm", 13, "middle"))
            parts.append(label(left, HEIGHT - 30, "ball, 0", 13, "middle"))
            parts.append(label(right, HEIGHT - 30, f"{length:.0f} mm", 13, "end"))
    return page(title, "Short marks: LEDs. Along: distance from the ball.", parts)


def _at(values: Float, share: float) -> float:
    return float(values[0] + share * (values[-1] - values[0]))


def _scale(limits: tuple[float, float]) -> Iterator[str]:
    steps, top, bottom = 40, _MAP_TOP, HEIGHT - _MAP_BOTTOM
    high = (bottom - top) / steps
    x = WIDTH - _MAP_RIGHT + 24
    for step in range(steps):
        yield (
            f'<rect x="{x}" y="{bottom - (step + 1) * high:.1f}" width="18" '
            f'height="{high + 0.2:.1f}" fill="{colour_at((step + 0.5) / steps)}"/>'
        )
    for share in (0.0, 0.5, 1.0):
        value = limits[0] + share * (limits[1] - limits[0])
        yield label(x + 24, bottom - share * (bottom - top) + 5, f"{value:.1f} µm", 13, "start")
    yield f'<rect x="{x}" y="{bottom + 14}" width="18" height="14" fill="{_UNSEEN}"/>'
    yield label(x + 24, bottom + 26, "not seen", 13, "start")

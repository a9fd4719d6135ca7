"""Small plots as SVG text, without a plotting library: histograms and points in space."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

import numpy as np

from ocmm_core.geometry import Float, Points3, rotation_xyz

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
) -> list[str]:
    parts = []
    for step in range(6):
        x, y = left + step / 5 * (right - left), bottom + step / 5 * (upper - bottom)
        parts.append(
            f'<path d="M{left:.1f} {y:.1f}H{right:.1f}M{x:.1f} {bottom:.1f}v5" stroke="#ccc"/>'
        )
        parts.append(label(x, bottom + 20, f"{step / 5 * top:g}", 13, "middle"))
        parts.append(label(left - 8, y + 4, f"{step / 5 * most:g}", 13, "end"))
    return parts


def label(x: float, y: float, words: str, size: int, anchor: str) -> str:
    """Return a text element; ``anchor`` is start, middle or end."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" {_TEXT}>'
        f"{escape(words)}</text>"
    )


def page(title: str, subtitle: str, parts: Sequence[str]) -> str:
    """Return the whole picture with its title above the parts."""
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}" '
        f'viewBox="0 0 {WIDTH} {HEIGHT}" fill="none">'
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>'
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

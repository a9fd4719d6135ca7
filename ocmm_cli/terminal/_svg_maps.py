"""Maps of the tip's error and deflection lines of a probe, as SVG text."""

from __future__ import annotations

import numpy as np

from ocmm_cli.terminal._svg import HEIGHT, WIDTH, label, page
from ocmm_core.calibration.probe_design import TipMap
from ocmm_core.geometry import Float
from ocmm_core.measuring import Mechanics, colour_at

_LEFT, _RIGHT, _TOP, _BOTTOM = 90, 130, 66, 66
_UNSEEN = "#bbbbbb"


def tip_map(found: TipMap, limits: tuple[float, float], subtitle: str) -> str:
    """Return a map as coloured cells, with its scale."""
    rows, columns = found.space_um.shape
    wide = (WIDTH - _LEFT - _RIGHT) / columns
    high = (HEIGHT - _TOP - _BOTTOM) / rows
    low, top = limits
    parts = []
    for row in range(rows):
        for column in range(columns):
            value = float(found.space_um[row, column])
            share = (value - low) / (top - low)
            colour = colour_at(share) if np.isfinite(value) else _UNSEEN
            parts.append(
                f'<rect x="{_LEFT + column * wide:.1f}" '
                f'y="{HEIGHT - _BOTTOM - (row + 1) * high:.1f}" '
                f'width="{wide + 0.2:.1f}" height="{high + 0.2:.1f}" fill="{colour}"/>'
            )
    for share in (0.0, 0.5, 1.0):
        x = _LEFT + (0.5 + share * (columns - 1)) * wide
        y = HEIGHT - _BOTTOM - (0.5 + share * (rows - 1)) * high
        parts.append(
            label(x, HEIGHT - _BOTTOM + 20, f"{_at(found.columns, share):.0f}", 13, "middle")
        )
        parts.append(label(_LEFT - 8, y + 4, f"{_at(found.rows, share):.0f}", 13, "end"))
    parts.append(label(_LEFT + 0.5 * columns * wide, HEIGHT - 14, found.names[0], 15, "middle"))
    parts.append(
        f'<g transform="translate(24 {0.5 * (HEIGHT + _TOP - _BOTTOM):.0f}) rotate(-90)">'
        f"{label(0, 0, found.names[1], 15, 'middle')}</g>"
    )
    parts += _scale(limits)
    return page(f"Uncertainty of the tip. {found.title}", subtitle, parts)


def bending(found: Mechanics, title: str) -> str:
    """Return the sag of a probe, and its deflection by a force on the ball."""
    left, right = _LEFT, WIDTH - 30
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


def _scale(limits: tuple[float, float]) -> list[str]:
    parts = []
    steps, top, bottom = 40, _TOP, HEIGHT - _BOTTOM
    high = (bottom - top) / steps
    x = WIDTH - _RIGHT + 24
    for step in range(steps):
        parts.append(
            f'<rect x="{x}" y="{bottom - (step + 1) * high:.1f}" width="18" '
            f'height="{high + 0.2:.1f}" fill="{colour_at((step + 0.5) / steps)}"/>'
        )
    for share in (0.0, 0.5, 1.0):
        value = limits[0] + share * (limits[1] - limits[0])
        parts.append(
            label(x + 24, bottom - share * (bottom - top) + 5, f"{value:.1f} µm", 13, "start")
        )
    parts.append(f'<rect x="{x}" y="{bottom + 14}" width="18" height="14" fill="{_UNSEEN}"/>')
    parts.append(label(x + 24, bottom + 26, "not seen", 13, "start"))
    return parts

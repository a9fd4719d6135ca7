"""Colours as seen with colour vision deficiencies, and the difference of two colours.

The matrices are those of G. M. Machado, M. M. Oliveira, L. A. F. Fernandes, "A
Physiologically-based Model for Simulation of Color Vision Deficiency", IEEE Transactions on
Visualization and Computer Graphics 15 (2009) 1291-1298, at severity 1.0, as published with the
paper; they act on linear RGB. The difference is CIEDE2000, after G. Sharma, W. Wu, E. N. Dalal,
"The CIEDE2000 Color-Difference Formula", Color Research and Application 30 (2005) 21-30, with D65
and the primaries of sRGB.
"""

from __future__ import annotations

import math

import numpy as np

from ocmm_core.geometry import Float

MACHADO = {
    "protan": (
        (0.152286, 1.052583, -0.204868),
        (0.114503, 0.786281, 0.099216),
        (-0.003882, -0.048116, 1.051998),
    ),
    "deutan": (
        (0.367322, 0.860646, -0.227968),
        (0.280085, 0.672501, 0.047413),
        (-0.011820, 0.042940, 0.968881),
    ),
    "tritan": (
        (1.255528, -0.076749, -0.178779),
        (-0.078411, 0.930809, 0.147602),
        (0.004733, 0.691367, 0.303900),
    ),
}
_XYZ_OF_RGB = np.array(
    ((0.4124564, 0.3575761, 0.1804375), (0.2126729, 0.7151522, 0.0721750),
     (0.0193339, 0.1191920, 0.9503041))
)  # fmt: skip
_WHITE = np.array((0.95047, 1.0, 1.08883))
"""D65, two degrees."""


def linear(colour: str) -> Float:
    """Return ``#rrggbb`` as linear RGB, (3,), 0 to 1."""
    values = np.array([int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5)])
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def seen(colour: str, kind: str) -> Float:
    """Return a colour seen with a deficiency, linear RGB, (3,); ``usual`` changes nothing."""
    rgb = linear(colour)
    if kind == "usual":
        return rgb
    return np.clip(np.array(MACHADO[kind]) @ rgb, 0.0, 1.0)


def lab(rgb: Float) -> Float:
    """Return linear RGB, (3,), as CIELAB."""
    ratio = (_XYZ_OF_RGB @ rgb) / _WHITE
    cubic = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = cubic.tolist()
    return np.array((116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)))


def ciede2000(first: Float, second: Float) -> float:
    """Return the difference of two colours in CIELAB, each (3,)."""
    (l1, a1, b1), (l2, a2, b2) = first.tolist(), second.tolist()
    mean_c7 = (0.5 * (math.hypot(a1, b1) + math.hypot(a2, b2))) ** 7
    g = 0.5 * (1.0 - math.sqrt(mean_c7 / (mean_c7 + 25.0**7)))
    a1, a2 = (1.0 + g) * a1, (1.0 + g) * a2
    c1, c2 = math.hypot(a1, b1), math.hypot(a2, b2)
    h1 = math.degrees(math.atan2(b1, a1)) % 360.0
    h2 = math.degrees(math.atan2(b2, a2)) % 360.0
    grey = c1 * c2 == 0.0
    turn = 0.0 if grey else (h2 - h1 + 180.0) % 360.0 - 180.0
    dh = 2.0 * math.sqrt(c1 * c2) * math.sin(math.radians(0.5 * turn))
    mean_l, mean_c = 0.5 * (l1 + l2), 0.5 * (c1 + c2)
    mean_h = h1 + h2 if grey else (h1 + 0.5 * turn) % 360.0
    t = (
        1.0
        - 0.17 * math.cos(math.radians(mean_h - 30.0))
        + 0.24 * math.cos(math.radians(2.0 * mean_h))
        + 0.32 * math.cos(math.radians(3.0 * mean_h + 6.0))
        - 0.20 * math.cos(math.radians(4.0 * mean_h - 63.0))
    )
    s_l = 1.0 + 0.015 * (mean_l - 50.0) ** 2 / math.sqrt(20.0 + (mean_l - 50.0) ** 2)
    s_c, s_h = 1.0 + 0.045 * mean_c, 1.0 + 0.015 * mean_c * t
    r_c = 2.0 * math.sqrt(mean_c**7 / (mean_c**7 + 25.0**7))
    r_t = -r_c * math.sin(math.radians(60.0 * math.exp(-(((mean_h - 275.0) / 25.0) ** 2))))
    l, c, h = (l2 - l1) / s_l, (c2 - c1) / s_c, dh / s_h  # noqa: E741  # as in the paper
    return math.sqrt(l * l + c * c + h * h + r_t * c * h)

"""Limits of fits such as H7 and g6, up to 500 mm (ISO 286-1:2010, tables 1 to 5; ISO 286-2).

The tables are those of the standard, micrometres: its formulas are rounded in ways that they do not
say. A hole has the deviation of the shaft of the same letter with the other sign; K to P, where
interference counts, are shifted by the difference of two grades (ISO 286-1, 4.3.2.5) so that hole
and shaft of neighbouring grades fit as the basic shaft system does.
"""

from __future__ import annotations

import re

from ocmm_core.inspection.drawing._account import RefusedError

_UP_TO = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""mm: over the one before, up to and including this one."""
_GRADES = {
    4: (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
}
"""Standard tolerances IT4 to IT11."""
_CLEAR = {
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
}
"""How far the upper limit of a shaft lies below the nominal size."""
_TIGHT = {
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
"""How far the lower limit of a shaft lies above the nominal size; of k in the grades 4 to 7."""
_SHIFTED_TO = {"k": 8, "m": 8, "n": 8, "p": 7}
"""Grade up to which holes of the letter are shifted."""
_CODE = re.compile(r"([A-Za-z]{1,2})(\d{1,2})")
_LEAST = 5


def fit_limits(code: str, size: float) -> tuple[float, float, bool]:
    """Return lower and upper deviation, mm, of a fit, and whether it is of a hole.

    Parameters
    ----------
    code
        Such as ``H7`` or ``g6``.
    size
        Nominal diameter, mm.

    Raises
    ------
    RefusedError
        The tables do not have it.
    """
    found = _CODE.fullmatch(code)
    letter, grade = (found.group(1), int(found.group(2))) if found else ("", 0)
    known = letter.lower() in (*_CLEAR, *_TIGHT, "js") and (letter.isupper() or letter.islower())
    if not known or grade not in range(_LEAST, max(_GRADES) + 1):
        raise RefusedError(
            f"its limits are the fit {code}; known are D to H, JS, K, M, N, P and d to h, js, k, "
            f"m, n, p in the grades {_LEAST} to {max(_GRADES)}"
        )
    if not 0.0 < size <= _UP_TO[-1]:
        raise RefusedError(f"the fit {code} is known up to {_UP_TO[-1]} mm, it has {size:g} mm")
    row = next(place for place, last in enumerate(_UP_TO) if size <= last)
    wide, is_hole, word = _GRADES[grade][row], letter.isupper(), letter.lower()
    if word == "js":
        low, high = -0.5 * wide, 0.5 * wide
    elif word in _CLEAR:
        off = _CLEAR[word][row]
        low, high = (off, off + wide) if is_hole else (-off - wide, -off)
    elif is_hole:
        high = _upper_of_hole(word, grade, row, code)
        low = high - wide
    else:
        low = 0 if word == "k" and grade > 7 else _TIGHT[word][row]
        high = low + wide
    return round(1e-3 * low, 6), round(1e-3 * high, 6), is_hole


def _upper_of_hole(word: str, grade: int, row: int, code: str) -> float:
    last = _SHIFTED_TO[word]
    if grade > last:
        if word == "n":
            return -4.0 if row == 0 else 0.0
        if word == "k":
            raise RefusedError(f"its limits are the fit {code}, which the tables do not have")
        return -_TIGHT[word][row]
    if word == "m" and grade == 6 and _UP_TO[row] == 315:
        # The one exception that the standard makes.
        return -9.0
    # Up to 3 mm the standard has no shift.
    shift = 0 if row == 0 else _GRADES[grade][row] - _GRADES[grade - 1][row]
    return shift - _TIGHT[word][row]

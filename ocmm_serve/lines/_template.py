"""Template of a line: fields in braces and text between them, checked before the first point."""

from __future__ import annotations

import re
from dataclasses import dataclass
from string import Formatter
from typing import TYPE_CHECKING, Literal

from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_core.measuring import MeasuredPoint

LengthUnit = Literal["mm", "um", "inch"]
PointKind = Literal["ball", "surface"]
DecimalSign = Literal["point", "comma"]
_PER_MM: dict[LengthUnit, float] = {"mm": 1.0, "um": 1000.0, "inch": 1.0 / 25.4}
_DIGITS: dict[LengthUnit, int] = {"mm": 4, "um": 1, "inch": 6}
COARSEST_MM = 0.01
"""A template whose last digit is coarser would round the result of the machine away."""
_AXES = ("x", "y", "z")
_FIELDS = (*_AXES, "i", "j", "k", "r", "n")
_FORMAT = re.compile(r"([+ ]?)(0?\d{0,2})(?:\.(\d))?([fd]?)")
_LONGEST = 200
_REMEDY = (
    "Write it as {x:.4f},{y:.4f},{z:.4f}: fields x y z (position), i j k (direction out of the "
    "material), r (radius of the ball), n (number of the point); width and digits behind the colon."
)


@dataclass(frozen=True, slots=True)
class _Part:
    before: str
    field: str
    """Empty behind the last one."""
    form: str = ""


@dataclass(frozen=True, slots=True)
class LineTemplate:
    """Make a line of text of each point; `parse` checks it."""

    parts: tuple[_Part, ...]
    unit: LengthUnit
    kind: PointKind
    decimal: DecimalSign

    @classmethod
    def parse(
        cls,
        text: str,
        unit: LengthUnit = "mm",
        kind: PointKind = "ball",
        decimal: DecimalSign = "point",
    ) -> LineTemplate:
        r"""Return a template; ``\t`` in `text` is a tabulator. InputError: `text` is unsuitable."""
        if len(text) > _LONGEST:
            raise _unsuitable(text[:40] + "...", f"it has more than {_LONGEST} characters")
        try:
            read = list(Formatter().parse(text.replace("\\t", "\t")))
        except ValueError as error:
            raise _unsuitable(text, str(error)) from error
        parts = tuple(
            _Part(before, field or "", "" if field is None else _form(text, field, form, how, unit))
            for before, field, form, how in read
        )
        _check(text, parts, decimal)
        return cls(parts, unit, kind, decimal)

    def line(self, point: MeasuredPoint) -> str:
        """Return the line of a point, without its end."""
        place = point.tip_world if self.kind == "ball" else point.surface_world
        scale = _PER_MM[self.unit]
        values = dict(zip("xyz", (place * scale).tolist(), strict=True))
        values |= dict(zip("ijk", point.direction.tolist(), strict=True))
        values |= {"r": point.tip_radius * scale, "n": point.number}
        return "".join(
            part.before + (self._number(values[part.field], part.form) if part.field else "")
            for part in self.parts
        )

    @property
    def summary(self) -> str:
        """Return what its numbers are, for the operator."""
        if self.kind == "ball":
            return f"Ball centres (radius not compensated) in {self.unit}, world of the cameras."
        return f"Surface points (radius compensated) in {self.unit}, world of the cameras."

    def _number(self, value: float, form: str) -> str:
        written = format(value, form)
        return written.replace(".", ",") if self.decimal == "comma" else written


def _form(text: str, field: str, form: str | None, how: str | None, unit: LengthUnit) -> str:
    """Return the checked format of a field, with its usual digits if none are stated."""
    if field not in _FIELDS or how is not None:
        name = f"{field}!{how}" if how else field
        raise _unsuitable(text, f"{{{name}}} is not a field")
    found = _FORMAT.fullmatch(form or "")
    if found is None or (found[4] == "d" and found[3]):
        raise _unsuitable(text, f"{form!r} is not a width with digits")
    sign, width, digits, letter = found.groups()
    if field == "n":
        if digits is not None or letter == "f":
            raise _unsuitable(text, "the number of a point has no decimals")
        return f"{sign}{width}d"
    if letter == "d":
        raise _unsuitable(text, f"{{{field}}} has decimals; integers are .0f")
    decimals = _DIGITS[unit] if digits is None else int(digits)
    # Numbers without a unit are directions: a last digit of 0.001 is 0.06 degrees.
    last_mm = 10.0**-decimals / (_PER_MM[unit] if field not in "ijk" else 0.1)
    if last_mm > COARSEST_MM * (1.0 + 1e-9):
        raise _unsuitable(text, f"{decimals} decimals of {{{field}}} round to {last_mm:.3g} mm")
    # "z": a coordinate that rounds to zero has no minus.
    return f"{sign}z{width}.{decimals}f"


def _check(text: str, parts: tuple[_Part, ...], decimal: DecimalSign) -> None:
    """Require all coordinates once, in readable characters, and numbers that stay apart."""
    fields = [part.field for part in parts]
    lacking = [axis for axis in _AXES if axis not in fields]
    if lacking:
        raise _unsuitable(text, f"it lacks {', '.join(f'{{{axis}}}' for axis in lacking)}")
    if any(fields.count(field) > 1 for field in _FIELDS):
        raise _unsuitable(text, "a field is there twice")
    sign = "." if decimal == "point" else ","
    number_before = False
    for part in parts:
        if re.search(r"[^\t -~]", part.before):
            raise _unsuitable(text, "it has characters other than ASCII and tabulators")
        joined = number_before and (not part.before or part.before[0] in f"0123456789eE{sign}")
        if joined or (part.field and part.before and part.before[-1] in f"0123456789+-.{sign}"):
            raise _unsuitable(text, f"two numbers would run together at {part.before!r}")
        number_before = bool(part.field)


def _unsuitable(text: str, why: str) -> InputError:
    return InputError("lines.template", f'The template "{text}" cannot be used: {why}.', _REMEDY)

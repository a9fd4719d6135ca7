"""The grammar of units for all readers: names, symbols, and the places that state a unit.

In: a unit as another program writes it, or a line of text. Out: its size in mm, degrees or kelvin.

- `find_unit(text, dimension)` returns a `MeasureUnit`, or None if the text is not a unit.
- `named_unit(text, dimension, where)` refuses an unknown unit; ``where`` names file and line.
- `agreed_unit(name, si_factor, dimension, where)` also refuses a name that contradicts its factor.
- `unit_statement(line)` returns the statement of a unit in a comment or title, e.g. "unit: mm".
  Prose is never a unit. An unknown unit is returned without a `MeasureUnit`: refuse it.
- `heading_unit(cell)` splits a heading such as "X [mm]" into its name and the text of its unit.

``MeasureUnit.factor`` converts to mm, degrees and kelvin, ``MeasureUnit.si`` to metre, radian and
kelvin; ``offset`` is the zero point of a temperature scale in degrees Celsius.

Read `_unit` (table and grammar of names), `_statements` (places in text).
A table of our own serves better than pint here: pint reads "points", "units" and "M" as units and
"mil" as an angle, does not know "Zoll" or the inch mark, and costs 0.25 s and 3.7 MB.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.units._statements import UnitStatement, heading_unit, unit_statement
    from ocmm_core.units._unit import (
        Dimension,
        MeasureUnit,
        agreed_unit,
        find_unit,
        named_unit,
    )
else:
    __getattr__ = door(
        __name__,
        _statements="UnitStatement heading_unit unit_statement",
        _unit="Dimension MeasureUnit agreed_unit find_unit named_unit",
    )

__all__ = [
    "Dimension",
    "MeasureUnit",
    "UnitStatement",
    "agreed_unit",
    "find_unit",
    "heading_unit",
    "named_unit",
    "unit_statement",
]

"""The grammar of units for all readers: names, symbols, and the places that state a unit.

In: a unit as another program writes it, or a line of text. Out: its size in mm, degrees or kelvin.

`find_unit` returns a `MeasureUnit` or None; `named_unit` refuses an unknown unit, `agreed_unit`
also a name that contradicts its factor. `unit_statement` finds "unit: mm" in a comment or title:
prose is never a unit, and a statement without a `MeasureUnit` is to be refused. `heading_unit`
splits "X [mm]", `units_of_name` reads "bore_inch.csv". `scaled` converts: decimal numbers are
multiplied, and rounded once.

Read `_unit` (table and grammar of names), `_statements` (places in text). It knows no files.
A table of our own and not pint: pint reads "points" and "M" as units and "mil" as an angle, does
not know "Zoll" or the inch mark, and costs 0.25 s and 3.7 MB.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.units._statements import (
        UnitStatement, heading_unit, unit_statement, units_of_name,
    )  # fmt: skip
    from ocmm_core.units._unit import (
        Dimension, MeasureUnit, agreed_unit, find_unit, named_unit, scaled,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "Dimension", "MeasureUnit", "UnitStatement", "agreed_unit", "find_unit", "heading_unit",
    "named_unit", "scaled", "unit_statement", "units_of_name",
]  # fmt: skip

"""Tolerances of a STEP file (AP242 semantic PMI), read from its text.

In: the text of a STEP file.
Out: dimensions, tolerances, datums and notes, each with the numbers of its faces and, if it cannot
be trusted, the reason.

Read `_items` (results), `_part21` (entities of the text), `_measures` (types, values with units),
then `_dimensions` (also faces of an aspect), `_tolerances`, and `_read`, which joins them, and also
reads units and other single entities alone. It must not know features or plans:
`inspection.drawing` imports the items.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cad.pmi._items import (
        Annotation, Datum, DatumReference, DatumTarget, Dimension, Pmi, Tolerance,
    )  # fmt: skip
    from ocmm_cad.pmi._part21 import BadEntityError, Part21, Typed, plain, refs
    from ocmm_cad.pmi._read import (
        FaceText, may_say_tolerances, picked_entities, read_pmi, units_fault,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "Annotation", "BadEntityError", "Datum", "DatumReference", "DatumTarget", "Dimension",
    "FaceText", "Part21", "Pmi", "Tolerance", "Typed", "may_say_tolerances", "picked_entities",
    "plain", "read_pmi", "refs", "units_fault",
]  # fmt: skip

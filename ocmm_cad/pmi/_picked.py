"""Selected entities and units of a STEP file, without reading all of it.

The geometry library assumes millimetres and radians without units, or with a factor that
contradicts its name. Here such a file is refused.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from ocmm_cad.pmi._measures import unit_of
from ocmm_cad.pmi._part21 import BadEntityError, Part21, read_part21, refs

_UNITS, _CONTEXT = "GLOBAL_UNIT_ASSIGNED_CONTEXT", "GEOMETRIC_REPRESENTATION_CONTEXT"


def picked_entities(content: bytes, words: Sequence[str]) -> Part21:
    """Return the entities whose text has any of some words; BadEntityError as `read_part21`.

    A semicolon inside a text may truncate an entity: then the whole file is read.
    """
    wanted = re.compile("|".join(map(re.escape, words)).encode(), re.IGNORECASE)
    begin = content.find(b"DATA")
    picked: list[bytes] = [b"DATA"]
    end = max(begin, 0)
    while found := wanted.search(content, end):
        start = max(content.rfind(b";", 0, found.start()) + 1, 0)
        end = content.find(b";", found.end())
        end = len(content) if end < 0 else end
        picked.append(content[start:end])
    text = b";\n".join((*picked, b"")).decode("utf-8", errors="replace")
    if any(one.count(b"'") % 2 or b"/*" in one for one in picked):
        text = content.decode("utf-8", errors="replace")
    return read_part21(text)


def units_fault(content: bytes) -> str:
    """Return the fault of a model's units, as a part of a sentence; empty if none."""
    try:
        file = picked_entities(content, ("UNIT", _CONTEXT))
        if not file.all_of(_UNITS):
            return "it names no units of length and angle"
        for number in file.all_of(_CONTEXT):
            records = file.records(number)
            if "PARAMETRIC_REPRESENTATION_CONTEXT" in records or _is_flat(records[_CONTEXT]):
                continue
            named = refs(records.get(_UNITS, ()))
            kinds = [unit_of(file, one).dimension for one in named if _is_used(file, one)]
            for of in ("length", "angle"):
                if kinds.count(of) != 1:
                    count = "no unit" if of not in kinds else "several units"
                    return f"its geometry has {count} of {of} (#{number})"
    except BadEntityError as error:
        return str(error)
    return ""


def _is_flat(arguments: Sequence[object]) -> bool:
    return bool(arguments) and arguments[-1] != 3


def _is_used(file: Part21, number: int) -> bool:
    return bool(file.types(number) & {"LENGTH_UNIT", "PLANE_ANGLE_UNIT"})

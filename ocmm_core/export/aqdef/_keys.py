"""Keys of the Q-DAS ASCII transfer format that are written: types and lengths.

By the published table of supported K-fields (Hexagon, Q-DAS configurator): ``AN`` is text with a
maximum length, ``I`` an integer and ``F`` a number with a maximum number of characters, ``D`` a
date. Nothing is truncated silently:

* an identifying text (part, order, drawing, batch, serial number, plan) that is too long ends in
  ``~`` and four hexadecimal digits of the SHA-256 of the whole text, so that two long ones stay
  distinct; the whole text is in a remark;
* any other text ends with `` ...``;
* a number that does not fit is refused.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from ocmm_core.errors import StorageError
from ocmm_core.export.aqdef._reader import ENCODING
from ocmm_core.export.report import one_line

Type = Literal["AN", "I", "F", "D"]
_CUT, _TAIL, _DIGITS = " ...", "~", 4


@dataclass(frozen=True, slots=True)
class Key:
    type: Type
    length: int
    """`type`, `length`: As in the published table."""
    title: str
    """Meaning, for messages and remarks."""
    tells_apart: bool = False
    """Identifying: longer texts must stay distinct."""


KEYS: Mapping[str, Key] = {
    "K0001": Key("F", 22, "value"),
    "K0002": Key("I", 5, "attribute"),
    "K0004": Key("D", 19, "time"),
    "K0006": Key("AN", 14, "batch", tells_apart=True),
    "K0008": Key("I", 10, "operator, by catalogue"),
    "K0009": Key("AN", 255, "remark"),
    "K0010": Key("I", 10, "machine, by catalogue"),
    "K0012": Key("I", 10, "gauge, by catalogue"),
    "K0014": Key("AN", 40, "serial number", tells_apart=True),
    "K0053": Key("AN", 20, "order of the value", tells_apart=True),
    "K0100": Key("I", 5, "number of characteristics"),
    "K1001": Key("AN", 30, "part number", tells_apart=True),
    "K1002": Key("AN", 80, "part"),
    "K1041": Key("AN", 30, "drawing", tells_apart=True),
    "K1042": Key("AN", 20, "revision of the drawing", tells_apart=True),
    "K1053": Key("AN", 40, "order", tells_apart=True),
    "K1062": Key("AN", 40, "customer"),
    "K1081": Key("AN", 24, "machine", tells_apart=True),
    "K1082": Key("AN", 40, "machine in words"),
    "K1201": Key("AN", 24, "test facility", tells_apart=True),
    "K1202": Key("AN", 40, "test facility in words"),
    "K1222": Key("AN", 40, "operator"),
    "K1230": Key("AN", 40, "place"),
    "K1341": Key("AN", 20, "plan", tells_apart=True),
    "K1342": Key("AN", 40, "index of the plan"),
    "K1900": Key("AN", 255, "remark"),
    "K2001": Key("AN", 20, "characteristic number"),
    "K2002": Key("AN", 80, "characteristic", tells_apart=True),
    "K2004": Key("I", 5, "type of the characteristic"),
    "K2009": Key("I", 5, "measured quantity"),
    "K2022": Key("I", 5, "decimals"),
    "K2101": Key("F", 22, "nominal"),
    "K2110": Key("F", 22, "lower limit"),
    "K2111": Key("F", 22, "upper limit"),
    "K2112": Key("F", 22, "lower allowance"),
    "K2113": Key("F", 22, "upper allowance"),
    "K2120": Key("I", 3, "kind of the lower limit"),
    "K2121": Key("I", 3, "kind of the upper limit"),
    "K2142": Key("AN", 20, "unit"),
    "K2401": Key("AN", 40, "gauge", tells_apart=True),
    "K2402": Key("AN", 80, "gauge in words"),
    "K2900": Key("AN", 255, "remark"),
    "K4062": Key("AN", 40, "machine, entry of the catalogue", tells_apart=True),
    "K4072": Key("AN", 40, "gauge, entry of the catalogue", tells_apart=True),
    "K4073": Key("AN", 80, "gauge in words, entry of the catalogue"),
    "K4092": Key("AN", 50, "operator, entry of the catalogue", tells_apart=True),
}


def fitted(key: str, text: str) -> str:
    """Return a text fitted to a key by the rules above; StorageError if a number does not fit."""
    asked = KEYS[key]
    if asked.type != "AN":
        number = text.lstrip("-") if asked.type == "I" else text
        if len(number) > asked.length or (asked.type == "I" and not number.isdigit()):
            raise StorageError(
                "aqdef.number",
                f"{text} does not fit the Q-DAS field {key} ({asked.title}), which takes "
                f"{asked.length} characters.",
                "Use a profile with fewer digits, or leave out the Q-DAS file.",
            )
        return text
    plain = _written(text)
    lost = asked.tells_apart and plain != one_line(text)
    if len(plain) <= asked.length and not lost:
        return plain
    if asked.tells_apart:
        tail = _TAIL + hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]
        return plain[: asked.length - len(tail)] + tail
    return plain[: asked.length - len(_CUT)] + _CUT


def told_whole(texts: Mapping[str, str]) -> str:
    """Return the complete texts of those that did not fit, for a remark; empty if all did."""
    return "; ".join(
        f"{KEYS[key].title} in full: {_written(text)}"
        for key, text in texts.items()
        if fitted(key, text) != _written(text)
    )


def foreign_signs(texts: Iterable[str]) -> bool:
    """Return whether a text has characters outside the encoding of the file."""
    return any(one_line(text) != _written(text) for text in texts)


def _written(text: str) -> str:
    """Return a text with ``?`` for characters outside the encoding."""
    return one_line(text).encode(ENCODING, "replace").decode(ENCODING)

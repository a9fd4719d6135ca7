"""Strict parser of the answers of an I++ DME server, in the dialects 1.4 and 2.5.

Written from the published grammar, the error table and the forms that NIST's `parserRes` accepts
and refuses (`test_ippdme_grammar` has them all); it shares nothing with the server.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Dialect = Literal["1.4", "2.5"]
LONGEST_LINE = 65_536

_1_4 = """
0000 0 Buffer full|0001 2 Illegal tag|0002 2 No space at pos. 6|0003 2 Reserved|0004 2 Reserved
0005 2 Reserved|0006 2 Transaction aborted (Use ClearAllErrors to Continue)
0007 3 Illegal character|0008 3 Protocol error|0500 3 Emergency stop|0501 3 Unsupported command
0502 3 Incorrect arguments|0503 9 Controller communications failure|0504 1 Argument out of range
0505 3 Argument not recognized|0506 3 Argument not supported|0507 3 Illegal command
0508 3 Bad context|0509 3 Bad argument|0510 3 Bad property|0511 3 Error processing method
0512 1 No daemons are active|0513 2 Daemon does not exist|0514 2 Use ClearAllErrors to continue
0515 2 Daemon already exists|1000 3 Machine in error state|1001 2 Illegal touch
1002 9 Axis does not exist|1003 2 No touch
1004 9 Number of angles not supported on current device|1005 3 Error during home
1006 2 Surface not found|1007 3 Theta out of range|1008 3 Target position out of machine volume
1009 3 Air pressure out of range|1010 2 Vector has no norm|1500 3 Failed to re-seat head
1501 3 Probe not armed|1502 3 Tool not found|1503 3 Tool not defined|2000 3 Tool not calibrated
2001 2 Head error excessive force|2002 3 Type of probe does not allow this operation
2500 3 Machine limit encountered [Move Out Of Limits]|2501 3 Axis not active
2502 3 Axis position error|2503 9 Scale read head failure|2504 3 Collision
2505 2 Specified angle out of range|2506 2 Part not aligned
"""
_2_5 = """
0006 2 Transaction aborted (Use ClearAllErrors To Continue)|1011 2 Unable to move
1012 2 Bad lock combinations|1013 3 Coordinate system not found
1014 2 Failed to set value due to active internal correction|1504 3 Collection not found
1505 2 Tool not alignable|1506 1 Tool property not applicable
1507 3 Tool not alignable to given orientation|5000 2 Wrong data format|5001 2 Port not available
"""


def _table(text: str) -> dict[int, tuple[int, str]]:
    rows = [row.split(" ", 2) for row in text.strip().replace("\n", "|").split("|")]
    return {int(number): (int(severity), said) for number, severity, said in rows}


ERRORS: dict[Dialect, dict[int, tuple[int, str]]] = {
    "1.4": _table(_1_4),
    "2.5": _table(_1_4) | _table(_2_5),
}
"""Severity and text by number."""


class GrammarError(ValueError):
    """An answer that a client of the dialect cannot read."""


@dataclass(frozen=True, slots=True)
class Number:
    text: str

    @property
    def value(self) -> float:
        return float(self.text)


@dataclass(frozen=True, slots=True)
class Text:
    text: str


@dataclass(frozen=True, slots=True)
class Bare:
    name: str


@dataclass(frozen=True, slots=True)
class Call:
    name: str
    """Empty for a bracket without a name."""
    items: tuple[Item, ...]

    @property
    def numbers(self) -> tuple[float, ...]:
        """Return its values; GrammarError if one is not a number."""
        if not all(isinstance(item, Number) for item in self.items):
            raise GrammarError(f"{self.name} has other items than numbers")
        return tuple(item.value for item in self.items if isinstance(item, Number))


Item = Number | Text | Bare | Call


@dataclass(frozen=True, slots=True)
class AnswerError:
    severity: int
    number: int
    function: str
    text: str


@dataclass(frozen=True, slots=True)
class Answer:
    tag: str
    kind: Literal["&", "#", "!", "%"]
    items: tuple[Item, ...] = ()
    error: AnswerError | None = None


_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[Ee][+-]?\d{1,3})?")
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9]*(?:\.[A-Za-z][A-Za-z0-9]*)*")
_TEXT = re.compile(r'"([ !#-~]+)"')
_MAYBE_TEXT = re.compile(r'"([ !#-~]*)"')
_SPACES = re.compile(r" *")


class _Reader:
    """Items of a data line; spaces only around commas and opening, before closing brackets."""

    def __init__(self, text: str, dialect: Dialect) -> None:
        self._text, self._at, self._dialect = text, 0, dialect

    def all(self) -> tuple[Item, ...]:
        found = self._list()
        if self._at != len(self._text):
            raise GrammarError(f"unexpected at {self._at}: {self._text[self._at :][:40]!r}")
        return found

    def _list(self) -> tuple[Item, ...]:
        items = [self._item()]
        while self._skip(","):
            items.append(self._item())
        return tuple(items)

    def _skip(self, sign: str) -> bool:
        """Pass a sign with the spaces around it (before it alone for a closing bracket)."""
        before = _SPACES.match(self._text, self._at)
        assert before is not None
        if not self._text.startswith(sign, before.end()):
            return False
        self._at = before.end() + 1
        if sign != ")":
            after = _SPACES.match(self._text, self._at)
            assert after is not None
            self._at = after.end()
        return True

    def _item(self) -> Item:
        if found := _TEXT.match(self._text, self._at):
            self._at = found.end()
            return Text(found[1])
        if found := _NUMBER.match(self._text, self._at):
            self._at = found.end()
            return Number(self._checked(found[0]))
        name = ""
        if found := _NAME.match(self._text, self._at):
            self._at, name = found.end(), found[0]
        if not self._skip("("):
            if not name:
                raise GrammarError(f"no item at {self._at}: {self._text[self._at :][:40]!r}")
            return Bare(name)
        if self._skip(")"):
            return Call(name, ())
        items = self._list()
        if not self._skip(")"):
            raise GrammarError(f"no closing bracket at {self._at}")
        return Call(name, items)

    def _checked(self, number: str) -> str:
        counted = number if self._dialect == "2.5" else re.sub(r"\D", "", number)
        if len(counted) > 16:
            raise GrammarError(f"{number} is too long")
        return number


def parse_items(text: str, dialect: Dialect = "1.4") -> tuple[Item, ...]:
    """Return the items of a data line, of any meaning."""
    return _Reader(text, dialect).all()


def parse_answer(line: str, dialect: Dialect = "1.4") -> Answer:
    """Return an answer without its line end; GrammarError if no client could read it."""
    if len(line) + 2 > LONGEST_LINE:
        raise GrammarError("the line is too long")
    if bad := re.search(r"[^ -~]", line):
        raise GrammarError(f"illegal character {bad[0]!r}")
    head = re.match(r"(\d{5}|E\d{4}) ([&#!%])", line)
    if head is None or head[1] == "00000":
        raise GrammarError("no tag, space and sign")
    tag, kind, rest = head[1], head[2], line[7:]
    if kind in "&%":
        if rest or tag == "E0000":
            raise GrammarError(f"{tag} {kind} is followed by something, or is no answer")
        return Answer(tag, "&" if kind == "&" else "%")
    if not re.match(r" [^ ]", rest):
        raise GrammarError("not one space behind the sign")
    if kind == "!":
        return Answer(tag, "!", error=_error(rest[1:], dialect))
    items = parse_items(rest[1:], dialect)
    (_check_1_4 if dialect == "1.4" else _check_2_5)(tag, items)
    return Answer(tag, "#", items)


def _error(text: str, dialect: Dialect) -> AnswerError:
    found = re.fullmatch(
        rf'Error *\( *(\d) *, *(\d{{4}}) *, *{_MAYBE_TEXT.pattern} *, *{_TEXT.pattern} *\)', text
    )  # fmt: skip
    if found is None:
        raise GrammarError(f"no error: {text}")
    error = AnswerError(int(found[1]), int(found[2]), found[3], found[4])
    known = ERRORS[dialect].get(error.number)
    own = dialect == "2.5" and 8000 <= error.number <= 8999
    if not own and known != (error.severity, error.text):
        raise GrammarError(f"{text} is not in the table: {known}")
    return error


_Sizes = Mapping[str, tuple[int, ...]]
_POINT: _Sizes = {
    **dict.fromkeys(["X", "Y", "Z", "ER", "R", "Tool.A", "Tool.B", "Tool.C"], (1,)), "IJK": (3,)
}  # fmt: skip
_POINT_2_5: _Sizes = {**_POINT, "Q": (1,), "IJKAct": (1,), "Tool.Alignment": (3, 6)}
_SYSTEMS = ("MachineCsy", "MoveableMachineCsy", "MultipleArmCsy", "PartCsy")
_PARAMETER = re.compile(
    r"(Tool|FoundTool)\.(GoToPar\.(Speed|Accel)|PtMeasPar\.(Speed|Accel|Approach|Search|Retract))"
    r"(\.(Min|Max|Act|Def))?"
)
_SETTABLE = re.compile(r"Tool\.(GoToPar|PtMeasPar)\.\w+(\.Act)?")
_FLAGS = ("ErrStatus", "IsHomed", "IsUserEnabled", "CenterPart", "TiltPart", "TiltCenterPart")


def _require(holds: object, said: object) -> None:
    if not holds:
        raise GrammarError(f"not in this dialect: {said}")


def _is_point(items: tuple[Item, ...], sizes: _Sizes, *, null: bool) -> bool:
    names = [item.name for item in items if isinstance(item, Call)]
    if len(names) != len(items) or len(set(names)) != len(names):
        return False
    for item in items:
        if not isinstance(item, Call) or item.name not in sizes:
            return False
        if null and item.items == (Bare("NULL"),):
            continue
        if len(item.items) not in sizes[item.name]:
            return False
        if not all(isinstance(one, Number) for one in item.items):
            return False
    return True


def _check_event(call: Item, dialect: Dialect) -> None:
    """Check an event, a message with the tag E0000."""
    _require(isinstance(call, Call), call)
    assert isinstance(call, Call)
    match call.name:
        case "PtMeas" | "GoTo":
            sizes = _POINT if dialect == "1.4" else _POINT_2_5
            _require(_is_point(call.items, sizes, null=dialect == "2.5"), call)
            for item in call.items:
                if call.name == "GoTo" and isinstance(item, Call) and item.name == "IJK":
                    _require(item.numbers == (0.0, 0.0, 0.0), call)
        case "KeyPress" | "ChangeTool" | "OpenToolCollection":
            _require(dialect == "2.5" or call.name != "OpenToolCollection", call)
            _require(len(call.items) == 1 and isinstance(call.items[0], Text), call)
        case "SetProp":
            for item in call.items:
                name = item.name if isinstance(item, Call) else ""
                _require(_SETTABLE.fullmatch(name) or dialect == "2.5", call)
                assert isinstance(item, Call)
                _require(len(item.numbers) == 1, call)
        case _:
            _require(False, call)


def _check_1_4(tag: str, items: tuple[Item, ...]) -> None:
    if tag == "E0000":
        _require(len(items) == 1, items)
        _check_event(items[0], "1.4")
        return
    for kind in (Number, Text):
        if all(isinstance(item, kind) for item in items):
            return
    if _is_point(items, _POINT, null=False):
        return
    _require(all(isinstance(item, Call) for item in items), items)
    calls = [item for item in items if isinstance(item, Call)]
    if all(re.match(r"(Found)?Tool\.", call.name) for call in calls):
        for call in calls:
            _check_property_1_4(call)
        return
    _require(len(calls) == 1, items)
    _check_method_1_4(calls[0])


def _check_property_1_4(call: Call) -> None:
    if re.fullmatch(r"(Found)?Tool\.(Name|Id)", call.name):
        _require(len(call.items) == 1 and isinstance(call.items[0], Text), call)
        _require("<" not in getattr(call.items[0], "text", ""), call)
    elif call.name == "Tool.Alignment":
        _require(len(call.numbers) in (3, 6), call)
    elif call.name == "Tool.CollisionVolume":
        boxes = [call.items[at : at + 16] for at in range(0, len(call.items), 16)]
        for box in boxes:
            _require(box[0] == Bare("OBB") and len(box) == 16, call)
            _require(all(isinstance(one, Number) for one in box[1:]), call)
    else:
        _require(_PARAMETER.fullmatch(call.name), call)
        _require(len(call.numbers) == 1, call)


def _check_method_1_4(call: Call) -> None:
    items = call.items
    match call.name:
        case "":
            _require(len(call.numbers) in (3, 6), call)
        case "GetMachineClass":
            allowed = (Text("CartCMM"), Text("CartCMMWithRotaryTable"))
            _require(len(items) == 1 and items[0] in allowed, call)
        case "DMEVersion":
            _require(len(items) == 1 and isinstance(items[0], Text), call)
        case "CoordSystem":
            _require(len(items) == 1 and items[0] in [Bare(name) for name in _SYSTEMS], call)
        case "GetCsyTransformation":
            _require(len(call.numbers) == 6, call)
        case "ChangeToolAction":
            words = [Bare(name) for name in ("Switch", "Rotate", "MoveAuto", "MoveMan")]
            _require(items and items[0] in words, call)
            _require(not items[1:] or _is_point(items[1:], _POINT, null=False), call)
        case name:
            _require(name in _FLAGS and items in ((Number("0"),), (Number("1"),)), call)


_WORDS_2_5 = re.compile(
    r"(Found)?Tool(\.\w+)+|Part\.\w+|DMEVersion|ErrStatus|IsHomed|IsUserEnabled|ActiveError|Severity"
    r"|Argument|ChangeToolAction|Name|Kind|CMMTempCorrection|Scale|Temperature|[XYZ]0|Theta|Psi|Phi"
    r"|CenterPart|TiltPart|TiltCenterPart|[A-Z]{2}\w+"
)


def _check_2_5(tag: str, items: tuple[Item, ...]) -> None:
    if tag == "E0000":
        _require(len(items) == 1, items)
        _check_event(items[0], "2.5")
        return
    for kind in (Number, Text, Bare):
        if all(isinstance(item, kind) for item in items):
            return
    if _is_point(items, _POINT_2_5, null=True):
        return
    for item in items:
        name = item.name if isinstance(item, Call) else ""
        _require(_WORDS_2_5.fullmatch(name) or name in _POINT_2_5, items)

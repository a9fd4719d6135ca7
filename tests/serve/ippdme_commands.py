"""Commands for an I++ DME server, valid and broken, with the answers that the tables prescribe.

`Commands` is a model of a session: tools, systems, daemons, user, error state. Each of its cases
has the errors of which one must be answered; several if the published texts contradict
each other or leave the number open.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from tests.serve.ippdme_grammar import Bare, Call, Dialect, Item, Number, Text

NONE = frozenset[int]()
SYSTEMS = ("MachineCsy", "MoveableMachineCsy", "MultipleArmCsy", "PartCsy")
Check = Callable[[list[tuple[Item, ...]]], bool]


@dataclass(frozen=True, slots=True)
class Case:
    text: str
    """Command without its tag; for `whole`, the whole line."""
    errors: frozenset[int] = NONE
    """Numbers of which one must be answered; empty: none may be."""
    may_pass: bool = False
    """Also without an error it conforms."""
    check: Check | None = None
    """Check of the data; None: no data may come."""
    whole: bytes | None = None
    """Line that is sent as it is; its tag may be unreadable."""
    why: str = ""


def _any_lines(data: list[tuple[Item, ...]]) -> bool:
    return bool(data)


def _named(*names: str) -> Check:
    """Return a check of one line with these items in this order: none omitted, none added."""

    def holds(data: list[tuple[Item, ...]]) -> bool:
        found = [item.name for item in data[0] if isinstance(item, Call)] if data else []
        return len(data) == 1 and found == list(names)

    return holds


@dataclass(slots=True)
class Commands:
    """Draw commands; `tools` can be mounted. The client has started a session with a user off."""

    rng: random.Random
    dialect: Dialect
    tools: Sequence[str]
    system: str = "MachineCsy"
    transformations: dict[str, tuple[float, ...]] = field(default_factory=dict)
    user: bool | None = False
    """None: the standard leaves it open."""
    daemon: str = ""
    report: tuple[str, ...] = ("X", "Y", "Z")

    def valid(self) -> Case:
        """Return a command that must succeed."""
        rng = self.rng
        match rng.randrange(21):
            case 0:
                axes = rng.sample(["X", "Y", "Z"], rng.randint(1, 3))
                # Without sight of the probe there is no position.
                return Case(
                    f"Get({self._list([f'{one}()' for one in axes])})",
                    frozenset({1501, 1000, 1503}), may_pass=True, check=_named(*axes),
                )  # fmt: skip
            case 1:
                self.report = tuple(rng.sample(["X", "Y", "Z", "IJK", "ER"], rng.randint(1, 5)))
                return Case(f"OnPtMeasReport({self._list([f'{one}()' for one in self.report])})")
            case 2:
                self.system = rng.choice(SYSTEMS)
                return Case(f"SetCoordSystem({self.system})")
            case 3:
                return Case("GetCoordSystem()", check=self._is_system)
            case 4 | 5:
                return self._transformation()
            case 6:
                name = rng.choice(SYSTEMS[1:])
                wanted = self.transformations.get(name)
                return Case(f"GetCsyTransformation({name})", check=_transforms_as(wanted))
            case 7:
                self.user = True
                return Case("EnableUser()")
            case 8:
                self.user = False
                return Case("DisableUser()")
            case 9:
                return Case("IsUserEnabled()", check=_is_flag("IsUserEnabled", self.user))
            case 10:
                return Case("IsHomed()", check=_is_flag("IsHomed", True))
            case 11:
                self.user = False
                return Case("Home()")
            case 12:
                return Case("EnumTools()", check=self._are_tools)
            case 13:
                tool = rng.choice(list(self.tools))
                return Case(f'FindTool("{tool}")')
            case 14:
                self.user = False
                return Case(f'ChangeTool("{rng.choice(list(self.tools))}")')
            case 15:
                names = rng.sample(["Tool.Name", "Tool.Id", "Tool.PtMeasPar.Search",
                                    "Tool.PtMeasPar.Approach.Max"], rng.randint(1, 4))  # fmt: skip
                command = rng.choice(["GetProp", "GetPropE"])
                return Case(
                    f"{command}({self._list([f'{one}()' for one in names])})", check=_named(*names)
                )
            case 16:
                return Case("GetDMEVersion()", check=_any_lines)
            case 17:
                return Case("GetMachineClass()", check=_any_lines)
            case 18:
                return Case(
                    f"GetErrorInfo({rng.choice([0, 6, 501, 1006, 1501])})", check=_any_lines
                )
            case 19:
                return Case("GetXtdErrStatus()", check=_any_lines)
            case _:
                return Case("EnumProp(Tool.PtMeasPar())", check=_any_lines)

    def daemons(self) -> Case:
        """Return a command that starts or stops a daemon, or a wrong one of these."""
        rng = self.rng
        if self.daemon:
            if rng.random() < 0.4:
                return Case(
                    "OnMoveReportE(Time(1), Dis(1), X())", frozenset({515}), why="second daemon"
                )
            tag, self.daemon = self.daemon, ""
            return Case(rng.choice(["StopAllDaemons()", f"StopDaemon({tag})"]))
        match rng.randrange(3):
            case 0:
                return Case("StopAllDaemons()", frozenset({512}), may_pass=True, why="no daemon")
            case 1:
                return Case("StopDaemon(E9998)", frozenset({513}), why="no such daemon")
            case _:
                self.daemon = "next"
                return Case("OnMoveReportE(Time(1), Dis(1000), X(), Y(), Z())")

    def broken(self) -> Case:
        """Return a command that must be refused, with the numbers that the tables give."""
        rng = self.rng
        kinds = (
            self._bad_tag, self._bad_sign, self._unreadable, self._unknown, self._wrong_count,
            self._wrong_type, self._bad_property, self._bad_number, self._bad_vector,
            self._unknown_name, self._as_command, self._second_start, self._out_of_range,
            self._not_offered,
        )  # fmt: skip
        return rng.choice(kinds)()

    def _list(self, items: Sequence[str]) -> str:
        between = self.rng.choice([",", ", ", " , "])
        return between.join(items)

    def _is_system(self, data: list[tuple[Item, ...]]) -> bool:
        if self.dialect == "2.5":
            return data == [(Bare(self.system),)]
        return data == [(Call("CoordSystem", (Bare(self.system),)),)]

    def _are_tools(self, data: list[tuple[Item, ...]]) -> bool:
        names = [getattr(line[0], "text", getattr(line[0], "name", "")) for line in data]
        return names[:2] == ["RefTool", "NoTool"] and set(self.tools) <= {*names}

    def _transformation(self) -> Case:
        rng = self.rng
        name = rng.choice(SYSTEMS[1:])
        shift = [round(rng.uniform(-500, 500), 4) for _ in range(3)]
        turns = [round(rng.uniform(0, 180), 4), *(round(rng.uniform(-90, 400), 4) for _ in "ab")]
        if rng.random() < 0.2:
            wrong = self._list([*map(str, shift), str(rng.choice([-1, 181])), "0", "0"])
            text = f"SetCsyTransformation({name}, {wrong})"
            return Case(text, frozenset({1007}), why="theta")
        numbers = (*shift, *turns)
        self.transformations[name] = numbers
        return Case(f"SetCsyTransformation({name}, {self._list([*map(str, numbers)])})")

    def _tag(self) -> str:
        return f"{self.rng.randrange(1, 99_999):05d}"

    def _bad_tag(self) -> Case:
        tag = self.rng.choice(
            ["0071", "00000", "E0000", "1234a", "e0001", "F0001", "-0001", " 0001", "000001",
             "E001", "+0001", "0x001", "E00 1", "", "     "]
        )  # fmt: skip
        return Case("", frozenset({1}), whole=f"{tag} GetDMEVersion()".encode(), why="tag")

    def _bad_sign(self) -> Case:
        bad = self.rng.choice([b"\xb5", b"\xfc", b"\t", b"\0", b"\x7f", b"\x1b", b"\xff", b"\r"])
        line = f"{self._tag()} GetDMEVersion()".encode()
        at = self.rng.randrange(6, len(line) + 1)
        return Case("", frozenset({7}), whole=line[:at] + bad + line[at:], why="sign")

    def _unreadable(self) -> Case:
        rng, tag = self.rng, self._tag()
        if rng.random() < 0.2:
            return Case("", frozenset({2}), whole=f"{tag}GetDMEVersion()".encode(), why="space")
        text = rng.choice(
            ["GetDMEVersion", "GetDMEVersion(", "GetDMEVersion)", "GetDMEVersion()x", "()",
             "PtMeas(X(1)", "PtMeas(X(1)),Y(2))", "PtMeas(X(1),,Y(2))", 'FindTool("a)',
             "SetCsyTransformation(PartCsy,1 2)", "GetDMEVersion();", "Get DMEVersion()",
             "GetDMEVersion(,)", "FindTool(\"a\"\"b\")", "1GetDMEVersion()", '"GetDMEVersion"()',
             "GetProp(Tool.PtMeasPar.Search.())", "SetProp(Tool.PtMeasPar.Search.(5))",
             "GetProp(Tool..Name())"]
        )  # fmt: skip
        return Case("", frozenset({8}), whole=f"{tag} {text}".encode(), why="not a command")

    def _unknown(self) -> Case:
        name = self.rng.choice(
            ["GetFoo", "getdmeversion", "PTMEAS", "StartSessions", "XXMyCommand"]
        )
        errors = {501, 507} if self.dialect == "1.4" else {501}
        return Case(f"{name}()", frozenset(errors), why="unknown command")

    def _wrong_count(self) -> Case:
        text = self.rng.choice(
            ["GetDMEVersion(1)", "SetCoordSystem()", "SetCsyTransformation(PartCsy, 1, 2, 3)",
             "SetCsyTransformation(PartCsy, 1, 2, 3, 4, 5, 6, 7)", "ChangeTool()", "FindTool()",
             'FindTool("a", "b")', "PtMeas()", "PtMeas(IJK(0, 0, 1))", "IsHomed(1)",
             "GetErrorInfo()", "StopDaemon()", "EnableUser(1)", "EnumTools(1)", "PtMeas(X(1, 2))",
             "PtMeas(X(), Y(1))", "PtMeas(X(1), IJK(0, 1))", "GetCsyTransformation()", "Get()"]
        )  # fmt: skip
        # The tables do not separate a wrong list, a wrong count within an item and a wrong item.
        inner = {509} if text.startswith("PtMeas(X") else {510} if text == "Get()" else set()
        return Case(text, frozenset({502} | inner), why="count")

    def _wrong_type(self) -> Case:
        text = self.rng.choice(
            ['SetCoordSystem("PartCsy")', "SetCoordSystem(1)", "ChangeTool(1)", "FindTool(Probe1)",
             'GetErrorInfo("0513")', 'SetCsyTransformation("PartCsy", 0, 0, 0, 0, 0, 0)',
             'SetCsyTransformation(PartCsy, "0", 0, 0, 0, 0, 0)', "SetCoordSystem(FooCsy)",
             "SetCsyTransformation(FooCsy, 0, 0, 0, 0, 0, 0)", "StopDaemon(5)", 'PtMeas(X("1"))',
             "PtMeas(X(1), X(2))", "PtMeas(Foo(1), X(1))", "Get(Foo())"]
        )  # fmt: skip
        errors = {502, 505, 506, 509} | ({1013} if self.dialect == "2.5" else set())
        return Case(text, frozenset(errors | {510}), why="type")

    def _bad_property(self) -> Case:
        text, errors = self.rng.choice(
            [("OnPtMeasReport()", {510}), ("OnPtMeasReport(Foo())", {510}),
             ("OnPtMeasReport(X(), Foo())", {510}),
             ("OnMoveReportE(Time(1), Dis(1), Foo())", {510}),
             ("OnPtMeasReport(X(), X())", {510, 502, 509}), ("GetProp(Foo.Bar())", {510}),
             ("GetProp(Tool.Foo())", {510}), ("GetProp()", {510, 502}),
             ("SetProp(Tool.PtMeasPar.Search.Max(5))", {509}), ("SetProp(Tool.Foo(5))", {510, 509}),
             ("EnumProp(Foo())", {510, 509, 505})]
        )  # fmt: skip
        if self.daemon and text.startswith("OnMoveReportE"):
            errors = errors | {515}
        return Case(text, frozenset(errors), why="property")

    def _bad_number(self) -> Case:
        number = self.rng.choice(
            [
                "nan",
                "inf",
                "1E-0007",
                "12345678901234567",
                "1e",
                "1.2.3",
                "--1",
                "0x10",
                "1,5,",
                "1_0",
            ]
        )
        return Case(
            f"SetCsyTransformation(PartCsy, 0, 0, {number}, 0, 0, 0)",
            frozenset({8, 502, 505, 509}), why="number",
        )  # fmt: skip

    def _bad_vector(self) -> Case:
        return Case("PtMeas(X(1), Y(2), Z(3), IJK(0, 0, 0))", frozenset({1010}), why="vector")

    def _unknown_name(self) -> Case:
        name = self.rng.choice(["Probe77", "probe 1", "x" * 60, "NOTOOL", "(", "a,b"])
        return Case(
            f'{self.rng.choice(["ChangeTool", "FindTool", "SetTool"])}("{name}")',
            frozenset({1502}), why="unknown tool",
        )  # fmt: skip

    def _as_command(self) -> Case:
        return Case(
            self.rng.choice(["X()", "X(1)", "IJK()", "IJK(0, 0, 1)", "ER()", "R()", "Z()"]),
            frozenset({508}), why="property as command",
        )  # fmt: skip

    def _second_start(self) -> Case:
        return Case("StartSession()", frozenset({8}), why="second StartSession")

    def _out_of_range(self) -> Case:
        return Case(
            f"SetProp(Tool.PtMeasPar.Search({self.rng.choice(['1e9', '-1e9'])}))", frozenset({504}),
            may_pass=False, why="range",
        )  # fmt: skip

    def _not_offered(self) -> Case:
        text, errors = self.rng.choice(
            [("GoTo(X(1), Y(2), Z(3))", {501, 1011}),
             ("AlignPart(0, 0, 1, 0, 0, 1, 0)", {501, 507}),
             ("CenterPart(0, 0, 0, 1)", {501, 507}), ("LockAxis(X())", {501, 507}),
             ("AlignTool(0, 0, 1, 0)", {501, 1505}),
             ("ScanOnCircle(0, 0, 0, 9, 0, 0, 0, 0, 1, 360, 0, 1)", {2002, 501, 1501})]
        )  # fmt: skip
        if self.dialect == "1.4":
            errors = errors - {1011, 1505}
        return Case(text, frozenset(errors), why="not offered")


def _is_flag(name: str, wanted: bool | None) -> Check:
    def holds(data: list[tuple[Item, ...]]) -> bool:
        allowed = ["0", "1"] if wanted is None else [str(int(wanted))]
        forms = [[(Call(name, (Number(one),)),)] for one in allowed]
        return data in forms or data in [[(Number(one),)] for one in allowed]

    return holds


def _transforms_as(wanted: tuple[float, ...] | None) -> Check:
    def holds(data: list[tuple[Item, ...]]) -> bool:
        if len(data) != 1:
            return False
        calls = [item for item in data[0] if isinstance(item, Call)]
        numbers = [value for call in calls for value in call.numbers]
        if wanted is None:
            return len(numbers) == 6
        apart = np.subtract(numbers, wanted)
        apart[3:] = (apart[3:] + 180.0) % 360.0 - 180.0
        return bool(np.abs(apart).max() < 1e-6)

    return holds


def tool_names(data: list[tuple[Item, ...]]) -> list[str]:
    """Return the tips of an answer to EnumTools, without the reserved names."""
    names = [
        line[0].text if isinstance(line[0], Text) else getattr(line[0], "name", "") for line in data
    ]
    return [name for name in names if name not in ("RefTool", "NoTool", "UnDefTool", "BaseTool")]

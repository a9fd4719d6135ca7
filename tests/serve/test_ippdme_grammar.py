"""The parser of answers decides as NIST's `parserRes` and as the dialect 2.5 do."""

from __future__ import annotations

import pytest

from tests.serve.ippdme_grammar import (
    ERRORS,
    Bare,
    Call,
    Dialect,
    GrammarError,
    Number,
    parse_answer,
)

ACCEPTED = """
00001 &
00001 %
E0007 %
00003 # X(1), Y(2)
00003 # X ( 1 ) ,Y(2)
00003 # Y(2),X(1)
00003 # X(1), Y(2), Z(3), IJK(0, 0, 1), ER(3.0002)
E0007 # X(1)
E0000 # PtMeas(X(10.0012), Y(20.0004), Z(3.0001), IJK(0.0012, -0.0003, 0.9999), ER(3.0002))
E0000 # GoTo(X(1), IJK(0, 0, 0))
E0000 # KeyPress("Done")
E0000 # ChangeTool("Probe1")
E0000 # SetProp(Tool.PtMeasPar.Speed(5))
00003 # GetMachineClass("CartCMM")
00003 # (1, 0, 0)
00003 # 1, 0, 0
00003 # CoordSystem(PartCsy)
00003 # GetCsyTransformation(0, 0, 0, 0, 0, 0)
00003 ! Error(3, 0500, "F", "Emergency stop")
00003 ! Error(3, 0500, "", "Emergency stop")
E0000 ! Error(3, 1501, "Tracking", "Probe not armed")
00003 # Tool.Name("Probe1"), Tool.Id("SN 0042"), Tool.Alignment(0, 0, 1)
00003 # Tool.CollisionVolume()
00003 # Tool.CollisionVolume(OBB, 0, 0, 60, 6, 6, 60, 1, 0, 0, 0, 1, 0, 0, 0, 1)
00003 # Tool.PtMeasPar.Search(50), Tool.GoToPar.Speed.Max(1)
00003 # FoundTool.Name("Probe1"), FoundTool.Id("x"), FoundTool.PtMeasPar.Search.Max(50)
00003 # "any text"
00003 # "Speed.Max","Number"
00003 # DMEVersion("1.4.3")
00003 # ErrStatus( 1 )
00003 # IsHomed(1)
00003 # 1e-7
00003 # 1E-07
00003 # -.5
00003 # 5.
00003 # +5
00003 # ChangeToolAction(MoveMan, X(0), Y(0), Z(0))
00003 # 118.4992, 0.1614, 9.9998, 0, 118.4971, 0.3228, 9.9997, 3
""".strip().splitlines()

REFUSED = """
00003 #X(1)
00003 #  X(1)
00003 # X(1) Y(2)
00003 # X(1); Y(2)
00003 # x(1)
00003 # X(1), X(2)
00003 &\x20
00003 &x
00003 %\x20
00003 # PtMeas(X(1))
E0000 # X(1)
00003 # X(1), Q(0)
00003 # X(1), IJKAct(2)
00003 # X(1), U(2)
E0000 &
E0000 %
00000 %
E0000 # GoTo(X(1), IJK(0, 0, 1))
E0000 # KeyPress(Done)
E0000 # SetProp(Part.Temperature(21))
E0000 # SetProp(Tool.PtMeasPar.Speed.Max(5))
E0000 # OpenToolCollection("x")
E0000 # IsHomed(1)
E0000 # "free text"
00003 # GetMachineClass(CartCMM)
00003 # MachineClass("CartCMM")
00003 # GetMachineClass("CartCMM_TouchTrigger_Fixed_None_ToolChanger_None_None")
00003 # AlignTool(1,0,0)
00003 # CoordSystem("PartCsy")
00003 # CoordSystem(JogDisplayCsy)
00003 # GetCsyTransformation(PartCsy, 0, 0, 0, 0, 0, 0)
00003 # PartCsy
00003 # X0(0),Y0(0),Z0(0),Theta(0),Psi(0),Phi(0)
00003 ! Error(3, 0500, F, "Emergency stop")
00003 ! Error(3, 500, "F", "Emergency stop")
00003 ! Error(3, 0500, "F", "Emergency Stop")
00003 ! Error(2, 0500, "F", "Emergency stop")
00003 !Error(3, 0500, "F", "Emergency stop")
00003 ! Error(2, 1011, "F", "Unable to move")
00003 ! Error(2, 1012, "F", "Bad lock combinations")
00003 ! Error(3, 1013, "F", "Coordinate system not found")
00003 ! Error(3, 8001, "F", "Not still")
00003 # Tool.AvrRadius(3)
00003 # Tool.Radius(3)
00003 # Tool.AlignmentVolume(SPH, 0, 0, 0, 1)
00003 # Tool.ScanPar.Speed(1)
00003 # Part.Temperature(20)
00003 # FoundTool.Alignment(0, 0, 1)
00003 # Tool.Id("<xml/>")
00003 # 1009: text
00003 # Probe1
00003 # DMEVersion(1.4)
00003 # ErrStatus(2)
00003 # IsHomed(01)
00003 # IsHomed(1), IsUserEnabled(0)
00003 # 12345678901234567
00003 # 1E-0007
00003 # nan
00003 # inf
00003 # 1, 2,
00003 # ChangeToolAction(None,X(0),Y(0),Z(0))
0003 # X(1)
00003# X(1)
00003 ? X(1)
00003 # X()
""".strip("\n").splitlines()

ACCEPTED_2_5 = """
00003 # 0
00003 # "CartCMM_TouchTrigger_Fixed_None_ToolChanger_None_None"
00003 # PartCsy
00003 # X0(1.5),Y0(0),Z0(0),Theta(0),Psi(0),Phi(0)
00003 # Probe1
00003 # IsHomed(1)
00003 # ActiveError(1006),Severity(2)
00003 # 0,0,1
00003 # Argument(MoveMan),X(0),Y(0),Z(0)
00003 # X(1),Q(3),IJKAct(2),Tool.Alignment(0,0,1)
E0005 # X(1),Tool.A(NULL)
00003 ! Error(2, 0006, "PtMeas", "Transaction aborted (Use ClearAllErrors To Continue)")
00003 ! Error(3, 8001, "PtMeas", "Not still")
00003 # Part.Temperature(21.4),Part.XpanCoefficient(11.5)
""".strip().splitlines()

REFUSED_2_5 = """
00003 # 0.12345678901234567
00003 # -1.234567890123456
00003 # Probe 1
00003 # X(1),U(2)
00003 ! Error(2, 0006, "PtMeas", "Transaction aborted (Use ClearAllErrors to Continue)")
00003 ! Error(3, 9001, "PtMeas", "Not still")
""".strip().splitlines()


@pytest.mark.parametrize(
    ("dialect", "lines"), [("1.4", ACCEPTED), ("2.5", ACCEPTED_2_5)], ids=["1.4", "2.5"]
)
def test_accepts_the_forms_of_the_dialect(dialect: Dialect, lines: list[str]) -> None:
    for line in lines:
        assert parse_answer(line, dialect).tag == line[:5]


@pytest.mark.parametrize(
    ("dialect", "lines"), [("1.4", REFUSED), ("2.5", REFUSED_2_5)], ids=["1.4", "2.5"]
)
def test_refuses_other_forms(dialect: Dialect, lines: list[str]) -> None:
    passed = []
    for line in lines:
        try:
            parse_answer(line, dialect)
        except GrammarError:
            continue
        passed.append(line)
    assert passed == []


def test_reads_values() -> None:
    answer = parse_answer("00003 # X(-1.5), IJK(0, 0, 1)")
    assert answer.items == (
        Call("X", (Number("-1.5"),)), Call("IJK", (Number("0"), Number("0"), Number("1"))),
    )  # fmt: skip
    (item,) = parse_answer("00003 # CoordSystem(PartCsy)").items
    assert item == Call("CoordSystem", (Bare("PartCsy"),))


def test_table_of_1_4_has_all_errors_of_the_nist_suite() -> None:
    assert len(ERRORS["1.4"]) == 50

"""Dialogues with the server, line by line, over TCP; numbers are compared by their shape."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from ocmm_serve.ippdme._grammar import DmeError
from tests.serve.dme_bench import DmeBench, PlainClient, dme_bench, shape_of
from tests.waiting import wait_until

ABORTED = '! Error(2, 0006, "PtMeas", "Transaction aborted (Use ClearAllErrors to Continue)")'
POINT = "# X(n), Y(n), Z(n), IJK(n, n, n), ER(n)"
TIP = "standard"


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DmeBench]:
    with dme_bench(tmp_path_factory.mktemp("dme")) as bench:
        yield bench


@pytest.fixture
def client(bench: DmeBench) -> Iterator[PlainClient]:
    bench.forget()
    with bench.client() as client:
        assert client.ask("00001 StartSession()") == ["00001 &", "00001 %"]
        yield client
        client.ask("00099 EndSession()")


def check(client: PlainClient, line: str, *data: str) -> None:
    """Ask, and compare the lines between ``&`` and ``%`` by their shape."""
    tag = line[:5]
    expected = [f"{tag} &", *(f"{tag} {one}" for one in data), f"{tag} %"]
    assert [shape_of(one) for one in client.ask(line)] == [shape_of(one) for one in expected]


def error(severity: int, number: int, name: str, text: str) -> str:
    return f'! Error({severity}, {number:04d}, "{name}", "{text}")'


def start(client: PlainClient, *, report: bool = True) -> None:
    check(client, "00002 Home()")
    check(client, f'00003 ChangeTool("{TIP}")')
    if report:
        check(client, "00004 OnPtMeasReport(X(), Y(), Z(), IJK(), ER())")


def test_t1_start(client: PlainClient) -> None:
    check(client, "00002 GetDMEVersion()", '# DMEVersion("1.4.3")')
    check(client, "00003 GetMachineClass()", '# GetMachineClass("CartCMM")')
    check(client, "E0001 GetErrStatusE()", "# ErrStatus(0)")
    check(client, "00004 GetXtdErrStatus()", "# IsHomed(0)", "# IsUserEnabled(0)")
    check(client, "00005 EnumTools()", '# "RefTool"', '# "NoTool"', f'# "{TIP}"')
    check(
        client, "00006 GetProp(Tool.Name(), Tool.Id())", '# Tool.Name("NoTool"), Tool.Id("NoTool")'
    )
    check(client, "00007 GetCoordSystem()", "# CoordSystem(MachineCsy)")
    assert client.ask("00008 GetCsyTransformation(PartCsy)")[1] == (
        "00008 # GetCsyTransformation(0, 0, 0, 0, 0, 0)"
    )
    check(client, "00009 IsUserEnabled()", "# IsUserEnabled(0)")


def test_t2_homing(client: PlainClient) -> None:
    assert client.ask("00002 IsHomed()")[1] == "00002 # IsHomed(0)"
    check(
        client, "00003 PtMeas(X(1), Y(2), Z(3), IJK(0, 0, 1))",
        error(3, 507, "PtMeas", "Illegal command"),
    )  # fmt: skip
    check(client, "00004 ClearAllErrors()")
    check(client, "00005 Home()")
    assert client.ask("00006 IsHomed()")[1] == "00006 # IsHomed(1)"


def test_t3_tools(client: PlainClient) -> None:
    check(client, "00002 Home()")
    check(client, f'00003 FindTool("{TIP}")')
    assert client.ask("00004 GetProp(FoundTool.Name(), FoundTool.PtMeasPar.Search.Max())")[1] == (
        f'00004 # FoundTool.Name("{TIP}"), FoundTool.PtMeasPar.Search.Max(50)'
    )
    check(
        client, f'00005 GetChangeToolAction("{TIP}")',
        "# ChangeToolAction(MoveMan, X(0), Y(0), Z(0))",
    )  # fmt: skip
    check(client, f'00006 ChangeTool("{TIP}")')
    found = client.ask("00007 GetProp(Tool.Name(), Tool.Id(), Tool.Alignment())")[1]
    assert found.startswith(f'00007 # Tool.Name("{TIP}"), Tool.Id("SIMULATED ')
    box = client.ask("00008 GetProp(Tool.CollisionVolume())")[1]
    assert shape_of(box).count("n") - shape_of("00008 # CollisionVolume").count("n") == 15
    members = client.ask("00009 EnumProp(Tool.PtMeasPar())")
    assert '00009 # "Search", "Number"' in members
    assert '00009 # "Search", "Property"' in members
    check(
        client, "00010 SetProp(Tool.PtMeasPar.Search(900))",
        error(1, 504, "SetProp", "Argument out of range"),
    )  # fmt: skip
    assert client.ask("00011 GetProp(Tool.PtMeasPar.Search())")[1] == (
        "00011 # Tool.PtMeasPar.Search(50)"
    )
    check(client, '00012 ChangeTool("Probe77")', error(3, 1502, "ChangeTool", "Tool not found"))
    check(client, "00013 ClearAllErrors()")
    check(client, "00014 ReQualify()")


def test_t4_part_system(client: PlainClient) -> None:
    check(client, "00002 SetCsyTransformation(PartCsy, 100, 50, 20, 0, 0, 90)")
    check(client, "00003 SetCoordSystem(PartCsy)")
    check(client, "00004 GetCoordSystem()", "# CoordSystem(PartCsy)")
    assert client.ask("00005 GetCsyTransformation(PartCsy)")[1] == (
        "00005 # GetCsyTransformation(100, 50, 20, 0, 0, 90)"
    )
    check(client, "00006 Get(X(), Y(), Z())", "# X(n), Y(n), Z(n)")
    check(
        client, "00007 SetCsyTransformation(PartCsy, 0, 0, 0, 200, 0, 0)",
        error(3, 1007, "SetCsyTransformation", "Theta out of range"),
    )  # fmt: skip
    check(client, "00008 ClearAllErrors()")


def test_t5_the_operator_leads(bench: DmeBench, client: PlainClient) -> None:
    start(client)
    check(client, "00005 EnableUser()")
    assert shape_of(client.line()) == f"E0000 # PtMeas({POINT[2:]})"
    bench.server.operate("goto")
    bench.server.operate("Del")
    bench.server.operate("Done")
    lines: list[str] = []
    while not lines or lines[-1] != 'E0000 # KeyPress("Done")':
        lines.append(client.line())
    assert 'E0000 # KeyPress("Del")' in lines
    passed = [one for one in lines if "GoTo" in one]
    assert len(passed) == 1
    assert "IJK(0, 0, 0)" in passed[0]
    client.send("00006 DisableUser()")
    after = client.until("00006 %")
    # Points that were durable before the command are sent before its answer.
    assert {one[:5] for one in after} <= {"00006", "E0000"}


def test_t6_the_client_leads(client: PlainClient) -> None:
    start(client)
    client.send("00005 PtMeas(X(10), Y(20), Z(0), IJK(0, 0, 1))")
    assert client.line() == "00005 &"
    client.send("E0002 GetErrStatusE()")
    assert client.until("E0002 %") == ["E0002 &", "E0002 # ErrStatus(0)", "E0002 %"]
    assert [shape_of(one) for one in client.until("00005 %")] == [f"00005 {POINT}", "00005 %"]
    check(client, "00006 PtMeas(X(40), Y(20), Z(0), IJK(0, 0, 1))", POINT)
    check(client, "00007 PtMeas(X(25), Y(45), Z(0), IJK(0, 0, 1))", POINT)


def pending(bench: DmeBench, client: PlainClient, first: int) -> None:
    """Let one command wait for a touch that does not come, and another wait behind it."""
    client.send(f"{first:05d} PtMeas(X(10), Y(20), Z(0), IJK(0, 0, 1))")
    assert client.line() == f"{first:05d} &"
    bench.built.hand.stop()
    client.send(f"{first + 1:05d} PtMeas(X(40), Y(20), Z(0), IJK(0, 0, 1))")
    assert client.line() == f"{first + 1:05d} &"


def test_t7_no_touch(bench: DmeBench, client: PlainClient) -> None:
    start(client)
    pending(bench, client, 23)
    bench.server.operate("cancel")
    assert client.until("00024 %") == [
        f"00023 {error(2, 1006, 'PtMeas', 'Surface not found')}", "00023 %",
        f"00024 {ABORTED}", "00024 %",
    ]  # fmt: skip
    check(client, "E0003 GetErrStatusE()", "# ErrStatus(1)")
    assert client.ask("E0003 GetErrStatusE()")[1] == "E0003 # ErrStatus(1)"
    check(
        client, "00025 Get(X(), Y(), Z())", error(2, 514, "Get", "Use ClearAllErrors to continue")
    )
    check(client, "00026 ClearAllErrors()")
    check(client, "00027 GetErrorInfo(1006)", '# "Surface not found"')
    check(client, "00028 Get(X(), Y(), Z())", "# X(n), Y(n), Z(n)")


def test_t8_abort(bench: DmeBench, client: PlainClient) -> None:
    start(client)
    pending(bench, client, 33)
    client.send("E0004 AbortE()")
    assert client.until("E0004 %") == [
        "E0004 &", f"00033 {ABORTED}", "00033 %", f"00034 {ABORTED}", "00034 %", "E0004 %",
    ]  # fmt: skip
    check(client, "00035 ClearAllErrors()")


def test_t9_moves(client: PlainClient) -> None:
    check(client, "00041 EnableUser()")
    check(client, "E0005 OnMoveReportE(Time(5), Dis(0.5), X(), Y(), Z())")
    moves: list[str] = []
    while len(moves) < 3:
        moves += [one for one in [client.line()] if one.startswith("E0005")]
    assert {shape_of(one) for one in moves} == {"E0005 # X(n), Y(n), Z(n)"}
    client.send("E0006 OnMoveReportE(Time(1), Dis(1), X())")
    assert f"E0006 {error(2, 515, 'OnMoveReportE', 'Daemon already exists')}" in (
        client.until("E0006 %")
    )
    client.ask("00042 ClearAllErrors()")
    client.ask("00043 StopDaemon(E0005)")
    assert f"00044 {error(2, 513, 'StopDaemon', 'Daemon does not exist')}" in (
        client.ask("00044 StopDaemon(E0005)")
    )
    client.ask("00045 ClearAllErrors()")
    client.ask("00046 DisableUser()")
    check(
        client, "00047 StopAllDaemons()",
        error(1, 512, "StopAllDaemons", "No daemons are active"),
    )  # fmt: skip


def test_t10_unasked(bench: DmeBench, client: PlainClient) -> None:
    check(client, f'00050 ChangeTool("{TIP}")')
    # As if this tip had been mounted at the machine since.
    bench.server.post(lambda: setattr(bench.state, "tool", "before"))
    assert client.line() == f'E0000 # ChangeTool("{TIP}")'
    bench.server.operate("search 10")
    bench.server.post(lambda: bench.session.report(DmeError(1501, "Tracking")))
    assert client.line() == "E0000 # SetProp(Tool.PtMeasPar.Search(10))"
    assert client.line() == f"E0000 {error(3, 1501, 'Tracking', 'Probe not armed')}"
    assert client.ask("E0007 GetErrStatusE()")[1] == "E0007 # ErrStatus(1)"
    check(client, "00051 ClearAllErrors()")
    bench.server.post(lambda: bench.session.report(DmeError(503, "Rig")))
    assert client.line() == f"E0000 {error(9, 503, 'Rig', 'Controller communications failure')}"


def test_a_lost_touch_is_repeated_by_the_virtual_hand(bench: DmeBench, client: PlainClient) -> None:
    start(client)
    client.send("00053 PtMeas(X(10), Y(20), Z(0), IJK(0, 0, 1))")
    assert client.line() == "00053 &"
    bench.server.post(bench.built.hand.stop)
    bench.server.post(lambda: bench.machine.remind(0.0))
    assert shape_of(client.until("00053 %")[0]) == f"00053 {POINT}"


def test_t11_no_scans(client: PlainClient) -> None:
    start(client, report=False)
    check(client, "00063 OnScanReport(X(), Y(), Z(), Q())")
    check(
        client, "00064 ScanOnLine(0, 0, 0, 50, 0, 0, 0, 0, 1, 1)",
        error(3, 2002, "ScanOnLine", "Type of probe does not allow this operation"),
    )  # fmt: skip
    check(client, "00065 ClearAllErrors()")


def test_t12_bad_lines(client: PlainClient) -> None:
    client.send("0071 GetDMEVersion()")
    assert client.line() == f"E0000 {error(2, 1, 'Protocol', 'Illegal tag')}"
    check(client, "00072 ClearAllErrors()")
    check(client, "00073 GetFoo()", error(3, 501, "GetFoo", "Unsupported command"))
    check(client, "00074 ClearAllErrors()")
    check(client, "00075 PtMeas(IJK(0, 0, 1))", error(3, 502, "PtMeas", "Incorrect arguments"))
    check(client, "00076 ClearAllErrors()")
    check(client, "00077 OnPtMeasReport()", error(3, 510, "OnPtMeasReport", "Bad property"))
    check(client, "00078 ClearAllErrors()")


def test_t13_end(bench: DmeBench, client: PlainClient) -> None:
    check(
        client, "00091 StopAllDaemons()",
        error(1, 512, "StopAllDaemons", "No daemons are active"),
    )  # fmt: skip
    check(client, "00092 DisableUser()")
    check(client, "00093 EndSession()")
    wait_until(lambda: not bench.state.in_session)

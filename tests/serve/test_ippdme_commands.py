"""Every command, valid or broken, gets the answer that the tables of I++ DME prescribe."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.serve.ippdme_client import DmeClient, replay, session
from tests.serve.ippdme_commands import Case, Commands, tool_names
from tests.serve.ippdme_grammar import ERRORS, Dialect
from tests.serve.ippdme_server import ServedProcess, served


@pytest.fixture(scope="module", params=["1.4", "2.5"])
def dialect(request: pytest.FixtureRequest) -> Dialect:
    return "1.4" if request.param == "1.4" else "2.5"


@pytest.fixture(scope="module")
def server(dialect: Dialect, tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedProcess]:
    out = tmp_path_factory.mktemp(f"served-{dialect}")
    with served(out, "--dialect", dialect) as process:
        yield process


def _judge(case: Case, client: DmeClient, commands: Commands) -> tuple[str, bool]:
    """Send a case; return how its answer differs, empty if not, and whether errors are pending."""
    if case.whole is not None:
        error = client.send_whole(case.whole)
        if error is None or error.number not in case.errors:
            return f"{case.whole!r}: {error}, expected {sorted(case.errors)}", error is not None
        return "", error.severity >= 2
    done = client.call(case.text)
    numbers, pending = done.numbers, any(error.severity >= 2 for error in done.errors)
    name = case.text.partition("(")[0]
    if commands.daemon == "next":
        commands.daemon = done.tag
    if not numbers and not (case.errors and not case.may_pass):
        data = [] if name == "OnMoveReportE" else done.data
        good = not data if case.check is None else case.check(data)
        return "" if good else f"{case.text}: {done.data}", False
    if not numbers or not case.errors or not set(numbers) <= case.errors:
        return f"{case.text}: {numbers}, expected {sorted(case.errors)} ({case.why})", pending
    wrong = {error.function for error in done.errors} - {name}
    return f"{case.text}: the error is of {wrong}" if wrong else "", pending


def _recover(client: DmeClient, commands: Commands, rng: random.Random) -> list[str]:
    faults = []
    if rng.random() < 0.15:
        locked = client.call("GetDMEVersion()").numbers
        if locked != [514]:
            faults.append(f"GetDMEVersion() in error state: {locked}")
    if rng.random() < 0.15:
        (state,) = client.call("GetErrStatusE()").only
        if "1" not in str(state):
            faults.append(f"GetErrStatusE() in error state: {state}")
    if client.call("ClearAllErrors()").errors:
        faults.append("ClearAllErrors() failed")
    commands.user = None
    return faults


def _abort(client: DmeClient, rng: random.Random) -> list[str]:
    """Abort up to three measurements that wait; return the faults."""
    waiting = []
    for _ in range(rng.randint(0, 3)):
        made = client.start("PtMeas(X(10), Y(20), Z(0), IJK(0, 0, 1))")
        waiting.append(client.acknowledged(made))
        if made.done:
            break
    abort = client.start("AbortE()")
    client.finish(abort)
    faults = [] if not abort.errors else [f"AbortE: {abort.numbers}"]
    for made in waiting:
        if not made.done:
            faults.append(f"{made.tag} is open behind AbortE")
    late = client.call("GetDMEVersion()").numbers
    if late != [514]:
        faults.append(f"behind AbortE: {late}, expected 514")
    return faults


def test_answers_commands_with_the_error_of_the_table(
    dialect: Dialect, server: ServedProcess, repeats: Callable[..., int]
) -> None:
    rng = random.Random(42)  # noqa: S311 - commands that can be repeated
    faults: list[str] = []
    with session(server.address, dialect) as client:
        client.good("Home()")
        commands = Commands(rng, dialect, tool_names(client.good("EnumTools()").data))
        client.good(f'ChangeTool("{commands.tools[0]}")')
        client.good("DisableUser()")
        client.good("SetCoordSystem(MachineCsy)")
        for _ in range(repeats(250, 5000)):
            draw = rng.random()
            if draw < 0.02:
                faults += _abort(client, rng)
                faults += _recover(client, commands, rng)
                continue
            case = (
                commands.valid() if draw < 0.45
                else commands.daemons() if draw < 0.55
                else commands.broken()
            )  # fmt: skip
            fault, pending = _judge(case, client, commands)
            faults += [fault] if fault else []
            if pending:
                faults += _recover(client, commands, rng)
        client.call("ClearAllErrors()")
    assert not faults, "\n".join(sorted(set(faults)))
    assert "Traceback" not in server.text


def test_requires_a_session(dialect: Dialect, server: ServedProcess) -> None:
    with DmeClient(server.address, dialect) as client:
        # Without a session, it does nothing.
        assert client.call("EndSession()").numbers == []
        for text in ("GetDMEVersion()", "Get(X())", "GetErrStatusE()"):
            assert client.call(text).numbers == [507 if dialect == "1.4" else 8]
        client.good("StartSession()")
        client.good("GetDMEVersion()")
        client.good("EndSession()")


def test_clears_the_error_state_by_a_fresh_session(dialect: Dialect, server: ServedProcess) -> None:
    with DmeClient(server.address, dialect) as client:
        client.good("StartSession()")
        assert client.call("GetFoo()").numbers
        assert client.call("GetDMEVersion()").numbers == [514]
        client.good("EndSession()")
        client.good("StartSession()")
        client.good("GetDMEVersion()")
        client.good("EndSession()")


def test_starts_each_session_with_the_default_report(
    dialect: Dialect, server: ServedProcess
) -> None:
    with session(server.address, dialect) as client:
        client.good("SetCsyTransformation(PartCsy, 1, 2, 3, 4, 5, 6)")
        client.good("SetCoordSystem(PartCsy)")
        client.good("OnMoveReportE(Time(1), Dis(1000), X())")
    with session(server.address, dialect) as client:
        # Systems stay, daemons end.
        assert "PartCsy" in str(client.good("GetCoordSystem()").only)
        assert set(client.call("StopAllDaemons()").numbers) <= {512}
        client.good("SetCoordSystem(MachineCsy)")


def test_refuses_a_second_client(dialect: Dialect, server: ServedProcess) -> None:
    with session(server.address, dialect) as client:
        with DmeClient(server.address, dialect) as second, pytest.raises(ConnectionError):
            # It may be answered by an error, and is closed.
            second.pump(lambda: False)
        client.good("GetDMEVersion()")


def test_replays_a_recorded_session(
    dialect: Dialect, server: ServedProcess, tmp_path: Path
) -> None:
    with session(server.address, dialect) as client:
        for text in (
            "GetDMEVersion()", "GetMachineClass()", "EnumTools()", "GetFoo()", "ClearAllErrors()",
            "SetCsyTransformation(PartCsy, 100, 50, 20, 0, 0, 90)", "GetCsyTransformation(PartCsy)",
            "GetErrStatusE()", "IsHomed()",
        ):  # fmt: skip
            client.call(text)
    client.save(tmp_path / "session.txt")
    assert replay(tmp_path / "session.txt", server.address, dialect) == []


def test_explains_every_error_of_the_table(dialect: Dialect, server: ServedProcess) -> None:
    with session(server.address, dialect) as client:
        for number, (_, text) in ERRORS[dialect].items():
            found = client.good(f"GetErrorInfo({number})").data
            assert text.casefold() in str(found).casefold()

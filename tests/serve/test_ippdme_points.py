"""Points of I++ DME: durable before the answer, equal in the job; refused ones are not sent."""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ocmm_core.calibration.records import ProbeStore, probe_store_folder
from ocmm_core.composition import STANDARD_PROBE, ClimateRequest
from ocmm_core.errors import StorageError
from ocmm_core.storage import JobFile
from ocmm_core.tracking import load_probe
from ocmm_serve.ippdme import DmeDialect, ShiftSign
from ocmm_sim.calibration_scenes import made_probe_record, made_tip_record
from tests.host import amount
from tests.serve.dme_bench import DmeBench, PlainClient, dme_bench, notes_of
from tests.waiting import wait_until

_N = amount(8, 200)
_REFUSED = amount(2, 30)


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DmeBench]:
    folder = tmp_path_factory.mktemp("points")
    with dme_bench(folder, DmeDialect.V25, ShiftSign.OFFSET, tries=1) as bench:
        yield bench


def begin(client: PlainClient, more: str = "") -> None:
    for line in (
        "00001 StartSession()", "00002 Home()", '00003 ChangeTool("standard")',
        "00004 OnPtMeasReport(X(), Y(), Z(), IJK(), ER()" + more + ")",
    ):  # fmt: skip
        assert client.ask(line) == [f"{line[:5]} &", f"{line[:5]} %"]


def numbers(text: str) -> list[float]:
    return [float(one) for one in re.findall(r"-?\d+(?:\.\d+)?", text)]


def test_the_job_holds_what_was_answered_to_the_last_digit(bench: DmeBench) -> None:
    rng, answers, nominals = np.random.default_rng(5), {}, {}
    shift, angles = np.array([10.0, -20.0, 30.0]), (10.0, 20.0, 30.0)
    turn = Rotation.from_euler("zxz", [30.0, 10.0, 20.0], degrees=True).inv()
    job = bench.built.station.job.path
    bench.forget()
    with bench.client() as client:
        begin(client, ", IJKAct(), Q(), R()")
        values = ", ".join(map(str, (*shift.tolist(), *angles)))
        client.ask(f"00005 SetCsyTransformation(PartCsy, {values})")
        client.ask("00006 SetCoordSystem(PartCsy)")
        for number in range(_N):
            place = rng.uniform([-60.0, -30.0, -60.0], [60.0, 30.0, 60.0])
            normal = rng.normal(size=3) * [0.3, 0.3, 0.1] + [0.0, 0.0, 1.0]
            x, y, z = (turn.apply(place) + shift).tolist()
            i, j, k = turn.apply(normal).tolist()
            tag = f"{number + 10:05d}"
            nominals[tag] = place
            found = client.ask(
                f"{tag} PtMeas(X({x:.6f}), Y({y:.6f}), Z({z:.6f}), IJK({i:.6f}, {j:.6f}, {k:.6f}))"
            )
            assert len(found) == 3, found
            answers[tag] = found[1].partition("# ")[2]
            # Durable before it is sent: any reader of the file finds it.
            assert {str(one["tag"]): one["answer"] for one in notes_of(job)} == answers
        assert client.ask("00007 EndSession()")[-1] == "00007 %"
    with JobFile.open(job, read_only=True) as file:
        points = {point.number: point for point in file.points()}
        assert not file.verify()
        assert file.seal().signature is not None
    notes = notes_of(job)
    assert [note["point"] for note in notes] == sorted(points)
    for note in notes:
        point = points[int(str(note["point"]))]
        tip = turn.apply(point.tip_world) + shift
        answer = answers[str(note["tag"])]
        # Half of the last of six decimals, and the rounding of the sum.
        assert np.abs(np.array(numbers(answer)[:3]) - tip).max() <= 0.5001e-6
        assert answer.endswith(f"ER({point.tip_radius:g}), IJKAct(2), Q(0), R(NULL)")
        assert note["nominal"] == pytest.approx(nominals[str(note["tag"])].tolist(), abs=2e-6)
        assert np.isfinite(point.spots).any()
    assert notes[0]["shift"] == "offset"


def test_refused_touches_are_not_answered(bench: DmeBench) -> None:
    bench.forget()
    bench.state.any_place = True
    job = bench.built.station.job.path
    with bench.client() as client:
        begin(client)
        for number in range(_REFUSED):
            bench.told.clear()
            tag = f"{number + 10:05d}"
            # Outside the volume of the calibration, but seen by the cameras.
            client.send(f"{tag} PtMeas(X(0), Y({-112 - number % 5}), Z(0), IJK(0, 0, 1))")
            lines = client.until(f"{tag} %")
            assert [one for one in lines if "#" in one] == []
            assert 'Error(3, 1008, "PtMeas", "Target position out of machine volume")' in lines[1]
            assert any("outside the volume" in words for words in bench.told), bench.told
            client.ask("00008 ClearAllErrors()")
        bench.state.any_place = False
        # Known before the touch.
        assert "1008" in client.ask("00009 PtMeas(X(0), Y(-150), Z(0), IJK(0, 0, 1))")[1]
    wait_until(lambda: not bench.state.in_session)
    assert not bench.built.station.job.stored()[1]
    assert not notes_of(job)


def test_a_touch_elsewhere_is_not_the_point_of_the_program(bench: DmeBench) -> None:
    bench.forget()
    hand = bench.built.hand
    with bench.client() as client:
        begin(client)
        client.ask("00005 SetProp(Tool.PtMeasPar.Search(5))")
        for tag, (place, normal), words in (
            ("00010", ([16.0, 20.0, 0.0], [0.0, 0.0, 1.0]), "mm off the nominal"),
            ("00011", ([10.0, 20.0, 0.0], [0.9, 0.0, 0.43589]), "another side"),
        ):
            bench.told.clear()
            client.send(f"{tag} PtMeas(X(10), Y(20), Z(0), IJK(0, 0, 1))")
            assert client.line() == f"{tag} &"
            hand.stop()
            hand.touch_place(np.array(place), np.array(normal))
            assert 'Error(2, 1006, "PtMeas", "Surface not found")' in client.line()
            assert client.line() == f"{tag} %"
            assert any(words in one for one in bench.told), bench.told
            client.ask("00008 ClearAllErrors()")
        # Taken out of the job, with the reason.
        assert not bench.built.station.job.stored()[1]


def test_a_second_program_is_refused_in_a_sentence(bench: DmeBench) -> None:
    bench.forget()
    with bench.client() as first:
        first.ask("00001 StartSession()")
        with bench.client() as second:
            line = second.line()
            assert "already used by 127.0.0.1. Disconnect that program first." in line
            assert line.startswith("E0000 ! Error(3, 0511, ")
            assert second.line() == ""
        assert first.ask("00002 IsUserEnabled()")[1] == "00002 # IsUserEnabled(0)"
    # The place is free again, without a pause.
    with bench.client() as third:
        assert third.ask("00001 StartSession()") == ["00001 &", "00001 %"]


def test_an_expired_tip_is_an_error_before_any_touch(tmp_path: Path) -> None:
    body = load_probe(STANDARD_PROBE)
    store = ProbeStore(probe_store_folder(tmp_path / "probes", body.name))
    made = datetime.now(UTC) - timedelta(days=700)
    record = made_probe_record(
        made_utc=made.isoformat(), valid_until_utc=(made + timedelta(days=300)).isoformat()
    )
    store.calibrate(record, "technician", "first", made)
    store.qualify(made_tip_record(record), made + timedelta(hours=1))
    with dme_bench(tmp_path / "out", probes=tmp_path / "probes") as bench, bench.client() as client:
        assert client.ask("00001 StartSession()") == ["00001 &", "00001 %"]
        assert client.ask("00002 EnumTools()")[3] == '00002 # "6mm"'
        found = client.ask("00003 Home()")
        assert found[1] == '00003 ! Error(3, 2000, "Home", "Tool not calibrated")'
        assert any("was valid until" in words for words in bench.told), bench.told
        state = client.ask("00004 GetXtdErrStatus()")
        assert any(one.startswith('00004 # "2000 ') for one in state), state
        client.send("00005 ClearAllErrors()")
        # The cause persists.
        assert "00005 %" in client.until('E0000 ! Error(3, 2000, "Rig", "Tool not calibrated")')
        assert "0514" in client.ask("00006 IsHomed()")[1]


def test_a_lost_job_is_an_error_and_no_point(tmp_path: Path) -> None:
    with pytest.raises(StorageError, match="POINTS-001"), dme_bench(tmp_path) as bench:
        _measure_without_job(bench)


def _measure_without_job(bench: DmeBench) -> None:
    job = bench.built.station.job.path
    with bench.client() as client:
        begin(client)
        job.rename(job.with_name("elsewhere.ocmm"))
        failed = 'E0000 ! Error(9, 0503, "Rig", "Controller communications failure")'
        assert client.line() == failed
        client.ask("00004 ClearAllErrors()")
        found = client.ask("00005 PtMeas(X(10), Y(20), Z(0), IJK(0, 0, 1))")
        assert [one for one in found if "#" in one] == []
        assert any("0503" in one or "0514" in one for one in found), found
        assert any("POINTS-001" in words for words in bench.told)


def test_sends_surface_points_and_the_temperature_of_the_part(tmp_path: Path) -> None:
    climate = ClimateRequest(part_c=23.5, sigma_k=0.1)
    with (
        dme_bench(tmp_path, DmeDialect.V25, surface=True, climate=climate) as bench,
        bench.client() as client,
    ):
        begin(client)
        found = client.ask("00005 GetProp(Part.Temperature())")
        assert found[1] == "00005 # Part.Temperature(23.5)"
        normals = [np.array([0.0, 0.0, 1.0]), np.array([0.3, 0.2, 0.9]), None]
        for number, normal in enumerate(normals):
            nominal = "" if normal is None else f", IJK({', '.join(map(str, normal.tolist()))})"
            line = client.ask(f"00006 PtMeas(X({10 * number}), Y(20), Z(0){nominal})")[1]
            values = numbers(line)[1:]
            point = bench.built.station.job.stored()[1][-1]
            out = point.direction if normal is None else normal / np.linalg.norm(normal)
            expected = point.tip_world - point.tip_radius * out
            # Six decimals are sent.
            np.testing.assert_allclose(values, [*expected, *out, 0.0], atol=5.1e-7)
        # The program reads the values that it has set.
        client.ask("00007 SetProp(Part.Temperature(21.25))")
        found = client.ask("00008 GetProp(Part.Temperature())")
        assert found[1] == "00008 # Part.Temperature(21.25)"


def test_edition_2_5_answers_in_its_own_form(bench: DmeBench) -> None:
    bench.forget()
    with bench.client() as client:
        assert (
            client.ask("00001 IsHomed()")[1]
            == '00001 ! Error(3, 0008, "IsHomed", "Protocol error")'
        )
        client.ask("00002 StartSession()")
        for line, *answers in (
            ("GetDMEVersion()", 'DMEVersion("2.5")'),
            ("GetErrStatusE()", "0"),
            ("GetCoordSystem()", "MachineCsy"),
            ("EnumTools()", "RefTool", "NoTool", "standard"),
            ("Tool()", "NoTool"),
            ("GetCsyTransformation(PartCsy)", "X0(0), Y0(0), Z0(0), Theta(0), Psi(0), Phi(0)"),
            ("SetProp(Part.Temperature(21.5))",),
            ("GetProp(Part.Temperature(), Part.XpanCoefficient())",
             "Part.Temperature(21.5), Part.XpanCoefficient(0)"),
            ('SaveNamedCsyTransformation("A", 1, 2, 3, 10, 20, 30)',),
            ('LoadCoordSystem("A")',),
            ('GetNamedCsyTransformation("A")',
             "X0(1), Y0(2), Z0(3), Theta(10), Psi(20), Phi(30)"),
            ("EnumCoordSystems()", '"A"'),
            ('GetChangeToolAction("standard")', "Argument(MoveMan), X(0), Y(0), Z(0)"),
            ("GetXtdErrStatus()", "IsHomed(0)", "IsUserEnabled(0)",
             "ActiveError(8000), Severity(0)"),
        ):  # fmt: skip
            expected = ["00003 &", *(f"00003 # {one}" for one in answers), "00003 %"]
            assert client.ask(f"00003 {line}") == expected
        assert client.ask('00004 LoadCoordSystem("B")')[1] == (
            '00004 ! Error(3, 1013, "LoadCoordSystem", "Coordinate system not found")'
        )

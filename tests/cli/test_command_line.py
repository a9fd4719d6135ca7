"""The command line as a stranger uses it: real processes, their output and exit codes."""

from __future__ import annotations

import csv
import re
import socket
from pathlib import Path

import pytest

from ocmm_core.documents import resource
from ocmm_core.storage import JobFile
from tests.commands import Ocmm
from tests.host import on_linux_only
from tests.short_plan import ball_plan_in, wire_plan_in

QUICK = resource("plans", "quick.toml")
DEMO = resource("plans", "demo.toml")


def edited(path: Path, source: Path, old: str, new: str) -> Path:
    """Return a copy of a document with one text replaced; the text must be there."""
    text = source.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new), "utf-8")
    return path


def test_measure_conforms_with_exit_code_0_and_writes_job_and_report(
    ocmm: Ocmm, tmp_path: Path
) -> None:
    done = ocmm("measure", "--plan", QUICK, "--out", "out", "--seed", "3")
    assert (done.returncode, done.stderr) == (0, "")
    with (tmp_path / "out/QUICK-001_SIMULATED_report.csv").open(newline="") as stream:
        rows = {row["Name"]: row for row in csv.DictReader(stream)}
    truth = {"Ball diameter": 19.989, "Block step": 20.342}
    assert rows.keys() == truth.keys()
    for name, true in truth.items():
        # k = 2 misses in one of 20 runs; 2 U in one of 16,000, and the seed is fixed.
        stated = float(rows[name]["Uncertainty"])
        assert abs(float(rows[name]["Measured"]) - true) < 2.0 * stated < 0.08
        assert rows[name]["Test"] == "Pass"
        assert rows[name]["Measured"] in done.stdout
    assert len((tmp_path / "out/QUICK-001_SIMULATED_points.csv").read_text().splitlines()) == 14
    with JobFile.open(tmp_path / "out/QUICK-001.ocmm", read_only=True) as job:
        assert len(job.points()) == 14
        assert job.verify() == []


def test_a_part_out_of_tolerance_gives_exit_code_1(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    plan = edited(
        tmp_path / "plan.toml",
        QUICK,
        "nominal = 19.989\nlower = -0.08",
        "nominal = 19.989\nlower = 0.06",
    )
    done = ocmm_here("measure", "--rig", slow_rig, "--plan", plan, "--out", "out")
    assert done.returncode == 1
    assert re.search(r"Ball diameter .*NOT CONFORM", done.stdout)
    assert done.stdout.splitlines()[-2:] == [
        "NOT CONFORM: Ball diameter", "PART DOES NOT CONFORM"
    ]  # fmt: skip


def test_a_value_at_its_limit_is_not_proven_and_gives_exit_code_1(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    assert ocmm_here("measure", "--rig", slow_rig, "--plan", QUICK, "--out", "out").returncode == 0
    with (tmp_path / "out/QUICK-001_SIMULATED_report.csv").open(newline="") as stream:
        step = float(list(csv.DictReader(stream))[1]["Measured"])
    # The same measurement again, with the upper limit where its value lies.
    limits = "nominal = 20.34\nlower = -0.08\nupper = "
    plan = edited(tmp_path / "plan.toml", QUICK, f"{limits}0.08", f"{limits}{step - 20.34:.4f}")
    done = ocmm_here("measure", "--rig", slow_rig, "--plan", plan, "--out", "out")
    assert done.returncode == 1
    assert re.search(r"Block step .*NOT PROVEN", done.stdout)


def test_the_same_seed_gives_the_same_report_and_another_seed_another(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    plan = wire_plan_in(tmp_path)
    for folder, seed in (("a", "5"), ("b", "5"), ("c", "6")):
        done = ocmm_here(
            "measure", "--rig", slow_rig, "--plan", plan, "--out", folder, "--seed", seed
        )
        assert done.returncode == 0
    reports = {f: next((tmp_path / f).glob("*-001_SIMULATED_report.csv")) for f in "abc"}
    report = {f: path.read_bytes() for f, path in reports.items()}
    assert report["a"] == report["b"] != report["c"]


def test_a_recording_is_measured_to_the_same_report(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    common = ("measure", "--rig", slow_rig, "--plan", QUICK)
    done = ocmm_here(*common, "--out", "live", "--record", "run.ocmmrec")
    assert done.returncode == 0
    done = ocmm_here(
        *common, "--out", "again", "--source", "replay:run.ocmmrec", "--serial", "A-9",
        "--parts", "2",
    )  # fmt: skip
    # Nobody is there to put the second part in its place: it is not measured.
    assert done.returncode == 2
    assert "Part 2 of 2 is next, serial A-10." in done.stdout
    assert "Part 2 of 2 was not started" in done.stderr
    assert "--serial A-10 --parts 1" in done.stderr
    assert len(list((tmp_path / "again").glob("*.ocmm"))) == 1
    reports = [tmp_path / folder / "QUICK-001_SIMULATED_report.csv" for folder in ("live", "again")]
    assert reports[0].read_bytes() == reports[1].read_bytes()


def test_record_writes_what_replay_reads(ocmm_here: Ocmm, tmp_path: Path) -> None:
    done = ocmm_here("record", "--plan", QUICK, "--out", "run.ocmmrec", "--seconds", "1")
    assert done.returncode == 0
    assert "8000 frames" in done.stdout
    done = ocmm_here("measure", "--plan", QUICK, "--out", "out", "--source", "replay:run.ocmmrec")
    assert done.returncode == 2
    assert "Missing: BED" in done.stderr


def test_headless_demo_prints_measured_and_true_values(ocmm_here: Ocmm) -> None:
    done = ocmm_here("demo", "--headless", "--plan", QUICK)
    assert done.returncode == 0
    assert re.search(r"Ball diameter +19\.9890 .* 19\.9890 +[+-]0\.0\d+ +CONFORM", done.stdout)
    assert done.stdout.splitlines()[-2:] == [
        "SIMULATED: No real part was measured.", "PART CONFORMS"
    ]  # fmt: skip


@pytest.mark.parametrize("command", ["", "demo", "measure", "record", "rig", "bench"])
def test_help_reads_like_documentation(ocmm_here: Ocmm, command: str) -> None:
    done = ocmm_here(*filter(None, [command]), "--help")
    assert done.returncode == 0
    assert "Usage: " in done.stdout
    assert len(done.stdout.splitlines()) > 8


def an_address() -> str:
    """Return an interface of this machine that has an address, the loopback one."""
    return next(name for _, name in socket.if_nameindex() if name.startswith("lo"))


BAD_INPUT: dict[str, tuple[list[str], list[str]]] = {
    "missing plan": (["--plan", "none.toml"], ["none.toml", "file not found"]),
    "truncated plan": (["--plan", "truncated.toml"], ["truncated.toml", "not valid TOML"]),
    "wrong unit": (["--plan", "inch.toml"], ["inch.toml", "'unit'", "'inch'", "millimetres"]),
    "wrong schema": (["--rig", str(QUICK)], ["quick.toml", "'schema'", "ocmm.rig/1"]),
    "NaN": (["--plan", "nan.toml"], ["nan.toml", "features[0].point", "nan"]),
    "ambiguous probe": (["--probe", "ambiguous.toml"], ["ambiguous.toml", "LED", "tip"]),
    "camera named twice": (["--rig", "twice.toml"], ["twice.toml", "name 'left'"]),
    "no features": (["--plan", "empty.toml"], ["empty.toml", "features"]),
    "unwritable folder": (["--out", "/proc/ocmm"], ["/proc/ocmm"]),
    "output is a file": (["--out", "inch.toml"], ["inch.toml"]),
    "interface missing": (["--source", "ethercat:nope0"], ["nope0"]),
    "interface with an address": (["--source", f"ethercat:{an_address()}"], [an_address()]),
    "interface name too long": (["--source", "ethercat:" + "x" * 40], ["15"]),
    "unknown source": (["--source", "bluetooth"], ["source is 'bluetooth'", "simulated"]),
    "recording missing": (["--source", "replay:none.rec"], ["none.rec", "No such file"]),
    "recording foreign": (["--source", f"replay:{QUICK}"], ["quick.toml"]),
    "feature not in the part": (["--plan", "other.toml"], ["HOLE", "DEMO_PART"]),
}


@pytest.fixture
def bad_documents(tmp_path: Path) -> None:
    text = QUICK.read_text("utf-8")
    (tmp_path / "truncated.toml").write_text(text[: text.index('shape = "Plane"') + 9], "utf-8")
    edited(tmp_path / "inch.toml", QUICK, 'unit = "mm"', 'unit = "inch"')
    edited(tmp_path / "nan.toml", QUICK, "point = [0.0, 0.0, 0.0]", "point = [nan, 0.0, 0.0]")
    edited(tmp_path / "other.toml", QUICK, '"BED"', '"HOLE"')
    head = text[: text.index("[[features]]")]
    (tmp_path / "empty.toml").write_text(head + "features = []\ncharacteristics = []\n", "utf-8")
    probe = resource("probes", "thesis.toml").read_text("utf-8")
    bare = re.sub(r"\[\[orientation_rules\]\][^\[]*(\[[^\[]*){2}", "", probe)
    assert "orientation_rules" not in bare
    (tmp_path / "ambiguous.toml").write_text(bare, "utf-8")
    recommended = resource("rigs", "recommended.toml")
    edited(tmp_path / "twice.toml", recommended, 'name = "right"', 'name = "left"')


@pytest.mark.parametrize("case", BAD_INPUT)
@pytest.mark.usefixtures("bad_documents")
def test_bad_input_gives_one_sentence_and_exit_code_2(ocmm_here: Ocmm, case: str) -> None:
    arguments, words = BAD_INPUT[case]
    given = {"--plan": str(QUICK), "--out": "out"}
    given.update(zip(arguments[::2], arguments[1::2], strict=True))
    done = ocmm_here("measure", *(text for pair in given.items() for text in pair))
    assert done.returncode == 2
    assert done.stderr.startswith("ocmm: ")
    assert "Traceback" not in done.stderr + done.stdout
    for word in words:
        assert word in done.stderr
    what, remedy = done.stderr.strip().split("\n      ")
    assert what.endswith(".")
    assert remedy.endswith(".")


def test_a_name_that_could_run_something_is_refused(ocmm_here: Ocmm, tmp_path: Path) -> None:
    plan = edited(tmp_path / "plan.toml", QUICK, 'name = "Block step"', "name = '=cmd|calc'")
    done = ocmm_here("measure", "--plan", plan, "--out", "out")
    assert done.returncode == 2
    assert "characteristics[1].name" in done.stderr


def test_an_existing_job_is_never_overwritten(
    ocmm_here: Ocmm, tmp_path: Path, slow_rig: Path
) -> None:
    measure = ("measure", "--rig", slow_rig, "--plan", ball_plan_in(tmp_path), "--out", "out")
    assert ocmm_here(*measure).returncode == 0
    first = (tmp_path / "out/BALL-001.ocmm").read_bytes()
    assert ocmm_here(*measure).returncode == 0
    assert (tmp_path / "out/BALL-001.ocmm").read_bytes() == first
    assert (tmp_path / "out/BALL-002_SIMULATED_report.csv").exists()


@on_linux_only
def test_rig_status_says_that_there_is_none(ocmm: Ocmm) -> None:
    done = ocmm("rig", "status")
    assert done.returncode == 0
    assert "No virtual rig" in done.stdout


def test_a_refused_source_leaves_no_job_and_states_no_saved_points(
    ocmm: Ocmm, tmp_path: Path
) -> None:
    done = ocmm("measure", "--source", "ethercat:none7654", "--plan", QUICK)
    assert done.returncode == 2
    assert "none7654" in done.stderr
    assert "saved" not in done.stderr + done.stdout
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []

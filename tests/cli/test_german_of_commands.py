"""German output of commands is German throughout; stored or machine-readable text is not.

Commands with composed sentences run once in German.
"""

from __future__ import annotations

import ast
import io
import re
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import msgspec
import numpy as np
import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_cli.acceptance._acceptance import _print as print_interim
from ocmm_cli.acceptance._msa_report import print_study
from ocmm_cli.calibrate._report import _print_session
from ocmm_cli.calibrate._run import is_yes
from ocmm_cli.calibrate._write_cameras import write_accepted
from ocmm_cli.measure import missing_sentences, print_verdict
from ocmm_cli.station._doctor import Mended
from ocmm_cli.station._station import print_mended
from ocmm_cli.study._fit import _print_rival
from ocmm_cli.terminal import PlainConsole, _console
from ocmm_core.acceptance import InterimCheck, interim_chart
from ocmm_core.calibration.records import Corner
from ocmm_core.doctor import SystemChange
from ocmm_core.documents import resource
from ocmm_core.errors import CalibrationError
from ocmm_core.features.measured import fit_shape
from ocmm_core.features.shapes import Shape
from ocmm_core.tolerances.decisions import PartWord
from ocmm_core.wording import load_translation
from ocmm_shop.studies import plan_study, study_of
from tests.core.calibration.fresh_tips import TIP, Tips
from tests.core.calibration.made_records import make_record, make_verification
from tests.core.features.shape_samples import ideal_points
from tests.generated_jobs import generated_job
from tests.shop.studies.study_site import jobs_of

COMMANDS = Path(__file__).resolve().parents[2] / "ocmm_cli"


@pytest.fixture(autouse=True)
def german(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(_console, "_translation", lambda: load_translation("de"))


def printed(console: PlainConsole) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def page() -> PlainConsole:
    return PlainConsole(file=io.StringIO(), width=200)


def run(*words: object, code: int = 0) -> str:
    done = CliRunner().invoke(app, [*map(str, words)])
    assert done.exit_code == code, (done.output, done.exception)
    return done.output


def test_the_last_line_of_a_job_is_what_scripts_read() -> None:
    words = {word.value for word in PartWord}
    for seed in range(20):
        console = page()
        print_verdict(console, generated_job(seed)[0])
        assert printed(console).splitlines()[-1] in words


def test_what_is_missing_is_german_to_its_end() -> None:
    jobs = [generated_job(seed)[0] for seed in range(20)]
    job = next(one for one in jobs if not one.part_verdict.complete)
    said = missing_sentences(job, Path("a.ocmm"), written=True)
    assert said.startswith("UNVOLLSTÄNDIG: ")
    assert said.endswith(" nicht gemessen.")


def test_a_tip_is_told_in_german_and_its_history_is_kept_as_it_was(tmp_path: Path) -> None:
    tips = Tips(tmp_path / "tips")
    of_tips = ["--probes", tmp_path / "tips"]
    good = run("calibrate", "probe-status", *of_tips)
    assert " mit 2 Ereignissen, 2 Protokollen, 0 Sitzungen" in good
    assert " bei 20.5 C, gültig bis " in good
    mounted = run("calibrate", "mount-tip", TIP, *of_tips, "--who", "Ada")
    assert f"Tastspitze „{TIP}“ ist montiert. Tastspitze „{TIP}“ wurde" in mounted
    assert "mounted" not in mounted
    tips.check()
    assert "ist montiert" not in "".join(event.reason for event in tips.store.events)


def test_a_corner_that_was_not_reached_is_told_with_the_reason_as_it_was_typed() -> None:
    corners = (
        Corner(name="X- Y+ Z-", off=0.4, reached=False, reason="a post stands there"),
        Corner(name="X+ Y+ Z-", off=0.4, reached=False),
    )
    console = page()
    record = msgspec.structs.replace(make_verification(make_record()), corners=corners)
    _print_session(console, record)
    said = printed(console)
    assert "X- Y+ Z-: nicht erreicht, a post stands there" in said
    assert "X+ Y+ Z-: nicht erreicht, kein Grund angegeben" in said


def test_what_was_mended_is_counted() -> None:
    change = msgspec.json.decode(
        b'{"kind": "kernel file", "place": "/sys/a", "before": "0", "after": "1"}',
        type=SystemChange,
    )
    done = [Mended(change), Mended(change, complaint="Permission denied")]
    console = page()
    print_mended(done, _console.tr("taken back"), console)
    assert printed(console) == (
        "  Nicht ausgeführt: /sys/a: Keine Berechtigung\n1 von 2 zurückgenommen.\n"
    )


def test_one_event_is_one() -> None:
    assert [_console.tr(f"1 {one}") for one in ("event", "record", "session")] == [
        "1 Ereignis", "1 Protokoll", "1 Sitzung",
    ]  # fmt: skip


def test_two_elements_through_the_same_points_are_both_named() -> None:
    rng = np.random.default_rng(71)
    one, other = (fit_shape(Shape.SPHERE, ideal_points(Shape.SPHERE, rng, 9)) for _ in range(2))
    console = page()
    _print_rival(console, replace(one, rival=other))
    said = " ".join(printed(console).split())
    assert "Das oben genannte: " in said
    assert " mm. Das andere: " in said
    assert "rms of" not in said


def test_an_interim_check_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    begin = datetime(2026, 11, 25, tzinfo=UTC)
    checks = [
        InterimCheck(
            utc=(begin + timedelta(hours=8 * number)).isoformat(), calibration="c",
            artefact="D-1", tip="t", error_mm=0.002 * float(np.sin(number)), limit_mm=0.025,
        )
        for number in range(26)
    ]  # fmt: skip
    print_interim(interim_chart(checks))
    said = capsys.readouterr().out
    assert said.startswith("Prüfung  26: -0.3 µm")
    assert "from the centre" not in said


def test_a_study_is_planned_and_asked_for(tmp_path: Path) -> None:
    study, jobs = tmp_path / "study.toml", tmp_path / "jobs"
    jobs.mkdir()
    drawn = run("msa", "plan", study, "--name", "S", "--parts", "5", "--trials", "2")
    assert "30 Messungen" in " ".join(drawn.split())
    asked = run("msa", "status", study, jobs)
    assert "0 von 30" in asked
    assert "Next" not in asked
    assert "0 von 30" in run("msa", "run", study, "--out", jobs, "--most", "0")


def test_a_study_of_jobs_is_printed() -> None:
    plan = plan_study("GRR", [f"{one:02}" for one in range(1, 11)], ["Ann", "Bob", "Cid"], 2, 1)
    console = page()
    print_study(console, study_of(plan, jobs_of(plan)))
    said = printed(console)
    assert "10 Werkstücke, 3 Bediener, 2 Durchgänge; 60 von 60 gemessen" in said
    assert "Standard deviations" not in said


def test_cameras_that_store_nothing_are_told_with_what_to_do() -> None:
    console = page()
    record = make_record()
    write_accepted(
        record, "replay:none.h5", resource("rigs", "recommended.toml"), console, force=False
    )
    said = " ".join(printed(console).split())
    assert said.startswith("Die Kameras konnten die Abbildungsparameter nicht speichern: ")
    assert said.endswith(" Danach: ocmm calibrate write-cameras --source replay:none.h5")


def test_a_source_that_ended_too_early_is_told_as_a_whole() -> None:
    error = CalibrationError(
        "calibrate.incomplete",
        "Wave the probe: the source ended. 12 poses to go. At its end: Control point 'A' was not "
        "touched.",
        "Start the command again: it continues this session.",
    )
    assert "Die Quelle endete. Noch 12 Lagen. Am Ende: " in _console.error_text(error)
    error = CalibrationError("a.b", "Show the bar: the source ended. 3 bar placements to go.", "")
    assert _console.error_text(error) == "Show the bar: Die Quelle endete. Noch 3 Maßstablagen."


def test_points_of_a_test_are_planned() -> None:
    said = run("acceptance", "plan", "INTERIM")
    assert re.search(r"^ +1  .*: \d+ Punkte, \(.*\) bis \(", said, re.MULTILINE), said


def test_tests_are_listed_and_a_broken_session_is_left_out(tmp_path: Path) -> None:
    assert "LENGTH-7x5" in run("acceptance", "list")
    (tmp_path / "sessions").mkdir()
    (tmp_path / "sessions" / "broken.chain").write_text("nothing\n", encoding="utf-8")
    said = run("acceptance", "status", "--folder", tmp_path)
    assert "Weggelassen " in said
    assert "Left out" not in said


@pytest.mark.parametrize(
    ("answer", "accepted"),
    [("y", True), ("Ja", True), (" j ", True), ("n", False), ("nein", False), ("", False)],
)
def test_who_is_asked_in_german_answers_in_german(answer: str, accepted: bool) -> None:
    assert is_yes(answer) is accepted


def _names(tree: ast.AST, inside: set[str]) -> Iterator[ast.Call]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            if (name or getattr(node.func, "id", "")) in inside:
                yield node


_SAYING = {"tr", "tr_word", "error_text", "heads", "lead"}
_KEEPING = {"finish", "decide", "decided_code", "accept", "keep", "mount", "excuse_corner"}
"""What these get goes into a signed history."""


def kept_in_a_language(source: str) -> list[str]:
    """Return texts that are translated before they are stored or put into a logged error."""
    found = []
    for function in ast.walk(ast.parse(source)):
        if not isinstance(function, ast.FunctionDef):
            continue
        said = {
            target.id
            for node in ast.walk(function)
            if isinstance(node, ast.Assign) and any(_names(node.value, _SAYING))
            for target in node.targets
            if isinstance(target, ast.Name)
        }
        for call in ast.walk(function):
            if not isinstance(call, ast.Call):
                continue
            name = getattr(call.func, "attr", getattr(call.func, "id", ""))
            if name not in _KEEPING and not name.endswith("Error"):
                continue
            for given in (*call.args, *(one.value for one in call.keywords)):
                inner: list[ast.expr] = [*_names(given, _SAYING)]
                inner += [n for n in ast.walk(given) if isinstance(n, ast.Name) and n.id in said]
                found += [ast.unparse(one) for one in inner]
    return found


@pytest.mark.parametrize(
    "path", sorted(COMMANDS.rglob("*.py")), ids=lambda path: str(path.relative_to(COMMANDS))
)
def test_what_is_kept_is_kept_in_english(path: Path) -> None:
    assert kept_in_a_language(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "line",
    [
        'finish(procedure, site, decision, tr("calibrated"), console)',
        'why = tr("It ended.")\n    raise CalibrationError("a.b", f"It stopped. {why}", "Go on.")',
    ],
)
def test_what_is_kept_in_a_language_is_found(line: str) -> None:
    assert kept_in_a_language(f"def command():\n    {line}\n")

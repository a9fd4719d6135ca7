"""``ocmm acceptance``: list, plan, run, recompute and status of acceptance tests."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from ocmm_cli.terminal import heads, lead, make_console, print_grid, tr, tr_word

if TYPE_CHECKING:
    from ocmm_cli.terminal import PlainConsole
    from ocmm_core.acceptance import AcceptanceRecord, InterimChart
    from ocmm_core.composition import AcceptanceSite


_STYLES = {"PASS": "green", "FAIL": "red"}


@dataclass(frozen=True, slots=True)
class TestSetup:
    """Options that determine the stage of a test."""

    __test__ = False

    procedure: str
    artefact: list[str] | None
    source: str
    rig: Path
    probe: Path
    calibrations: Path | None
    probes: Path | None
    tip: str | None
    seed: int

    def site(self) -> AcceptanceSite:
        """Return the stage of the test; InputError as `open_test_site`."""
        from ocmm_core.composition import open_test_site

        return open_test_site(
            self.procedure, self.artefact or [], self.source, self.rig, self.probe,
            self.calibrations, self.probes, self.tip, self.seed,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class RunSetup(TestSetup):
    """Options of a test that is run."""

    temperature: float | None
    temperature_u: str
    who: str
    speed: float
    folder: Path | None
    force: bool


def interim(*, setup: RunSetup) -> None:
    """Check the system in 90 seconds: two spheres on a bar, at start of shift or after a knock.

    A check that is out is repeated at once. Out again: the points since the last good check are
    held back in every job until a verification passes. Ends with 1 then.
    """
    from ocmm_cli.acceptance._run import room_temperature, run_test
    from ocmm_core.acceptance import InterimHistory, InterimWord, note_check, save_record
    from ocmm_core.composition import StatedConditions, tests_folder

    console, site = make_console(), setup.site()
    base = tests_folder(setup.folder, site)
    history = InterimHistory(base)
    if history.doubt:
        console.show(history.doubt, style="yellow")
    for attempt in range(2):
        given = StatedConditions(who=setup.who, temperature=room_temperature(site, setup))
        record = run_test(replace(site, seed=setup.seed + attempt), base, console, given, setup)
        _print_record(console, record)
        save_record(base / "records", record)
        chart = note_check(history, record, site.cameras.store, datetime.now(UTC))
        _print(chart)
        if chart.word is not InterimWord.REPEAT:
            break
    if chart.word is InterimWord.STOP:
        if site.cameras.store is not None:
            console.show("Held     Points since the last good check, until a verification passes")
        raise typer.Exit(1)


def _print(chart: InterimChart) -> None:
    console, last = make_console(), chart.points[-1]
    known = "" if last.z != last.z else f", {last.z:+.1f} s from the centre"
    console.print(
        tr(f"Check    {len(chart.points)}: {1e3 * last.check.error_mm:+.1f} µm{known}: ")
        + tr_word(last.word.value)
    )
    if last.reason:
        console.print(f"         {tr(last.reason)}")


acceptance_app = typer.Typer(
    no_args_is_help=True,
    help="Acceptance and reverification tests of the instrument, by procedure documents.\n\nEvery "
    "point is stored at once: an interrupted test continues when the command is started again."
    "\n\nExit codes: 0 PASS, 1 FAIL, NOT PROVEN or VOID, 2 could not run.",
)


@acceptance_app.command(name="list")
def list_command() -> None:
    """List the shipped procedures with their standards and limits."""
    from ocmm_core.acceptance import load_procedure, procedure_files

    rows = []
    for name, path in {**procedure_files(), **procedure_files(of_jobs=True)}.items():
        one = load_procedure(path)[0]
        limits = "\n".join(f"{key} {limit.describe()}" for key, limit in one.limits.items())
        rows.append((name, tr_word(one.title), tr(one.wording), limits, f"{one.minutes:g}"))
    print_grid(make_console(), heads("Id", "Title", "Standard", "Limits", "Minutes"), rows)


@acceptance_app.command()
def plan(*, setup: TestSetup) -> None:
    """Print where artefacts go and how many points are taken, in the order that the seed draws."""
    from ocmm_core.acceptance import plan_of

    console, site = make_console(), setup.site()
    positions, notes = plan_of(site.stage)
    console.print(
        f"{tr_word(site.stage.procedure.title)}, {tr(site.stage.procedure.wording)}", highlight=True
    )
    for number, one in enumerate(positions, start=1):
        ends = (one.points_world[0], one.points_world[-1])
        begin, end = ("({:z.0f}, {:z.0f}, {:z.0f})".format(*point) for point in ends)
        count = len(one.points_world) * one.repeats
        console.show(
            f"{number:3}  {tr(one.name)}: {count} points, {begin} to {end} mm, world frame"
        )
    for note in notes:
        console.print(f"{lead('Note     ')}{tr(note)}")


@acceptance_app.command()
def run(
    *, setup: RunSetup, place: str, humidity: str, pressure: str, customer: str,
    condition: Literal["as found", "after adjustment"], retest: bool, new: bool,
    record: Path | None,
) -> None:  # fmt: skip
    """Run a test, or continue it: points are taken as soon as the ball rests where it should."""
    from ocmm_cli.acceptance._run import room_temperature, run_test
    from ocmm_core.acceptance import RoomAir, save_record
    from ocmm_core.composition import StatedConditions, tests_folder

    console, site = make_console(), setup.site()
    base = tests_folder(setup.folder, site)
    given = StatedConditions(
        who=setup.who, place=place, customer=customer, condition=condition,
        temperature=room_temperature(site, setup), air=RoomAir.read(humidity, pressure),
    )  # fmt: skip
    found = run_test(site, base, console, given, setup, retest=retest, new=new, record=record)
    _print_record(console, found)
    console.print(f"{lead('Record   ')}{save_record(base / 'records', found)}")
    _exit(found)


@acceptance_app.command()
def recompute(
    *, file: Path, rig: Path, probe: Path, spots: bool, calibrations: Path | None,
    probes: Path | None, source: str, tip: str | None,
) -> None:  # fmt: skip
    """Compute all numbers of a record from its raw data, and compare."""
    from ocmm_core.acceptance import differences, load_signed_record, recompute_tips
    from ocmm_core.acceptance import recompute as compute
    from ocmm_core.composition import choose_calibration, choose_probe

    console, loaded = make_console(), load_signed_record(file)
    stored, signer = loaded.record, loaded.signer
    again = compute(stored)
    found = differences(stored, again)
    if spots:
        cameras = choose_calibration(source, rig, calibrations, uncalibrated=False)
        body = choose_probe(source, probe, probes, tip, uncalibrated=False).body
        found += recompute_tips(stored, cameras.rig, body)
    console.print(f"{lead('Signed   ')}{signer.word.value}, {signer.signer}")
    _print_record(console, again)
    for one in found:
        console.print(f"{lead('Differs  ')}{tr(one)}", style="red")
    if not signer.sound:
        console.show(f"The record is not vouched for. {signer.fault}", style="red")
    if found or not signer.sound:
        raise typer.Exit(2)
    console.show("Recomputed from raw data: matches the file.")
    _exit(again)


@acceptance_app.command()
def status(*, folder: Path | None) -> None:
    """List the tests of a folder: unfinished ones, and records with their verdicts."""
    from ocmm_core.acceptance import AcceptanceSession, FinishedTest, load_signed_record
    from ocmm_core.composition import default_test_folder
    from ocmm_core.documents import find_files
    from ocmm_core.errors import OcmmError

    console, base = make_console(), folder or default_test_folder()
    rows = []
    files, left_out = find_files(base)
    for fault in left_out:
        console.print(f"{lead('Left out ')}{tr(fault.what)}", style="red")
    for path in (path for path in files if path.match("sessions/*.chain")):
        try:
            view = AcceptanceSession.resume(path).view
        except OcmmError as error:
            console.print(f"{lead('Left out ')}{tr(error.what)}", style="dim")
            continue
        if not (view.finished or view.abandoned):
            wanted = sum(len(one.points_world) * one.repeats for one in view.positions)
            done = f"{sum(view.done)}/{wanted}"
            rows.append((tr_word(view.title), "", done, tr_word("unfinished"), path.name))
    for path in (path for path in files if path.match("records/*.json")):
        try:
            loaded = load_signed_record(path)
        except OcmmError as error:
            console.print(f"{lead('Left out ')}{tr(error.what)}", style="red")
            continue
        one = loaded.record
        states = FinishedTest(path, one, loaded.signer).states
        rows.append((
            one.procedure.id, one.begun_utc[:16], str(len(one.observations)),
            " ".join(map(tr_word, (*states, one.verdict.value))),
            path.name,
        ))  # fmt: skip
    print_grid(console, heads("Test", "Begun", "Points", "Verdict", "File"), rows)


acceptance_app.command()(interim)


def _print_record(console: PlainConsole, record: AcceptanceRecord) -> None:
    from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS

    if record.instrument.simulated:
        console.show("SIMULATED: measured on the virtual rig", style="yellow")
    for why in record.instrument.unproven:
        console.print(f"{tr_word(UNPROVEN_CAMERAS)}: {tr(why)}", style="yellow")
    rule = (
        tr("U taken off the limit")
        if record.procedure.rule == "guarded"
        else tr("simple acceptance")
    )
    console.print(f"{record.procedure.id}, {tr(record.wording)}; {tr('decision rule')}: {rule}")
    rows = []
    for one in record.quantities:
        value = record.values[one.worst]
        rows.append((
            one.quantity, str(one.count), f"{1e3 * one.error_mm:+.1f}",
            f"{1e3 * one.expanded_mm:.1f}", f"{1e3 * one.limit_mm:.1f}",
            f"{tr(value.position)}, {tr_word(value.name)}", tr_word(one.verdict.value),
        ))  # fmt: skip
    columns = heads("Quantity", "N", "Worst, µm", "U (k = 2), µm", "MPE, µm", "At", "Verdict")
    print_grid(console, columns, rows)
    if record.retests:
        count = sum(one.superseded for one in record.values)
        console.show(
            f"Retests  {record.retests}; {count} value{'' if count == 1 else 's'} superseded, "
            "kept in the record",
            highlight=True,
        )
    for refusal in record.refusals:
        console.print(f"{lead('Refused  ')}{tr(refusal.reason)}")
    for reason in record.void_reasons:
        console.print(f"{lead('Void     ')}{tr(reason)}")
    style = _STYLES.get(record.verdict.name, "yellow")
    console.print(f"{lead('Verdict  ')}{tr_word(record.verdict.value)}", style=style)


def _exit(record: AcceptanceRecord) -> None:
    from ocmm_core.acceptance import AcceptanceVerdict

    if record.verdict is not AcceptanceVerdict.PASS:
        raise typer.Exit(1)

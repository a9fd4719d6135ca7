"""``ocmm msa``: gauge R&R, type-1 studies and calibrated parts, from jobs."""

from __future__ import annotations

from pathlib import Path

import typer

from ocmm_cli.acceptance._msa_reference import linearity, part, part_use, type1
from ocmm_cli.terminal import lead, make_console, say

msa_app = typer.Typer(
    no_args_is_help=True,
    help="Measurement system analysis: is the gauge fit for the tolerance.\n\nA study is a plan of "
    "blind codes; each job carries its code as serial number. Every characteristic of the "
    "inspection plan is a study of its own.",
)


@msa_app.command()
def plan(*, file: Path, name: str, parts: int, operators: str, trials: int, seed: int) -> None:
    """Draw the order of a crossed study, and give every measurement a blind code."""
    from ocmm_shop.studies import plan_study, store_plan

    names = [f"{number + 1:0{len(str(parts))}}" for number in range(parts)]
    drawn = plan_study(name, names, [one.strip() for one in operators.split(",")], trials, seed)
    store_plan(file, drawn)
    make_console().print(say(f"Plan     {file}: {len(drawn.runs)} measurements"), highlight=False)


@msa_app.command()
def run(
    *, study: Path, plan: Path, out: Path, source: str, rig: Path, calibrations: Path | None,
    probes: Path | None, seed: int, most: int,
) -> None:  # fmt: skip
    """Measure what is still missing, in the drawn order; prints the operator of each part.

    Values are hidden, so that earlier results do not influence the operator. On the virtual rig
    each measurement has its own rig and part, so that its study tests the program, not a gauge.
    """
    from ocmm_cli.measure import await_part, run_job
    from ocmm_core.composition import Origin, StationRequest, build_station, origin_of
    from ocmm_core.inspection.archive import parts_of_batch
    from ocmm_shop.studies import load_study, open_runs

    console, planned = make_console(), load_study(study)
    seen = {one.serial for one in parts_of_batch(out, planned.name)} if out.is_dir() else set()
    left = open_runs(planned, seen)
    console.print(say(f"Measured {len(planned.runs) - len(left)} of {len(planned.runs)}"))
    for number, one in enumerate(left[:most], start=1):
        console.print(
            say(f"Operator {one.operator}: part {one.part}, code {one.code}"), highlight=False
        )
        if origin_of(source) is not Origin.VIRTUAL:
            await_part(console, number, len(left), one.code, replayed=False)
        request = StationRequest(
            plan=plan, out=out, rig=rig, source=source, seed=seed + planned.runs.index(one),
            operator=one.operator, serial=one.code, batch=planned.name,
            calibrations=calibrations, probes=probes,
        )  # fmt: skip
        run_job(build_station(request), out / "reports", console)
    console.print(f"{lead('To go    ')}{max(len(left) - most, 0)}")


@msa_app.command()
def status(*, study: Path, jobs: Path) -> None:
    """Say how far a study is, and what comes next."""
    from ocmm_core.inspection.archive import parts_of_batch
    from ocmm_shop.studies import load_study, open_runs

    console, planned = make_console(), load_study(study)
    seen = {one.serial for one in parts_of_batch(jobs, planned.name)}
    left = open_runs(planned, seen)
    console.print(say(f"Measured {len(planned.runs) - len(left)} of {len(planned.runs)}"))
    if left:
        one = left[0]
        console.print(
            say(f"Next     operator {one.operator}, part {one.part}, code {one.code}"),
            highlight=False,
        )


@msa_app.command()
def report(
    *, study: Path, jobs: Path, level: float, calibrations: Path | None, probes: Path | None
) -> None:
    """Print gauge R&R of every characteristic, with intervals, and our own U beside the scatter."""
    from ocmm_cli.acceptance._msa_report import print_study
    from ocmm_cli.terminal import progress_line
    from ocmm_shop.studies import load_study, study_jobs

    planned = load_study(study)
    with progress_line() as tell:
        found = study_jobs(
            planned, jobs, level=level, progress=tell, probes=probes, calibrations=calibrations
        )
    print_study(make_console(), found)
    if any(one.study is None for one in found.characteristics):
        raise typer.Exit(1)


for _command in (type1, linearity, part, part_use):
    msa_app.command()(_command)

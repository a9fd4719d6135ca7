"""``ocmm msa``: gauge R&R, type-1 studies and calibrated parts, from jobs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ocmm_cli.terminal import lead, make_console, tr, tr_word
from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_cli.terminal import PlainConsole
    from ocmm_core.inspection.finished import Trend


def type1(
    *, jobs: Path, name: str, reference: float, tolerance: float | None, calibrations: Path | None,
    probes: Path | None,
) -> None:  # fmt: skip
    """Cg and Cgk of one calibrated part that was measured 25 times or more."""
    from ocmm_shop.studies import type1_study

    console = make_console()
    trend, simulated = _found(jobs, name, probes, calibrations)
    width = trend.high - trend.low if tolerance is None else tolerance
    found = type1_study(trend.values, reference, width)
    _say_simulated(console, simulated)
    console.show(
        f"N {found.results}, mean {found.mean:.5f}, s {found.scatter:.5f}, "
        f"bias {found.bias:+.5f} mm (t {found.t:.2f}, "
        f"{'significant' if found.biased else 'not significant'} at 5 %)",
        highlight=True,
    )
    console.show(
        f"Cg {found.cg:.3f} (95 %: {found.cg_low:.2f} to {found.cg_high:.2f}), Cgk {found.cgk:.3f}",
        highlight=True,
    )
    console.show(f"Least tolerance {found.least_tolerance:.4f} mm", highlight=True)
    console.print(tr("CAPABLE") if found.capable else tr("NOT CAPABLE"))
    if not found.capable:
        raise typer.Exit(1)


def linearity(
    *, jobs: Path, name: str, reference: list[str], study: Path | None, picture: Path | None,
    calibrations: Path | None, probes: Path | None,
) -> None:  # fmt: skip
    """Linearity (AIAG): bias over the range, from 5 calibrated parts with 10 results each.

    Exit code 1 where the zero line leaves the 95 % band.
    """
    from ocmm_cli.acceptance._msa_report import linearity_chart, print_linearity
    from ocmm_core.documents import write_atomic
    from ocmm_shop.studies import linearity_of, load_study

    plan = None if study is None else load_study(study)
    references = _references(reference)
    trend, simulated = _found(jobs, name, probes, calibrations)
    found = linearity_of(trend, references, plan)
    console = make_console()
    _say_simulated(console, simulated)
    print_linearity(console, found)
    if picture is not None:
        write_atomic(picture, linearity_chart(found, simulated=simulated).encode("utf-8"))
        console.print(f"{lead('Chart    ')}{picture}")
    if not found.study.linear:
        raise typer.Exit(1)


@dataclass(frozen=True, slots=True)
class CertifiedValue:
    """Certified value of a part, mm, and the temperatures of its use, degrees Celsius."""

    certified: float
    u_cal: float
    u_workpiece: float
    temperature: float | None
    temperature_u: str
    temperatures: tuple[float, float] | None
    u_expansion: float


def part(
    *, jobs: Path, name: str, given: CertifiedValue, procedure: str, task: Path | None,
    out: Path | None, certificate: str, who: str, calibrations: Path | None, probes: Path | None,
) -> None:  # fmt: skip
    """Uncertainty of a measuring task from a calibrated part (modelled on ISO 15530-3), and E_n.

    Each job is one cycle: the part is taken out and clamped again. A kept study gives its U to
    similar tasks (ocmm msa part-use). Exit code 1 where U may not be used.
    """
    from datetime import UTC, datetime

    import numpy as np

    from ocmm_core.acceptance import part_uncertainty
    from ocmm_shop.studies import (
        CalibratedPart,
        load_task,
        make_part_study,
        part_procedure,
        save_part_study,
    )

    if (task is None) != (out is None):
        raise InputError("msa.task", "--task and --out belong together.", "Give both, or none.")
    wanted = None if task is None else load_task(task)
    rule, numbers, _ = part_procedure(procedure)
    console = make_console()
    trend, simulated = _found(jobs, name, probes, calibrations)
    own = [one.uncertainty for one in trend.parts if one.uncertainty is not None]
    stated = float(np.median(own)) if own else None
    results = trend.values.tolist()
    celsius, farthest = _of_use(given.temperature, given.temperature_u)
    found = part_uncertainty(
        results, given.certified, given.u_cal, u_workpiece=given.u_workpiece,
        temperature_c=farthest, u_expansion=given.u_expansion, expanded_model=stated,
    )  # fmt: skip
    _say_simulated(console, simulated)
    console.print(f"{tr_word(rule.title)}, {tr(rule.wording)}")
    console.show(
        f"N {found.results}, bias {found.bias:+.6f}, s {found.scatter:.6f} (mm)", highlight=True
    )
    console.show(
        f"U {found.expanded:.6f} of a corrected result, {found.expanded_uncorrected:.6f} of an "
        "uncorrected one (k = 2, mm)",
        highlight=True,
    )
    few = found.results < numbers.results
    if few:
        console.show(
            f"{numbers.results} results are the least: this U is not used. Measure the part "
            f"again, "
            "each time taken out and clamped again.",
            style="yellow",
            highlight=True,
        )
    if found.normalized is not None:
        word = tr("agrees") if found.normalized <= 1.0 else tr("does NOT agree")
        console.show(
            f"E_n {found.normalized:.2f}: the stated uncertainty {word} with the part",
            highlight=True,
        )
    if wanted is not None and out is not None:
        calibrated = CalibratedPart(
            certificate, given.certified, given.u_cal, given.u_workpiece, celsius,
            given.temperatures, given.u_expansion, stated,
        )  # fmt: skip
        study = make_part_study(
            results, wanted, calibrated, procedure=procedure, characteristic=name, made_by=who,
            now=datetime.now(UTC), simulated=simulated,
        )  # fmt: skip
        path = save_part_study(out, study)
        console.print(f"{lead('Study    ')}{path}")
    if few or (found.normalized or 0.0) > 1.0:
        raise typer.Exit(1)


def part_use(*, study: Path, task: Path, temperature: float | None, temperature_u: str) -> None:
    """Print the U of a study for a similar task; another task is refused with the reason."""
    from ocmm_shop.studies import load_part_study, load_task, uncertainty_for

    loaded = load_part_study(study)
    kept = loaded.record
    if not loaded.signer.sound:
        raise InputError(
            "msa.not_signed",
            f"{study}: the U of this study may not be used. {loaded.signer.fault}",
            "Make the study again from its jobs (ocmm msa part), or trust its key: ocmm key trust.",
        )
    celsius, farthest = _of_use(temperature, temperature_u)
    wanted = load_task(task)
    # The study has to hold at both ends of the interval.
    _ = uncertainty_for(kept, wanted, 2.0 * celsius - farthest)
    found = uncertainty_for(kept, wanted, farthest)
    console = make_console()
    _say_simulated(console, kept.simulated)
    console.show(
        f"{kept.characteristic}: U {found.expanded:.6f} of a result that the bias "
        f"{found.bias:+.6f} was taken off, {found.expanded_uncorrected:.6f} of one as measured "
        "(k = 2, mm)"
    )
    console.print(
        f"{tr(kept.procedure.wording)}, N {found.results}, {kept.made_utc[:10]}, {kept.made_by}",
    )  # fmt: skip


def _of_use(celsius: float | None, stated: str) -> tuple[float, float]:
    """Return the temperature of use, and the end of its interval farthest from 20 °C.

    20 °C without uncertainty if none is given. Raises InputError if it lacks its uncertainty.
    """
    from datetime import UTC, datetime

    from ocmm_core.acceptance import read_temperature

    read = read_temperature(celsius, stated, datetime.now(UTC))
    if read is None:
        return 20.0, 20.0
    return read.celsius, read.celsius + math.copysign(2.0 * read.sigma_k, read.celsius - 20.0)


def _references(texts: list[str]) -> dict[str, float]:
    found: dict[str, float] = {}
    for text in texts:
        part, sign, value = text.rpartition("=")
        try:
            number = float(value)
        except ValueError:
            number = float("nan")
        if not (sign and part.strip() and abs(number) < float("inf")):
            raise InputError(
                "msa.reference", f"'{text}' is no reference.", "Give PART=VALUE, e.g. P1=20.0012."
            )
        if part.strip() in found:
            raise InputError(
                "msa.reference",
                f"Part {part.strip()} has two references.",
                "Give each part one certified value.",
            )
        found[part.strip()] = number
    return found


def _say_simulated(console: PlainConsole, simulated: bool) -> None:
    """Warn that a study of the virtual rig tests the program, not a gauge."""
    if simulated:
        console.show("SIMULATED: the study was measured on the virtual rig", style="yellow")


def _found(
    jobs: Path, name: str, probes: Path | None, calibrations: Path | None
) -> tuple[Trend, bool]:
    """Return one characteristic of a folder's jobs, and whether a virtual rig measured it."""
    from ocmm_core.inspection.finished import compare_folder

    found = compare_folder(jobs, probes=probes, calibrations=calibrations)
    for trend in found.trends:
        if trend.name == name:
            return trend, found.simulated
    known = ", ".join(trend.name for trend in found.trends)
    raise InputError("msa.name", f"There is no characteristic '{name}'.", f"Give one of {known}.")


msa_app: typer.Typer = typer.Typer(
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
    make_console().print(tr(f"Plan     {file}: {len(drawn.runs)} measurements"))


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
    from ocmm_core.inspection.finished import parts_of_batch
    from ocmm_shop.studies import load_study, open_runs

    console, planned = make_console(), load_study(study)
    seen = {one.serial for one in parts_of_batch(out, planned.name)} if out.is_dir() else set()
    left = open_runs(planned, seen)
    console.show(f"Measured {len(planned.runs) - len(left)} of {len(planned.runs)}", highlight=True)
    for number, one in enumerate(left[:most], start=1):
        console.show(f"Operator {one.operator}: part {one.part}, code {one.code}")
        if origin_of(source) is not Origin.VIRTUAL:
            await_part(console, number, len(left), one.code, replayed=False)
        request = StationRequest(
            plan=plan, out=out, rig=rig, source=source, seed=seed + planned.runs.index(one),
            operator=one.operator, serial=one.code, batch=planned.name,
            calibrations=calibrations, probes=probes,
        )  # fmt: skip
        run_job(build_station(request), out / "reports", console)
    console.print(f"{lead('To go    ')}{max(len(left) - most, 0)}", highlight=True)


@msa_app.command()
def status(*, study: Path, jobs: Path) -> None:
    """Say how far a study is, and what comes next."""
    from ocmm_core.inspection.finished import parts_of_batch
    from ocmm_shop.studies import load_study, open_runs

    console, planned = make_console(), load_study(study)
    left = open_runs(planned, {one.serial for one in parts_of_batch(jobs, planned.name)})
    console.show(f"Measured {len(planned.runs) - len(left)} of {len(planned.runs)}", highlight=True)
    if left:
        one = left[0]
        console.show(f"Next     operator {one.operator}, part {one.part}, code {one.code}")


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

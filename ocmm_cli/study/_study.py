"""``ocmm study``: simulated errors of a procedure due to noise alone."""

from __future__ import annotations

import time
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from ocmm_cli.terminal import (
    PartOption,
    PlanOption,
    ProbeOption,
    RigOption,
    computing,
    heads,
    make_console,
    print_grid,
    progress_line,
    say,
    say_word,
)
from ocmm_core.cluster import Site
from ocmm_core.composition import DEMO_PART, DEMO_PLAN, RECOMMENDED_RIG, STANDARD_PROBE
from ocmm_core.documents import resource, write_atomic
from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_sim.scene import ProbeStudy, StudyResult


study_app = typer.Typer(
    no_args_is_help=True, help="Simulate the error of a procedure caused by noise alone."
)

THESIS_RIG = resource("rigs", "thesis.toml")
THESIS_PROBE = resource("probes", "thesis.toml")
_SHOWN = 1500
"""Poses of figure 13: more would hide each other."""


class EstimatorName(StrEnum):
    THESIS = "thesis"
    COMMON = "common"
    BUNDLE = "bundle"


@study_app.callback()
def _study() -> None:
    pass


@study_app.command()
@computing
def probe_calibration(
    *,
    runs: Annotated[int, typer.Option("--runs", help="Simulated calibrations.")] = 3000,
    poses: Annotated[int, typer.Option("--poses", help="Poses per calibration.")] = 10_000,
    estimator: Annotated[
        EstimatorName,
        typer.Option(
            "--estimator",
            help="'thesis': mean of one sphere for each LED; 'common': one centre for all LEDs; "
            "'bundle': adjustment on the spots of a rig, as the product calibrates.",
        ),
    ] = EstimatorName.THESIS,
    ranges: Annotated[
        tuple[float, float, float],
        typer.Option("--range", help="Angles about X, Y and Z: uniform between - and + these, °."),
    ] = (45.0, 45.0, 10.0),
    sigma: Annotated[
        tuple[float, float, float],
        typer.Option("--sigma", help="Noise of a target along X, Y and Z, um; not for 'bundle'."),
    ] = (4.6, 22.7, 4.6),
    probe: Annotated[
        Path, typer.Option("--probe", help="Probe document: LEDs and tip.")
    ] = THESIS_PROBE,
    rig: RigOption = THESIS_RIG,
    spot_sigma: Annotated[
        float, typer.Option("--spot-sigma", help="Noise of a spot, px; for 'bundle'.")
    ] = 0.0105,
    leds: Annotated[
        bool, typer.Option("--leds/--tip-only", help="Whether to average the LEDs too (figure 15).")
    ] = True,
    seed: Annotated[int, typer.Option("--seed", help="Seed of angles and noise.")] = 1,
    processes: Annotated[
        int | None, typer.Option("--processes", help="Default: one per processor.")
    ] = None,
    site: Site,
    out: Annotated[Path, typer.Option("--out", help="Folder for figures and numbers.")] = Path(
        "ocmm-out"
    ),
) -> None:
    """Repeat the simulation of the probe calibration of the thesis (3.2.1).

    Writes figures 13 (the LEDs of one run), 14 (errors of the tip) and 15 (errors of the LEDs) as
    SVG, and the errors of all runs as CSV. The default values are those of the thesis: an RMS error
    of about 0.5 um, below some 1.5 um in every run.
    """
    import numpy as np

    from ocmm_core.camera import load_rig
    from ocmm_core.tracking import load_probe
    from ocmm_sim.scene import ProbeStudy, run_study

    body = load_probe(probe)
    if not max(ranges) > 0.0 or max(map(abs, ranges)) > 180.0 or min(*ranges, *sigma) < 0.0:
        raise InputError(
            "study.range",
            f"The ranges {ranges} or the noise {sigma} are not valid.",
            "Give angles from 0 to 180 degrees, one of them above 0, and noise of 0 or more.",
        )
    study = ProbeStudy(
        leds=body.leds_probe - body.tip_probe,
        ranges=np.radians(ranges),
        sigma=1e-3 * np.array(sigma),
        poses=poses,
        estimator=estimator.value,
        with_leds=leds or estimator is EstimatorName.BUNDLE,
        rig=load_rig(rig) if estimator is EstimatorName.BUNDLE else None,
        spot_sigma_px=spot_sigma,
    )
    console = make_console()
    began = time.monotonic()
    columns = (
        TextColumn(say("Calibrations"), markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("", total=runs)
        result = run_study(
            study, runs, seed, processes, lambda done: bar.update(task, completed=done), site
        )
    elapsed = time.monotonic() - began
    written = _write(study, result, seed, out)
    d = 1e3 * result.distances
    console.print(
        say(
            f"{runs} calibrations of {poses} poses, estimator '{estimator.value}': error of the "
            f"tip "
            f"RMS {np.sqrt(np.mean(d**2)):.3f} um, mean {d.mean():.3f}, largest {d.max():.2f}."
        )
    )
    if study.with_leds:
        led = 1e3 * result.led_errors
        tip = 1e3 * np.sqrt(np.mean(np.sum(result.tip_errors**2, axis=1)))
        console.print(
            say(
                f"LEDs: mean {led.mean():.3f} um, largest {led.max():.2f}; tip in the frame of the "
                f"LEDs RMS {tip:.3f} um."
            )
        )
    console.print(
        say(
            f"{elapsed:.1f} s; {runs * poses / result.cpu_s / 1e6:.2f} million poses per second "
            f"per "
            "processor."
        )
    )
    console.print(f"{say_word('Written')}: {', '.join(str(path) for path in written)}")


@study_app.command()
@computing
def coverage(
    *,
    runs: Annotated[int, typer.Option("--runs", help="Simulated measurements.")] = 200,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the first run.")] = 0,
    plan: PlanOption = DEMO_PLAN,
    rig: RigOption = RECOMMENDED_RIG,
    probe: ProbeOption = STANDARD_PROBE,
    part: PartOption = DEMO_PART,
    site: Site,
) -> None:
    """Say how often value ± U (k = 2) holds the truth.

    Every run measures the part with cameras, a probe and spots of its own errors, drawn from its
    seed. About 95 of 100 should hold it.
    """
    from ocmm_cli.study._coverage import CoverageSetup, coverage_table, run_coverage

    console = make_console()
    with progress_line() as tell:
        found = run_coverage(
            CoverageSetup(plan, rig, probe, part),
            range(seed, seed + runs),
            site,
            lambda done: tell(say(f"Measured {done:d} of {runs:d}"), done / runs),
        )
    console.print(say(f"{runs:d} runs; wanted: 92 to 99 %"), highlight=False)
    rows = [
        (name, f"{100 * covered:.1f}", f"{1e3 * stated:.2f}", f"{1e3 * error:.2f}")
        for name, covered, stated, error in coverage_table(found)
    ]
    columns = heads("Characteristic", "covered %", "mean U um", "RMS error um")
    print_grid(console, columns, rows)


def _write(study: ProbeStudy, result: StudyResult, seed: int, out: Path) -> list[Path]:
    import numpy as np

    from ocmm_cli.terminal import histogram, points_in_space
    from ocmm_sim.scene import ProbeStudy, draw_targets

    d = 1e3 * result.distances
    ranges = " / ".join(f"±{angle:.0f}°" for angle in np.degrees(study.ranges))
    files = {}
    if study.estimator != "bundle":
        child = np.random.SeedSequence(seed).spawn(1)[0]
        few = ProbeStudy(study.leds, study.ranges, study.sigma, min(study.poses, _SHOWN))
        _, points = draw_targets(few, np.random.default_rng(child))
        files["figure_13.svg"] = points_in_space(
            list(points.transpose(1, 0, 2)),
            [f"LED {number + 1}" for number in range(len(study.leds))],
            "LEDs of one simulated calibration",
            f"{len(points)} poses, {ranges}",
        )
    files["figure_14.svg"] = histogram(
        d,
        f"Error of the tip in {len(d)} simulated calibrations",
        f"{study.poses} poses, {ranges}, estimator '{study.estimator}': RMS "
        f"{np.sqrt(np.mean(d**2)):.3f} um, largest {d.max():.2f} um",
        "error of the tip / um",
    )
    if study.with_leds:
        led = 1e3 * result.led_errors
        files["figure_15.svg"] = histogram(
            led,
            f"Mean error of the LEDs in {len(d)} simulated calibrations",
            f"{study.poses} poses, {ranges}, estimator '{study.estimator}': mean {led.mean():.3f} "
            f"um, largest {led.max():.2f} um",
            "mean error of the LEDs / um",
        )
    lines = ["run,dx_mm,dy_mm,dz_mm,tip_in_leds_dx_mm,tip_in_leds_dy_mm,tip_in_leds_dz_mm,led_mm"]
    rows = np.hstack([result.centre_errors, result.tip_errors, result.led_errors[:, None]])
    lines += [
        ",".join([str(number), *(f"{value:.9f}" for value in row)])
        for number, row in enumerate(rows)
    ]
    files["errors.csv"] = "\n".join(lines) + "\n"
    try:
        out.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            write_atomic(out / name, text.encode("utf-8"))
    except OSError as error:
        raise InputError(
            "study.unwritable",
            f"{out}: the results cannot be written ({error.strerror}).",
            "Give a writable folder with --out.",
        ) from error
    return [out / name for name in files]

"""``ocmm study``: simulated errors of a procedure due to noise alone."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from ocmm_cli.options import ComputingSite
from ocmm_cli.terminal import heads, make_console, print_grid, progress_line, tr, tr_word
from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_sim.scene import ProbeStudy, StudyResult


study_app = typer.Typer(
    no_args_is_help=True, help="Simulate the error of a procedure caused by noise alone."
)

_SHOWN = 1500
"""Poses of figure 13: more would hide each other."""


@study_app.callback()
def _study() -> None:
    pass


@dataclass(frozen=True, slots=True)
class CalibrationSetup:
    """The simulated calibrations: angles in degrees, noise in um and px."""

    poses: int
    estimator: Literal["thesis", "common", "bundle"]
    ranges: tuple[float, float, float]
    sigma: tuple[float, float, float]
    probe: Path
    rig: Path
    spot_sigma: float
    leds: bool

    def study(self) -> ProbeStudy:
        import numpy as np

        from ocmm_core.camera import load_rig
        from ocmm_core.tracking import load_probe
        from ocmm_sim.scene import ProbeStudy

        body, ranges, sigma = load_probe(self.probe), self.ranges, self.sigma
        if not max(ranges) > 0.0 or max(map(abs, ranges)) > 180.0 or min(*ranges, *sigma) < 0.0:
            raise InputError(
                "study.range",
                f"The ranges {ranges} or the noise {sigma} are not valid.",
                "Give angles from 0 to 180 degrees, one of them above 0, and noise of 0 or more.",
            )
        return ProbeStudy(
            leds=body.leds_probe - body.tip_probe,
            ranges=np.radians(ranges),
            sigma=1e-3 * np.array(sigma),
            poses=self.poses,
            estimator=self.estimator,
            with_leds=self.leds or self.estimator == "bundle",
            rig=load_rig(self.rig) if self.estimator == "bundle" else None,
            spot_sigma_px=self.spot_sigma,
        )


@study_app.command()
def probe_calibration(
    *, runs: int, setup: CalibrationSetup, seed: int, processes: int | None, site: ComputingSite,
    out: Path,
) -> None:  # fmt: skip
    """Repeat the simulation of the probe calibration of the thesis (3.2.1).

    Writes figures 13 (the LEDs of one run), 14 (errors of the tip) and 15 (errors of the LEDs) as
    SVG, and the errors of all runs as CSV. The default values are those of the thesis: an RMS error
    of about 0.5 um, below some 1.5 um in every run.
    """
    import numpy as np

    from ocmm_sim.scene import run_study

    study = setup.study()
    console = make_console()
    began = time.monotonic()
    columns = (
        TextColumn(tr("Calibrations"), markup=False),
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
    console.show(
        f"{runs} calibrations of {study.poses} poses, estimator '{study.estimator}': error of the "
        f"tip RMS {np.sqrt(np.mean(d**2)):.3f} um, mean {d.mean():.3f}, largest {d.max():.2f}.",
        highlight=True,
    )
    if study.with_leds:
        led = 1e3 * result.led_errors
        tip = 1e3 * np.sqrt(np.mean(np.sum(result.tip_errors**2, axis=1)))
        console.show(
            f"LEDs: mean {led.mean():.3f} um, largest {led.max():.2f}; tip in the frame of the "
            f"LEDs RMS {tip:.3f} um.",
            highlight=True,
        )
    console.show(
        f"{elapsed:.1f} s; {runs * study.poses / result.cpu_s / 1e6:.2f} million poses per second "
        "per processor.",
        highlight=True,
    )
    console.print(
        f"{tr_word('Written')}: {', '.join(str(path) for path in written)}", highlight=True
    )


@study_app.command()
def coverage(
    *, runs: int, seed: int, plan: Path, rig: Path, probe: Path, part: Path, site: ComputingSite
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
            lambda done: tell(tr(f"Measured {done:d} of {runs:d}"), done / runs),
        )
    console.show(f"{runs:d} runs; wanted: 92 to 99 %")
    rows = [
        (name, f"{100 * covered:.1f}", f"{1e3 * stated:.2f}", f"{1e3 * error:.2f}", str(without))
        for name, covered, stated, error, without in coverage_table(found)
    ]
    columns = heads("Characteristic", "covered %", "mean U um", "RMS error um", "without U")
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
    from ocmm_core.export import write_together

    write_together({out / name: text.encode("utf-8") for name, text in files.items()})
    return [out / name for name in files]

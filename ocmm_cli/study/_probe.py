"""``ocmm probe``: performance of a probe before it is built, and tips by other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.text import Text

from ocmm_cli.terminal import (
    PlainConsole,
    heads,
    make_console,
    print_grid,
    print_table_account,
    tr,
    tr_word,
)
from ocmm_core.errors import InputError
from ocmm_core.tables import TableOptions

if TYPE_CHECKING:
    from ocmm_core.measuring import ProbeReport


probe_app = typer.Typer(
    no_args_is_help=True, help="Examine a probe: the uncertainty of its tip and what causes it."
)


@probe_app.callback()
def _probe() -> None:
    pass


@probe_app.command()
def design(
    *, probe: Path, rig: Path, probe_design: Path | None, tilt: tuple[float, float, float],
    spot_sigma: float, poses: int, all_seen: bool, seed: int, out: Path,
) -> None:  # fmt: skip
    """Say how certain the tip of a probe is with a rig, and whether its LEDs can be confused.

    Prints the uncertainty of the tip as a number, the LEDs' nearest wrong order, growth by warmth
    and bending where the design is known, and what each source adds to one point. Writes maps over
    tilt and volume and the bending line as SVG.
    """
    from ocmm_core.calibration.probe_design import Postures, load_design, shipped_design
    from ocmm_core.camera import load_rig
    from ocmm_core.measuring import Examination, examine
    from ocmm_core.tracking import load_probe

    if min(tilt) < 0.0 or max(tilt) > 180.0:
        raise InputError(
            "design.tilt",
            f"The tilts {tilt} are not valid.",
            "Give three angles from 0 to 180 degrees.",
        )
    cameras, body = load_rig(rig), load_probe(probe)
    path = probe_design if probe_design is not None else shipped_design(body)
    built = None if path is None else load_design(path, body)
    asked = Examination(
        Postures(tilt, cameras.volume_world),
        sigma_px=spot_sigma,
        poses=poses,
        everything_seen=all_seen,
        seed=seed,
    )
    console = make_console()
    with console.status(tr("Computing")) as status:
        report = examine(cameras, body, built, asked, lambda what, _: status.update(Text(what)))
    written = write_figures(report, out)
    print_report(console, report)
    console.print(f"{tr_word('Written')}: {', '.join(str(item) for item in written)}")


@probe_app.command()
def pivot(*, files: list[Path], json: bool, layout: TableOptions) -> None:
    """Compute the tip of a tracked tool from poses that another program recorded about its tip.

    Columns: x, y, z, qx, qy, qz, qw (or tx, ty, tz, q0): the tool in the tracker. Rows without a
    pose are counted, wrong poses left out. Give three files or more, each with the tip in another
    place: only they tell U.
    """
    from ocmm_trackers import pivot_of_files, read_poses

    read = [read_poses(path, layout) for path in files]
    found = pivot_of_files(read)
    if json:
        typer.echo(found.to_json(read))
        return
    console = make_console()
    rows = []
    for one, pivoted in zip(read, found.pivots, strict=True):
        print_table_account(one.account)
        rows.append((
            one.account.path.name, str(len(pivoted.used)), str(one.unseen),
            str(int((~pivoted.used).sum())), f"{pivoted.rms:.3f}",
            *(f"{value:.3f}" for value in (*pivoted.tip, *pivoted.centre)),
        ))  # fmt: skip
    console.show("Lengths in mm; tip in the frame of the tool, place in that of the tracker.")
    print_grid(
        console,
        heads("File", "Poses", "Unseen", "Left out", "RMS", "Tip x", "y", "z", "Place x", "y", "z"),
        rows,
    )
    if found.expanded is None:
        console.show("No U: give three recordings or more, each with the tip in another place.")
        return
    print_grid(console, heads("Tip", "Value", "U (95 %)"), [
        (axis, f"{value:.3f}", f"{u:.3f}")
        for axis, value, u in zip("xyz", found.tip, found.expanded, strict=True)
    ])  # fmt: skip
    console.show(
        "U from the scatter of the recordings, without what they have in common, such as the scale "
        "of the tracker."
    )


def print_report(console: PlainConsole, report: ProbeReport) -> None:
    import numpy as np

    from ocmm_core.measuring import label_verdict, label_words, mechanics_words

    asked, number = report.examination, report.number
    low, high = asked.postures.volume_world
    console.show(f"Probe '{report.probe}' with {report.n_leds} LEDs, seen by rig '{report.rig}'.")
    console.show(
        f"Held at tilts up to ±{' / ±'.join(f'{t:g}' for t in asked.postures.tilt_deg)}° about "
        f"X / Y / Z, in {' x '.join(f'{size:.0f}' for size in high - low)} mm; spots of "
        f"{asked.sigma_px:g} px."
    )
    console.print()
    if not np.isfinite(number.space_um):
        console.show("No pose gives a tip: the cameras do not see enough LEDs.", style="bold red")
    else:
        x, y, z = number.axes_um
        console.print(
            Text.assemble(
                (tr(f"Uncertainty of the tip from spot noise: {number.space_um:.1f} µm"), "bold"),
                tr(f" (standard, in space; X {x:.1f}, Y {y:.1f}, Z {z:.1f})."),
            )
        )
        console.show(
            f"Below {number.p95_um:.1f} µm in 95 of 100 poses. {100.0 * number.share:.1f} % of "
            "all poses give a tip."
        )
    console.print()
    for item in report.labels:
        console.show(label_words(item))
    console.show(label_verdict(report.labels, coded=report.coded))
    console.print()
    if report.mechanics is None:
        console.show("Growth and bending: not known. Give a design document with --design.")
    else:
        for line in mechanics_words(report.mechanics):
            console.show(line)
    console.print()
    budget = [(tr(one.name), f"{one.sigma_um:.2f}", tr(one.rests_on)) for one in report.budget]
    columns = heads("Source", "µm", "Based on")
    print_grid(console, columns, budget, tr_word("Uncertainty of one point"))
    if report.budget:
        console.show(
            "Standard uncertainties in space, RMS over the poses. Camera and probe errors are "
            "common to many points: they cancel in short distances.",
            style="dim",
        )


def write_figures(report: ProbeReport, out: Path) -> list[Path]:
    """Write maps and bending line and return their names; StorageError if that fails."""
    from ocmm_cli.terminal import bending, tip_map
    from ocmm_core.measuring import map_range

    limits = map_range(report.maps)
    subtitle = (
        f"Probe '{report.probe}', rig '{report.rig}', spots of {report.examination.sigma_px:g} px; "
        f"standard, in space; mean {report.number.space_um:.1f} µm"
    )
    names = ("probe_tilt.svg", "probe_volume_top.svg", "probe_volume_front.svg")
    files = {
        name: tip_map(found, limits, subtitle)
        for name, found in zip(names, report.maps, strict=True)
    }
    if report.mechanics is not None:
        files["probe_bending.svg"] = bending(
            report.mechanics, f"Bending of the probe '{report.probe}'"
        )
    from ocmm_core.export import write_together

    write_together({out / name: text.encode("utf-8") for name, text in files.items()})
    return [out / name for name in files]

"""Ratios of time, beside those that were stored: what became slower, or grows faster.

    python -m benchmarks.ratios [--store] [--only WORDS]

Two kinds of figures, which mean the same on every computer:

- *times faster*: processor time of a peer over ours, both in this run;
- *exponent*: the power of a size with which our processor time grows.

Each is printed beside the one that is stored in `ratios.json`. WORSE is what lost a quarter, or
grows by 0.15 more; a busy computer moves the figures by half of that. It says so and ends with 0:
time never passes or fails anything. `--store` writes the figures of this run into the table, which
is for whoever made something faster, or knows why it became slower. Some two minutes.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from ocmm_core.blas import use_one_thread

use_one_thread()

from benchmarks import calibration, fits, jobs, probe, scaling, scaling_tracking, zones  # noqa: E402 - the number of BLAS threads is set before numpy is loaded
from benchmarks.recall_scenes import base_points  # noqa: E402 - as above
from ocmm_cli.study import BenchRow, measure_speed  # noqa: E402 - as above
from ocmm_core.camera import load_rig  # noqa: E402 - as above
from ocmm_core.documents import resource, write_atomic  # noqa: E402 - as above
from ocmm_core.features.shapes import Shape  # noqa: E402 - as above
from ocmm_core.inspection.finished import compare_files  # noqa: E402 - as above
from ocmm_core.tracking import load_probe  # noqa: E402 - as above

TABLE = Path(__file__).with_name("ratios.json")
LOST, GREW = 0.75, 0.15
"""Remaining share of a ratio, and growth of an exponent, at which it counts as worse."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A number without a unit.

    Attributes
    ----------
    name
        What of which size; the key in the table.
    is_exponent
        An exponent is better when it is smaller, a ratio to a peer when it is larger.
    compute
        Measures it.
    """

    name: str
    is_exponent: bool
    compute: Callable[[], float]

    def is_worse(self, now: float, before: float) -> bool:
        """Whether more was lost than a busy computer explains."""
        return now > before + GREW if self.is_exponent else now < LOST * before


def fit_beside_peers(shape: Shape) -> float:
    """Return the time of the fastest peer of the same problem over ours, 1,000 points."""
    return min(row.ratio for row in fits.rows(60, [shape]) if row.same)


def zone_beside_linprog(shape: Shape) -> float:
    """Return the time of one linear programme over that of a zone of 1,000 points."""
    return zones.cost(shape).ratio


@cache
def speeds() -> list[BenchRow]:
    """Return the figures of `ocmm bench`."""
    return measure_speed(0.3)


@cache
def pivot(poses: int) -> probe.Adjusting:
    """Return the times of the adjustment of a pivot sweep."""
    return probe.adjusting(poses, 3)


def growth(sizes: tuple[int, int], cost: Callable[[int], float]) -> float:
    """Return the exponent of a cost from one size to the other."""
    first, last = map(cost, sizes)
    return scaling.exponent(first, last, sizes[1] / sizes[0])


def over_points() -> float:
    """Return the exponent of an evaluation over the points of ten features."""
    return growth((600, 2400), lambda n: evaluation(n, 10))


def over_features() -> float:
    """Return the exponent of an evaluation over features of 20 points each."""
    return growth((25, 100), lambda n: evaluation(20 * n, n))


def over_characteristics() -> float:
    """Return the exponent of an evaluation over the distances of 25 features of 10 points."""
    first, *_, last = scaling.DISTANCES
    return growth((first, last), lambda n: evaluation(250, 25, n))


def evaluation(points: int, features: int, distances: int = 0) -> float:
    """Return the processor time of an evaluation from nothing, s."""
    bench = scaling.Bench(
        load_rig(resource("rigs", "recommended.toml")),
        load_probe(resource("probes", "standard.toml")),
    )
    return scaling.measure(points, features, scaling.poses_of(bench), bench, distances).seconds


def over_cameras() -> float:
    """Return the exponent of the tip over cameras."""
    return growth((2, 8), lambda n: tip(n, 8))


def over_leds() -> float:
    """Return the exponent of the tip over LEDs."""
    return growth((4, 64), lambda n: tip(2, n))


def tip(cameras: int, leds: int) -> float:
    """Return the processor time of the tip of a batch of frames, s."""
    rig, body = scaling_tracking.rig_of(cameras), scaling_tracking.body_of(leds)
    return scaling_tracking.seconds_of(scaling_tracking.tip_call(rig, body))


def over_poses() -> float:
    """Return the exponent of the adjustment of a pivot sweep over its poses."""
    return growth((1000, 10_000), lambda n: pivot(n).ours)


def over_jobs() -> float:
    """Return the exponent of comparing jobs over their number, in one process."""
    sizes = (4, 16)
    with tempfile.TemporaryDirectory(prefix="ocmm-ratios-") as name:
        folder = Path(name)
        base = base_points(folder, jobs.PLAN)
        paths = [folder / f"part-{k}.ocmm" for k in range(sizes[-1])]
        for k, path in enumerate(paths):
            jobs.write_job(path, base, len(base), k)

        def compared(size: int) -> float:
            begun = time.process_time()
            compare_files(paths[:size], probes=folder, calibrations=folder, processes=1)
            return time.process_time() - begun

        return growth(sizes, compared)


def camera_beside_opencv() -> float:
    """Return the time of OpenCV's camera calibration over ours, 100 points."""
    found = calibration.compare(10, 100, 1)
    return found.peer_seconds / found.seconds


FIGURES = (
    Figure("tip beside OpenCV, 8 LEDs x 2 cameras", False, lambda: speeds()[0].ratio),
    Figure("tip of one frame beside 8 kHz", False, lambda: speeds()[1].ratio),
    Figure("tracking beside real time at 8 kHz", False, lambda: speeds()[2].ratio),
    Figure("camera calibration beside OpenCV", False, camera_beside_opencv),
    Figure("pivot, 10,000 poses, beside numpy", False, lambda: pivot(10_000).ratio),
    *(
        Figure(f"{shape.value} of 1,000 points beside the fastest peer", False,
               partial(fit_beside_peers, shape))
        for shape in fits.SHAPES
    ),
    *(
        Figure(f"zone of 1,000 points beside one linprog, {shape.value}", False,
               partial(zone_beside_linprog, shape))
        for shape in (Shape.PLANE, Shape.CIRCLE, Shape.CYLINDER)
    ),
    Figure("evaluation over points, 10 features", True, over_points),
    Figure("evaluation over features of 20 points", True, over_features),
    Figure("evaluation over characteristics", True, over_characteristics),
    Figure("tip over cameras", True, over_cameras),
    Figure("tip over LEDs", True, over_leds),
    Figure("pivot over poses", True, over_poses),
    Figure("comparing over jobs", True, over_jobs),
)  # fmt: skip


def main() -> int:
    """Print the figures next to the stored ones; return 0."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--store", action="store_true", help="keep the figures of this run")
    parser.add_argument("--only", default="", help="figures with these words in their name")
    options = parser.parse_args()
    stored: dict[str, float] = json.loads(TABLE.read_text("utf-8")) if TABLE.exists() else {}
    worse = 0
    print(f"{'':56} {'stored':>8} {'now':>8}")
    for figure in FIGURES:
        if options.only not in figure.name:
            continue
        now = figure.compute()
        before = stored.get(figure.name)
        is_worse = before is not None and figure.is_worse(now, before)
        worse += is_worse
        kind = "exponent" if figure.is_exponent else "times faster"
        told = "" if before is None else f"{before:8.2f}"
        print(
            f"{figure.name:56} {told:>8} {now:8.2f} {kind}{'  WORSE' if is_worse else ''}",
            flush=True,
        )
        if options.store:
            stored[figure.name] = round(now, 3)
    print(f"{worse} worse" if worse else "nothing became worse")
    if options.store:
        text = json.dumps({figure.name: stored[figure.name] for figure in FIGURES}, indent=1)
        write_atomic(TABLE, f"{text}\n".encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())

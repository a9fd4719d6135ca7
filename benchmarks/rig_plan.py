"""Predictions and searches of the rig planner against simulation and brute force.

Run: ``python -m benchmarks.rig_plan [--rigs 50] [--scenes 20] [--draws 2000] [--seed 1]``.

For each rig (`tests.planner.rig_scenes`): predicted U of a tip and of a length against the
whole chain: cameras, probe, sensor pattern and spots drawn from their covariances, poses solved by
`tracking.solve`. For each scene: the search (`--evaluations` placements) against a grid (`--steps`)
of places of each of two cameras that may be in a plane, by the same cost. Then the processor time
of a map of 10,000 nodes. Ends with 1 if a prediction is off by more than 10 %, or a search is more
than 5 % worse than the grid.
"""

from __future__ import annotations

import argparse
import sys
import time
from itertools import product

from ocmm_core.blas import use_one_thread

use_one_thread()

import numpy as np  # noqa: E402 - the number of BLAS threads is set before numpy is loaded

import ocmm_planner as planning  # noqa: E402 - as above
from tests.planner import rig_scenes  # noqa: E402 - as above

MOST_OFF, MOST_WORSE = 0.10, 0.05


def predictions(seeds: range, draws: int) -> bool:
    """Print predicted over simulated U; return whether all are within `MOST_OFF`."""
    ratios = []
    for seed in seeds:
        found = rig_scenes.compare(rig_scenes.random_plan(seed), seed, draws)
        if found is None:
            print(f"seed {seed}: no pose was measurable")
            continue
        ratios.append((found.tip[0] / found.tip[1], found.length[0] / found.length[1]))
    values = np.array(ratios)
    print(f"{len(values)} of {len(seeds)} rigs, {draws} draws each; predicted over simulated U:")
    for name, column in zip(("tip", "length"), values.T, strict=True):
        print(f"  {name}: {column.min():.3f} to {column.max():.3f}, mean {column.mean():.3f}")
    return bool((np.abs(values - 1.0) <= MOST_OFF).all()) and len(values) == len(seeds)


def searches(seeds: range, evaluations: int, steps: int) -> bool:
    """Print worst U found and of the best place of a grid; return whether all are good enough."""
    holds = True
    for seed in seeds:
        plan = rig_scenes.search_scene(seed)
        nodes = plan.nodes(plan.document.search_nodes)
        began = time.process_time()
        found, tried = planning.search_places(
            plan, seed=seed, evaluations=evaluations, step=lambda _: None
        )
        taken = time.process_time() - began
        reached = planning.placement_cost(plan, found, nodes)
        grids = [
            [
                (x, one.place.min[1], z)
                for x in np.linspace(one.place.min[0], one.place.max[0], steps)
                for z in np.linspace(one.place.min[2], one.place.max[2], steps)
            ]
            for one in plan.document.cameras
            if one.place is not None
        ]
        targets = plan.places[:, 3:]
        best = min(
            planning.placement_cost(plan, np.hstack([pair, targets]), nodes)
            for pair in product(*grids)
        )
        good = reached <= (1.0 + MOST_WORSE) * best
        holds &= good
        print(
            f"scene {seed}: {1e3 * reached:.1f} um by {tried} placements in {taken:.1f} s, grid of "
            f"{steps**4}: {1e3 * best:.1f} um, ratio {reached / best:.3f} {'' if good else 'WORSE'}"
        )
    return holds


def main() -> int:
    """Print all; return 0 if predictions and searches hold."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rigs", type=int, default=50)
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--draws", type=int, default=2000)
    parser.add_argument("--evaluations", type=int, default=1000)
    parser.add_argument("--steps", type=int, default=5, help="places of a camera along an axis")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    first = options.seed
    holds = not options.rigs or predictions(range(first, first + options.rigs), options.draws)
    holds &= searches(range(first, first + options.scenes), options.evaluations, options.steps)
    plan = rig_scenes.given_plan()
    scene, nodes = planning.scene_of(plan, plan.places), plan.nodes((25, 16, 25))
    began = time.process_time()
    planning.predict_map(scene, nodes)
    taken = time.process_time() - began
    print(f"map of {len(nodes)} nodes, {len(plan.turns)} attitudes: {taken:.1f} s of processor")
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())

"""Operating characteristic of LENGTH-7x5: how often a rig of a true error passes.

A rig is wrong by a scale so that its largest true error over the limit is the given share; the
cameras, the hand and the nests scatter as those of the virtual rig do: rests are averaged spots of
drawn cameras, solved to poses, without the frames they are averaged from. One retest is used where
the procedure allows it.

    python -m benchmarks.acceptance --runs 1000
"""

from __future__ import annotations

import argparse

import numpy as np

from ocmm_core.acceptance import (
    AcceptanceVerdict,
    InstrumentState,
    Situation,
    Stage,
    find_procedure,
    load_procedure,
    plan_of,
    used_bar,
    values_of,
)
from ocmm_core.calibration.guided import sigma_of_mean
from ocmm_core.calibration.probe_design import Temperature
from ocmm_core.calibration.records import load_bar
from ocmm_core.camera import load_rig
from ocmm_core.composition import RECOMMENDED_RIG, STANDARD_PROBE
from ocmm_core.documents import resource
from ocmm_core.geometry import Float
from ocmm_core.tracking import load_probe, solve
from tests.core.calibration.verifying_at_once import FRAMES
from tests.core.calibration.virtual_rests import Holds, VirtualRests

ROOM = Temperature(20.0, 0.3, "")
SHARES = (0.0, 0.5, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.5)


def run(runs: int, shares: tuple[float, ...], *, seed: int, drawn: bool) -> dict[float, Float]:
    """Return pass, fail and unproven counts of every share.

    Parameters
    ----------
    drawn
        Every run has individual cameras, with the errors of their calibration added to the share;
        otherwise all runs are of one drawn rig.
    """
    rig, body = load_rig(RECOMMENDED_RIG), load_probe(STANDARD_PROBE)
    bar = used_bar(load_bar(resource("artefacts", "verification_bar.toml")))
    procedure = load_procedure(find_procedure("LENGTH-7x5"))[0]
    low, high = rig.volume_world.tolist()
    instrument = InstrumentState(
        rig=rig.name, calibration="", calibration_status="DESIGN", probe=body.name, tip="",
        tip_record="", ball_radius=body.tip_radius, ball_sigma=0.0,
        cameras=tuple(one.name for one in rig.cameras), volume_min=tuple(low),
        volume_max=tuple(high), software="benchmark", simulated=True,
    )  # fmt: skip
    stage = Stage(procedure, instrument, (bar,), 1)
    plan = plan_of(stage)[0]
    sigma, holds = sigma_of_mean(rig, FRAMES), Holds()
    rests = [
        VirtualRests(rig, body, seed + one, FRAMES, holds) for one in range(runs if drawn else 1)
    ]
    lengths = np.array(bar.sizes[1:]) - bar.sizes[0]
    worst = max(length / procedure.limits["E"].at(length) for length in lengths)
    found = {}
    for share in shares:
        counts = np.zeros(3)
        for one in range(runs):
            spots = rests[one % len(rests)]
            scale = 1.0 + share / worst

            def tips(number: int, spots: VirtualRests = spots, scale: float = scale) -> Float:
                points = np.array(plan[number].points_world)
                uv = []
                for point in points:
                    # A bar that is longer than its certificate is a rig that measures long.
                    where = points[0] + scale * (point - points[0])
                    uv.append(spots.spots(where, spots.hold(where)))
                solved: Float = solve(np.array(uv), rig, body, sigma).tip_world
                return solved

            taken = tuple(tips(number) for number in range(len(plan)))
            empty = tuple(np.zeros((0, 3)) for _ in plan)
            at = Situation(stage, plan, taken, empty, (ROOM,) * len(plan))
            values = values_of(at)
            bad = {
                value.key.split("/")[0]
                for value in values
                if value.verdict is not AcceptanceVerdict.PASS
            }
            if len(bad) == 1:
                number = int(bad.pop())
                again = Situation(
                    stage, plan,
                    tuple(tips(i) if i == number else taken[i] for i in range(len(plan))), empty,
                    (ROOM,) * len(plan),
                )  # fmt: skip
                values = values_of(again)
            verdicts = {value.verdict for value in values}
            counts[
                0
                if verdicts == {AcceptanceVerdict.PASS}
                else 1
                if AcceptanceVerdict.FAIL in verdicts
                else 2
            ] += 1
        found[share] = counts
    return found


def main() -> None:
    """Print both curves."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--runs", type=int, default=1000)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--drawn", action="store_true", help="Also errors of calibration.")
    arguments.add_argument("--shares", type=float, nargs="+", default=SHARES)
    given = arguments.parse_args()
    print("True error / MPE     N   pass %   fail %   not proven %")
    for share, counts in run(
        given.runs, tuple(given.shares), seed=given.seed, drawn=given.drawn
    ).items():
        n = int(counts.sum())
        passed, failed, open_ = 100.0 * counts / n
        print(f"{share:16.2f} {n:5} {passed:8.1f} {failed:8.1f} {open_:14.1f}")


if __name__ == "__main__":
    main()

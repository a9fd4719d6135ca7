"""Sessions with one wrong input: who is named, and whether a remedy leads round the guard.

Relocations of `lie_scenes`, one lie after the other. An answer is right if it names the culprit,
alone or as one of two that the observations cannot distinguish. Accepted lies are counted
separately if the stated uncertainty (k = 2) of lengths covers their effect: they are undetectable.
Then every option that an operator has is tried on the same session: unknown geometry, free lenses,
force, and all of them. Run: ``python -m benchmarks.lies --n 200``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

from ocmm_core.blas import use_one_thread

use_one_thread()

import numpy as np  # noqa: E402 - the number of BLAS threads is set before numpy is loaded

from benchmarks.lie_scenes import LIES, Scene, barely_nudged, honest  # noqa: E402 - as above
from ocmm_core.calibration.guided import length_sigma  # noqa: E402 - as above
from ocmm_core.calibration.relocation import Observations, RelocationOptions, relocate  # noqa: E402
from ocmm_core.camera import Rig  # noqa: E402 - as above
from ocmm_core.errors import CalibrationError  # noqa: E402 - as above
from tests.core.calibration.waved_probe import VOLUME, length_errors, rig  # noqa: E402 - as above

RIGHT_LIMIT, FOUND_LIMIT, FALSE_LIMIT = 0.95, 0.90, 0.01
WRONG_SIGMAS = 3.0
"""Length errors beyond this number of stated standard deviations are wrong numbers."""

LEADS_ROUND = ("unknown", "free lens", "force")
"""What no remedy may propose."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of one session.

    Attributes
    ----------
    lie, seed, did
        Index into `LIES` (-1: honest), seed, and description of the change.
    answer
        Code and text of the error; empty if the session was accepted.
    right
        Whether the culprit is named.
    alone
        Whether it is the only one named.
    leads_round
        Whether the remedy proposes an option that would silence the guard.
    accepted_by
        Options with which the same session was accepted.
    wrong_by
        Those of them with lengths outside their stated uncertainty.
    error_um, sigma_um
        Error and standard deviation of lengths, if the session itself was accepted.
    """

    lie: int
    seed: int
    did: str
    answer: str
    right: bool
    alone: bool
    leads_round: bool
    accepted_by: tuple[str, ...]
    wrong_by: tuple[str, ...]
    error_um: float
    sigma_um: float


def run(task: tuple[int, int, int]) -> Outcome:
    """Return the outcome of a lie (-1: none) with a seed and a number of poses."""
    lie, seed, poses = task
    scene = honest(seed, poses)
    expected = LIES[lie].tell(scene) if lie >= 0 else ()
    observed = scene.observed()
    answer, remedy, error, sigma = _try(scene, observed, scene.options, force=False)
    right = any(code in answer and word in answer for code, word in expected)
    accepted, wrong = [], []
    if lie >= 0:
        for name, options, force in _ways_round(scene.options):
            told, _, off, stated = _try(scene, observed, options, force=force)
            if not told:
                accepted.append(name)
                if off > WRONG_SIGMAS * stated:
                    wrong.append(name)
    return Outcome(
        lie=lie,
        seed=seed,
        did=scene.lie,
        answer=answer,
        right=right,
        alone=right and "cannot tell" not in answer,
        leads_round=any(word in remedy for word in LEADS_ROUND),
        accepted_by=tuple(accepted),
        wrong_by=tuple(wrong),
        error_um=error,
        sigma_um=sigma,
    )


def _ways_round(options: RelocationOptions) -> Iterator[tuple[str, RelocationOptions, bool]]:
    yield "unknown geometry", replace(options, geometry="unknown"), False
    yield "free lenses", replace(options, lens="free"), False
    yield "force", options, True
    yield "all of them", replace(options, geometry="unknown", lens="free"), True


def _try(
    scene: Scene, observed: Observations, options: RelocationOptions, *, force: bool
) -> tuple[str, str, float, float]:
    """Return the refusal, its remedy, and RMS error and sigma of lengths, um, if accepted."""
    try:
        found = relocate(scene.start, scene.body, observed, options, force)
    except CalibrationError as error:
        return f"{error.code}: {error.what}", error.remedy, np.nan, np.nan
    after = found.applied_to(scene.start, "benchmark")
    last = replace(rig(), cameras=scene.moves(1.0))
    return "", "", *_lengths(last, after)


def _lengths(true: Rig, after: Rig) -> tuple[float, float]:
    errors = length_errors(true, after)
    return 1e3 * float(np.sqrt(np.mean(errors**2))), 1e3 * length_sigma(after, VOLUME)


def _contained(one: Outcome) -> bool:
    """Return whether the effect of an accepted lie is within the uncertainty."""
    return not one.answer and one.error_um <= 2.0 * one.sigma_um


def _row(name: str, outcomes: Sequence[Outcome]) -> None:
    n = len(outcomes)
    found = sum(bool(one.answer) for one in outcomes)
    right, alone = sum(one.right for one in outcomes), sum(one.alone for one in outcomes)
    ways = sum(len(one.accepted_by) for one in outcomes)
    wrong = sum(len(one.wrong_by) for one in outcomes)
    held = sum(_contained(one) for one in outcomes)
    print(f"{name:40} {n:5} {found:6} {right:6} {alone:6} {held:7} {ways:9} {wrong:6}", flush=True)


def main() -> int:
    """Print everything; return 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=200, help="sessions with a lie (200)")
    parser.add_argument("--honest", type=int, default=200, help="honest sessions (200)")
    parser.add_argument("--nudges", type=int, default=100, help="nudges of 30 urad (100)")
    parser.add_argument("--poses", type=int, default=500, help="of the waved probe (500)")
    parser.add_argument("--seed", type=int, default=1, help="first seed (1)")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--all", action="store_true", help="print every session")
    options = parser.parse_args()
    nudge = next(i for i, one in enumerate(LIES) if one.tell is barely_nudged)
    count = len(LIES)
    tasks = [(i % count, options.seed + i, options.poses) for i in range(options.n)]
    tasks += [
        (nudge, options.seed + 100_000 + i, options.poses)
        for i in range(max(options.nudges - options.n // count, 0))
    ]
    tasks += [(-1, options.seed + 200_000 + i, options.poses) for i in range(options.honest)]
    outcomes = []
    with ProcessPoolExecutor(options.processes) as pool:
        for one in pool.map(run, tasks, chunksize=1):
            outcomes.append(one)
            if options.all or (one.lie >= 0 and (not one.right or one.accepted_by)):
                print(f"    seed {one.seed} {one.did}: {one.answer or 'accepted'}"[:400], end="")
                print(f" | by {', '.join(one.accepted_by)}" if one.accepted_by else "")
            elif one.lie < 0 and one.answer:
                print(f"    seed {one.seed} honest: {one.answer}"[:400], flush=True)
    print(f"{'lie':40} {'N':>5}  found  right  alone  within U  tried  wrong")
    for index, lie in enumerate(LIES):
        _row(lie.name, [one for one in outcomes if one.lie == index])
    lies = [one for one in outcomes if one.lie >= 0]
    first = lies[: options.n]
    _row(f"all of the first {options.n}", first)
    barely = [one for one in lies if one.lie == nudge]
    clean = [one for one in outcomes if one.lie < 0]
    refused = sum(bool(one.answer) for one in clean)
    right = sum(one.right or _contained(one) for one in first) / max(len(first), 1)
    found = sum(bool(one.answer) for one in barely) / max(len(barely), 1)
    false = refused / max(len(clean), 1)
    through = sum(len(one.wrong_by) for one in lies)
    round_ = sum(one.leads_round for one in lies)
    print(f"right culprit, or within U, {right:.1%} of {len(first)} (>= {RIGHT_LIMIT:.0%})")
    print(f"nudge of 30 urad found {found:.1%} of {len(barely)} (>= {FOUND_LIMIT:.0%})")
    print(f"honest sessions refused {refused} of {len(clean)} (<= {FALSE_LIMIT:.0%})")
    print(f"remedies that lead round their guard {round_} of {len(lies)} (0)")
    print(f"wrong lengths accepted by another way while the lie stood {through} of {len(lies)} (0)")
    holds = right >= RIGHT_LIMIT and found >= FOUND_LIMIT and false <= FALSE_LIMIT
    holds = holds and not through and not round_
    print("ok" if holds else "BROKEN")
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())

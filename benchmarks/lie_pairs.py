"""Relocations with two lies at once: who is named, and whether lengths beyond U are accepted.

Sessions of `lie_scenes` with two of bar, LED, nudged camera and drifting camera, in turns (two LEDs
as well), evaluated as they are and with unknown geometry. Right is an answer that names both.

U (k = 2) leaves some 5 % of honest sessions outside. A session beyond U is therefore repeated with
the same noise and true documents, without movements: if this honest twin is also beyond its U, the
noise is the cause and not the lies. Run:
``python -m benchmarks.lie_pairs --n 300``.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace

from ocmm_core.blas import use_one_thread

use_one_thread()

import numpy as np  # noqa: E402 - the number of BLAS threads is set before numpy is loaded
from scipy.stats import binom  # noqa: E402 - as above

from benchmarks.lie_scenes import Scene, bent_led, drifting, honest, honest_twin, nudged, wrong_bar  # noqa: E402 - as above
from ocmm_core.calibration.guided import length_sigma  # noqa: E402 - as above
from ocmm_core.calibration.relocation import RelocationOptions, relocate  # noqa: E402 - as above
from ocmm_core.errors import CalibrationError  # noqa: E402 - as above
from tests.core.calibration.waved_probe import VOLUME, length_errors, rig  # noqa: E402 - as above

PAIRS = (
    (wrong_bar, bent_led), (bent_led, bent_led), (nudged, bent_led), (wrong_bar, nudged),
    (drifting, bent_led), (wrong_bar, drifting),
)  # fmt: skip
RIGHT_LIMIT = 0.80
OUTSIDE = 0.05
"""Share of honest sessions outside U (k = 2)."""


@dataclass(frozen=True, slots=True)
class PairOutcome:
    """Outcome of one session."""

    did: str
    answers: tuple[str, ...]
    """As it is, and with unknown geometry; empty if accepted."""
    right: bool
    accepted: tuple[float, ...]
    """Error over U (k = 2) of lengths of each evaluation that was accepted."""
    beyond: tuple[str, ...]
    """Evaluations that accepted lengths beyond U because of the lies, with error and U, um."""
    by_noise: tuple[str, ...]
    """The same if the honest twin is also beyond its U."""


def run(task: tuple[int, int]) -> PairOutcome:
    """Return the outcome of a seed with the given number of poses."""
    seed, poses = task
    scene = honest(seed, poses)
    did, wanted = [], []
    for tell in PAIRS[seed % len(PAIRS)]:
        wanted.append([word for _, word in tell(scene)])
        did.append(scene.lie)
    noise = scene.rng.bit_generator.state
    observed = scene.observed()
    answers: list[str] = []
    accepted: list[float] = []
    beyond: list[str] = []
    by_noise: list[str] = []
    for name, options in (
        ("as it is", scene.options),
        ("unknown geometry", replace(scene.options, geometry="unknown")),
    ):
        answer, error, u = _relocated(scene, observed, options)
        answers.append(answer)
        if answer:
            continue
        accepted.append(error / u)
        if error > u:
            twin = honest_twin(scene, noise)
            _, its_error, its_u = _relocated(twin, twin.observed(), options)
            text = f"{name}: {error:.1f} um, U {u:.1f} um (twin {its_error:.1f}, {its_u:.1f})"
            (by_noise if its_error > its_u else beyond).append(text)
    whole = answers[0].casefold()
    right = all(any(word.casefold() in whole for word in words) for words in wanted)
    return PairOutcome(
        ", ".join(did), tuple(answers), right, tuple(accepted), tuple(beyond), tuple(by_noise)
    )


def _relocated(
    scene: Scene, observed: object, options: RelocationOptions
) -> tuple[str, float, float]:
    """Return the refusal, and RMS error and U of lengths, um, if accepted."""
    try:
        found = relocate(scene.start, scene.body, observed, options)  # type: ignore[arg-type]
    except CalibrationError as error:
        return f"{error.code}: {error.what}", np.nan, np.nan
    after = found.applied_to(scene.start, "benchmark")
    errors = length_errors(replace(rig(), cameras=scene.moves(1.0)), after)
    return "", 1e3 * float(np.sqrt(np.mean(errors**2))), 2e3 * length_sigma(after, VOLUME)


def main() -> int:
    """Print everything; return 1 if a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=300, help="sessions (300)")
    parser.add_argument("--poses", type=int, default=300, help="of the waved probe (300)")
    parser.add_argument("--seed", type=int, default=1, help="first seed (1)")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.n)
    with ProcessPoolExecutor(options.processes) as pool:
        found = list(pool.map(run, [(seed, options.poses) for seed in seeds]))
    for seed, one in zip(seeds, found, strict=True):
        if not one.right or one.beyond or one.by_noise:
            answer = f"    seed {seed} {one.did}: {one.answers[0] or 'accepted'}"[:400]
            print(answer, *one.beyond, *(f"NOISE {text}" for text in one.by_noise))
    for index, pair in enumerate(PAIRS):
        mine = [one for seed, one in zip(seeds, found, strict=True) if seed % len(PAIRS) == index]
        names = " and ".join(tell.__name__ for tell in pair)
        right, beyond = sum(one.right for one in mine), sum(bool(one.beyond) for one in mine)
        print(f"{names:28} N {len(mine):4} named {right:4} beyond U {beyond:3}")
    share = sum(one.right for one in found) / max(len(found), 1)
    beyond = sum(bool(one.beyond) for one in found)
    print(f"right pair {share:.1%} (>= {RIGHT_LIMIT:.0%}); accepted beyond U by lies {beyond} (0)")
    ratios = np.array([ratio for one in found for ratio in one.accepted])
    outside, count = np.count_nonzero(ratios > 1.0), len(ratios)
    least = float(binom.ppf(0.999, max(count, 1), OUTSIDE))
    rms = 2.0 * float(np.sqrt(np.mean(ratios**2))) if count else 0.0
    print(f"outside U {outside} of {count} accepted (<= {least:.0f}); RMS {rms:.2f} sigma")
    holds = share >= RIGHT_LIMIT and not beyond and outside <= least
    print("ok" if holds else "BROKEN")
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())

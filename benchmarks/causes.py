"""Which cause is named where one thing is wrong with a job, and how long that takes.

    python -m benchmarks.causes [SEEDS] [--first SEED]

Seeds 20, 21, ... (those of the tests are 0 to 19) take turns with the ten causes of
`benchmarks.cause_scenes`. Right is a result whose cause is named, and the feature where it sits;
the result that is farthest out is asked about, and beside that all of them are counted. No good job
may get an error of measuring. Ends with 1 if fewer than 90 % are right.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter

import numpy as np

from benchmarks.cause_scenes import SPOILED, asked, is_right, make_job
from ocmm_core.blas import use_one_thread
from ocmm_core.inspection.causes import Cause, explanations_of

FIRST_SEED = 20
LEAST_RIGHT = 0.9
_NO_ERROR = (Cause.PART, Cause.UNCERTAINTY, Cause.NOISE)
"""Causes allowed in a good job: by chance it is near a limit, and U extends over it."""


def main() -> int:
    """Print who was taken for what; return 1 where too many were wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", nargs="?", type=int, default=200)
    parser.add_argument("--first", type=int, default=FIRST_SEED)
    options = parser.parse_args()
    count, first_seed = options.seeds, options.first
    use_one_thread()
    words = list(SPOILED)
    named: dict[str, Counter[str]] = {word: Counter() for word in words}
    right: Counter[str] = Counter()
    all_right: Counter[str] = Counter()
    results: Counter[str] = Counter()
    times: list[float] = []
    for seed in range(first_seed, first_seed + count):
        word = words[seed % len(words)]
        job, view, scene = make_job(seed, SPOILED[word][0])
        begun = time.process_time()
        found = explanations_of(job, view)
        times.append(1e3 * (time.process_time() - begun) / max(len(found), 1))
        first = asked(view, found)
        named[word][first.cause.value if first else "-"] += 1
        good = is_right(word, first, scene)
        right[word] += good
        results[word] += len(found)
        all_right[word] += sum(is_right(word, item, scene) for item in found)
        if not good:
            said = first.suggestion if first else "nothing"
            sys.stdout.write(f"  seed {seed} {word} {scene.wrong}: {said}\n")
    sys.stdout.write(f"\n{'cause':12} {'right':>9}  {'of all results':>14}  named\n")
    for word in words:
        tried = sum(named[word].values())
        said = ", ".join(f"{what} {n}" for what, n in named[word].most_common())
        whole = f"{all_right[word]}/{results[word]}"
        sys.stdout.write(f"{word:12} {right[word]:4}/{tried:<4}  {whole:>14}  {said}\n")
    clean = sum(_blames_measuring(seed) for seed in range(first_seed, first_seed + count // 4))
    share = sum(right.values()) / count
    sys.stdout.write(
        f"{sum(right.values())} of {count} right ({100.0 * share:.1f} %); {clean} of {count // 4} "
        f"good jobs with a cause of measuring; {np.median(times):.0f} ms a result (median), "
        f"{np.percentile(times, 95):.0f} ms (95 %)\n"
    )
    return int(share < LEAST_RIGHT or clean > 0)


def _blames_measuring(seed: int) -> bool:
    """Return whether an error of measuring is named in a good job, near a limit by chance."""
    job, view, _ = make_job(seed, None)
    return any(item.cause not in _NO_ERROR for item in explanations_of(job, view))


if __name__ == "__main__":
    sys.exit(main())

"""Hostile jobs, plans, rigs, probes, recordings, points, tables and models, given to commands.

    python -m benchmarks.hostile [--only WORDS] [--damaged N] [--leaves N] [--seed S] [--list]

The lane ``hostile`` of ``ocmm selftest reliability``, group by group with what each cost, and with
what each file said. Every kind of file is made from a good one by a rule or by a seeded change, and
is given to the command that reads such files. Commands run as the user runs them, each in a process
of its own that begins where everything is loaded, so that what is measured is what the file costs.
A traceback is exit code 3 or one on the screen; a hang is 5 s of a processor more than twice what
the good file takes (a job that is measured takes more on a busy computer), or two minutes of the
clock; memory is what the process held at most, libraries with it. Files that may be used are told
apart from those that must be refused. Ends with 1 where there is a traceback, a hang, more than
512 MB, an answer that is no sentence, or another exit code than 2 for a file that must be refused.
Models need the extra ``step``.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections import Counter
from pathlib import Path

from ocmm_bench.campaign import REFUSED, given, good_files, hostile_groups, usual_of


def main() -> int:
    """Give all kinds to their commands; return 0 if none had a forbidden outcome."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="")
    parser.add_argument("--damaged", type=int, default=600)
    parser.add_argument("--leaves", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="ocmm-hostile-") as name:
        folder = Path(name)
        # Nothing of this computer's records and settings.
        os.environ["HOME"] = os.environ["XDG_DATA_HOME"] = os.environ["XDG_STATE_HOME"] = name
        good = good_files(folder)
        total, bad = 0, 0
        for group in hostile_groups(good, options.damaged, options.leaves, options.seed):
            if options.only not in group.word:
                continue
            counts: Counter[str] = Counter()
            slowest, largest = 0.0, 0.0
            usual = usual_of(group, folder)
            for index, kind in enumerate(group.kinds):
                answer = given(group, kind, folder, index)
                fault = answer.fault(kind, usual)
                counts[fault or ("refused" if answer.code == REFUSED else "used")] += 1
                slowest, largest = max(slowest, answer.cpu_s), max(largest, answer.memory_mb)
                if fault or options.list:
                    words = " ".join(answer.words.split())[:300]
                    sys.stdout.write(
                        f"  {fault or 'ok':11s} {kind.name}: exit {answer.code}, "
                        f"{answer.cpu_s:.1f} s, {answer.memory_mb:.0f} MB: {words}\n"
                    )
            faults = sum(n for word, n in counts.items() if word not in ("refused", "used"))
            total, bad = total + len(group.kinds), bad + faults
            sys.stdout.write(
                f"{group.word:12s} {len(group.kinds):4d} kinds: {counts['refused']} refused, "
                f"{counts['used']} used; {counts['traceback']} tracebacks, {counts['hang']} hangs, "
                f"{counts['memory']} over memory, {counts['accepted']} wrongly used, "
                f"{counts['no sentence']} without a sentence; "
                f"slowest {slowest:.1f} s, most {largest:.0f} MB\n"
            )
            sys.stdout.flush()
    sys.stdout.write(f"{total} kinds, {bad} faults\n")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

"""Hostile files given to the real commands: one trial per kind of file."""

from __future__ import annotations

import os
import random
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ocmm_bench.campaign._hostile_forge import Forgery
from ocmm_bench.campaign._hostile_groups import Group, given, good_files, hostile_groups, usual_of
from ocmm_bench.campaign._hostile_runs import REFUSED, CommandResult
from ocmm_bench.campaign._stores import other_station
from ocmm_bench.campaign._trials import Trial

DAMAGED, LEAVES = 600, 40
"""Jobs with random damage, and documents of each kind with one value replaced."""
_FINDINGS = {
    "traceback": "tracebacks", "hang": "hangs above 5 s", "memory": "above 512 MB",
    "accepted": "wrongly used", "no sentence": "without a sentence",
}  # fmt: skip


def hostile(seed: int, runs: int, done: frozenset[int]) -> Iterator[Trial]:
    """Yield the reaction to each kind of file, in random order; refusals count as acknowledged."""
    with tempfile.TemporaryDirectory(prefix="ocmm-hostile-") as name, quiet():
        folder = Path(name)
        with other_station(folder):
            groups = hostile_groups(good_files(folder), DAMAGED, LEAVES, seed)
            usual: dict[str, float] = {}
            for number, (group, kind) in enumerate(_drawn(groups, seed)[:runs]):
                if number in done:
                    continue
                if group.word not in usual:
                    usual[group.word] = usual_of(group, folder)
                answer = given(group, kind, folder, number)
                yield _trial(seed, number, kind, answer, answer.fault(kind, usual[group.word]))


def _drawn(groups: list[Group], seed: int) -> list[tuple[Group, Forgery]]:
    """Return all kinds, shuffled, so that a short run samples each group."""
    every = [(group, kind) for group in groups for kind in group.kinds]
    random.Random(seed).shuffle(every)  # noqa: S311 - an order, no secret
    return every


def _trial(seed: int, number: int, kind: Forgery, answer: CommandResult, fault: str) -> Trial:
    refused = int(answer.code == REFUSED and not fault)
    if not fault:
        return Trial("hostile", seed, number, refused, {})
    note = (
        f"{kind.name}: exit {answer.code}, {answer.cpu_s:.1f} s, {answer.memory_mb:.0f} MB: "
        f"{' '.join(answer.words.split())[:300]}"
    )
    return Trial("hostile", seed, number, refused, {_FINDINGS[fault]: 1}, note)


@contextmanager
def quiet() -> Iterator[None]:
    """Discard the output of the commands that make the good files."""
    sys.stdout.flush()
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)

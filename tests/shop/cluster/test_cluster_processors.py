"""Workers whose processor is of another kind: their last digits differ, so they are refused."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from dataclasses import replace

import pytest

from benchmarks.cluster_processes import ROOT, ShopCluster
from ocmm_core.cluster import run_tasks
from ocmm_core.errors import InputError
from ocmm_shop.cluster import _worker
from ocmm_shop.cluster._worker import Arithmetic, Refused, TaskRequest, do, this_computer
from tests.host import HANG_S, not_run
from tests.processor import GENERIC, emulation, why_not
from tests.shop.cluster.cluster_work import drawn, some_seeds


def test_a_worker_of_another_kind_is_refused_until_it_computes_as_this_computer_does(
    own_cluster: ShopCluster,
) -> None:
    """Two kinds: this processor, and the oldest one of x86-64, pretended."""
    if reason := why_not(GENERIC):
        not_run(reason)
    oldest = emulation(GENERIC)
    # There the older one works, which cannot do as this one does: this computer has to follow.
    worker = own_cluster.start_worker(environment=oldest)
    own_cluster.wait_for(1)
    with pytest.raises(InputError, match=r"computes otherwise \(loops for generic") as refused:
        list(run_tasks(drawn, some_seeds(), repr, site=own_cluster.site))
    assert refused.value.code == "cluster.processor"
    assert "Run this again with " in refused.value.remedy
    told = told_environment(refused.value.remedy)
    as_told = subprocess.run(
        [sys.executable, "-c", ASK, *addressed(own_cluster)], check=True, timeout=HANG_S,
        capture_output=True, text=True, env=os.environ | told, cwd=ROOT,
    ).stdout  # fmt: skip
    # By that alone both are of one kind, and the digits those of the worker's.
    there = subprocess.run(
        [sys.executable, "-c", ALONE], check=True, timeout=HANG_S, capture_output=True, text=True,
        env=os.environ | oldest, cwd=ROOT,
    ).stdout  # fmt: skip
    assert as_told == there
    # The other way round it is the worker that can follow.
    own_cluster.kill(worker)
    own_cluster.start_worker()
    own_cluster.wait_for(1)
    asked = subprocess.run(
        [sys.executable, "-c", ASK, *addressed(own_cluster)], check=False, timeout=HANG_S,
        capture_output=True, text=True, env=os.environ | oldest, cwd=ROOT,
    )  # fmt: skip
    assert "Start that worker with " in asked.stderr
    own_cluster.kill(own_cluster.workers[0])
    own_cluster.start_worker(environment=told_environment(asked.stderr))
    own_cluster.wait_for(1)
    follows = subprocess.run(
        [sys.executable, "-c", ASK, *addressed(own_cluster)], check=True, timeout=HANG_S,
        capture_output=True, text=True, env=os.environ | oldest, cwd=ROOT,
    )  # fmt: skip
    assert follows.stdout == there


def test_a_worker_of_another_kind_that_comes_later_is_refused_by_its_answer() -> None:
    ours = this_computer()
    others = replace(ours.arithmetic, loops="other")
    answer = do(
        replace(ours, arithmetic=others), drawn, [TaskRequest(some_seeds()[0], "Drawing", ())]
    )
    assert isinstance(answer, Refused)
    error = _worker.refusal("A worker", answer.computer, replace(ours, arithmetic=others))
    assert error.code == "cluster.processor"


def test_who_lacks_instructions_cannot_compute_as_one_that_has_them() -> None:
    old = Arithmetic("generic", (), ("Nehalem", "Nehalem"))
    middle = Arithmetic("haswell", ("X86_V3",), ("Haswell", "Haswell"))
    new = Arithmetic("haswell", ("X86_V3", "X86_V4"), ("SkylakeX", "SkylakeX"))
    assert old.environment_of(middle) is middle.environment_of(new) is None
    assert new.environment_of(middle) == {
        "NPY_DISABLE_CPU_FEATURES": "X86_V4", "OPENBLAS_CORETYPE": "Haswell",
    }  # fmt: skip
    assert new.environment_of(old) == {
        "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4", "OPENBLAS_CORETYPE": "Nehalem",
        "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "",
    }  # fmt: skip
    # A BLAS without a query function gives no hint of its settings.
    assert new.environment_of(replace(old, blas=())) is None
    error = _worker.other_processor("W", str(old), str(new), None, None)
    assert error.remedy.startswith("Stop that worker, or leave out")


def told_environment(text: str) -> dict[str, str]:
    """Return the environment of a remedy, parsed as by a shell."""
    _, _, told = " ".join(text.split()).partition(
        "worker with " if "Start" in text else "again with "
    )
    words = shlex.split(told.partition(", or leave")[0])
    return dict(word.split("=", 1) for word in words)


def addressed(cluster: ShopCluster) -> list[str]:
    site = cluster.site
    return [site.scheduler, str(site.ca), str(site.cert), str(site.key)]


ASK = """
import sys
from pathlib import Path
from ocmm_core.cluster import Site, run_tasks
from ocmm_core.errors import OcmmError
from tests.shop.cluster.cluster_work import drawn, some_seeds
scheduler, *files = sys.argv[1:]
try:
    site = Site(scheduler, None, *map(Path, files))
    found = list(run_tasks(drawn, some_seeds(), repr, site=site))
except OcmmError as error:
    sys.exit(f"{error.what} {error.remedy}")
print(found)
"""
ALONE = """
from tests.shop.cluster.cluster_work import drawn, some_seeds
print([drawn(seed) for seed in some_seeds()])
"""

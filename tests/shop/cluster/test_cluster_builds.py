"""Workers of another build are refused, and nothing of Dask listens beyond its documented ports."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from benchmarks.cluster_processes import ROOT, ShopCluster
from benchmarks.house_tree import ROOTS
from ocmm_core.cluster import Site, run_tasks
from ocmm_core.errors import InputError
from ocmm_shop.cluster._worker import build, versions
from tests.host import HANG_S, not_run
from tests.shop.cluster.cluster_work import drawn, listening, some_seeds


def test_a_worker_with_other_code_of_the_same_version_is_refused(
    own_cluster: ShopCluster, tmp_path: Path
) -> None:
    other = tmp_path / "other"
    for name in ROOTS:
        shutil.copytree(ROOT / name, other / name, ignore=shutil.ignore_patterns("__py*"))
    budget = other / "ocmm_core" / "measuring" / "__init__.py"
    budget.write_text(budget.read_text("utf-8") + "\nHALVED = 0.5\n", "utf-8")
    own_cluster.start_worker(
        # Without PYTHONSAFEPATH the folder in which the tests run would come first.
        environment={"PYTHONPATH": f"{other}{os.pathsep}{ROOT}", "PYTHONSAFEPATH": "1"}
    )
    own_cluster.wait_for(1)
    with pytest.raises(InputError, match=r"Worker tls://\S+ has OCMM .* \(build ") as caught:
        list(run_tasks(drawn, some_seeds(), str, site=own_cluster.site))
    assert caught.value.code == "cluster.version"
    assert f"this computer has {versions()}" in caught.value.what
    assert caught.value.what.count(build()[:12]) == 1


def test_only_the_documented_ports_listen(own_cluster: ShopCluster) -> None:
    own_cluster.start_worker("--worker-port", "0")
    own_cluster.wait_for(1)
    assert own_cluster.scheduler is not None
    worker = own_cluster.workers[0]
    with own_cluster.client() as client:
        (address,) = client.scheduler_info(n_workers=-1)["workers"]
    assert ports_of(own_cluster.scheduler.pid) == {own_cluster.port}
    assert ports_of(worker.pid) == {int(address.rpartition(":")[2])}


def test_processes_of_this_computer_open_no_http_server() -> None:
    site = Site(workers=2, dask=True)
    found = list(run_tasks(listening, range(2), str, site=site))
    # Scheduler in this process; of each worker its own port and that of its nanny.
    assert all(isinstance(one, list) and len(one) == 1 for one in found), found


def ports_of(pid: int) -> set[int]:
    """Return the TCP ports on which a process listens, as ``ss -ltnp`` shows them."""
    program = shutil.which("ss")
    if program is None:
        not_run("'ss' is not installed (Debian: apt-get install iproute2)")
    shown = subprocess.run(
        [program, "-H", "-ltnp"], capture_output=True, text=True, timeout=HANG_S, check=True
    ).stdout
    lines = [line for line in shown.splitlines() if re.search(rf"pid={pid}\b", line)]
    return {int(line.split()[3].rpartition(":")[2]) for line in lines}

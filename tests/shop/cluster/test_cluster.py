"""The same tasks here, in processes and on the workers of a scheduler."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import threading
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from distributed import Client, Future

from benchmarks.cluster_processes import ShopCluster
from ocmm_core.cluster import Site, run_tasks
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_shop.cluster._open_tasks import TaskContents, end_client
from ocmm_shop.cluster._over_dask import _CONFIG
from ocmm_shop.cluster._worker import do
from tests.host import HANG_S, long_form, needs_package
from tests.shop.cluster.cluster_work import (
    UNSENDABLE,
    drawn,
    growing,
    noted,
    some,
    unsendable,
    wrong,
)

SEEDS = np.random.SeedSequence(22).spawn(40)


def of_seed(seed: np.random.SeedSequence) -> str:
    return "Drawing"


def numbered(thing: int) -> str:
    return f"Task {thing}"


def test_the_same_digits_on_one_two_and_four_workers(own_cluster: ShopCluster) -> None:
    here = list(run_tasks(drawn, SEEDS, of_seed))
    assert all(isinstance(one, list) for one in here)
    for workers in (1, 2, 4):
        while len(own_cluster.workers) < workers:
            own_cluster.start_worker()
        own_cluster.wait_for(workers)
        done: list[int] = []
        found = list(run_tasks(drawn, SEEDS, of_seed, site=own_cluster.site, on_done=done.append))
        assert found == here
        assert done == list(range(41))
    assert list(run_tasks(drawn, SEEDS, of_seed, site=Site(workers=2))) == here


def test_a_killed_worker_changes_nothing(cluster: ShopCluster, tmp_path: Path) -> None:
    expendable = [cluster.start_worker() for _ in range(2)]
    cluster.wait_for(4)
    tasks = run_tasks(
        partial(noted, str(tmp_path)), range(30), numbered, site=cluster.site, contents=some
    )
    assert next(tasks) == (0, 3)
    for worker in expendable:
        cluster.kill(worker)
    assert list(tasks) == [(thing, 3 * (thing % 3 + 1)) for thing in range(1, 30)]
    assert len({path.name.partition("-")[2] for path in tmp_path.iterdir()}) > 1


def test_a_restarted_scheduler_gets_the_open_tasks_anew(
    own_cluster: ShopCluster, tmp_path: Path
) -> None:
    notes = tmp_path / "notes"
    notes.mkdir()
    own_cluster.start_worker()
    tasks = run_tasks(
        partial(noted, str(notes)), range(20), numbered, site=own_cluster.site, contents=some
    )
    assert next(tasks) == (0, 3)
    assert own_cluster.scheduler is not None
    for process in (own_cluster.scheduler, *own_cluster.workers):
        own_cluster.kill(process)
    own_cluster.start_scheduler()
    own_cluster.start_worker()
    assert list(tasks) == [(thing, 3 * (thing % 3 + 1)) for thing in range(1, 20)]


def test_what_is_wrong_is_an_answer_and_who_leaves_gives_up_the_rest(
    cluster: ShopCluster, tmp_path: Path
) -> None:
    found = list(run_tasks(wrong, ["good", "bad", "fine"], str, site=cluster.site))
    assert found[0] == "good"
    assert isinstance(found[1], OcmmError)
    assert found[1].what == "Thing bad is bad."
    assert found[2] == "fine"
    tasks = run_tasks(
        partial(noted, str(tmp_path)), range(1000), numbered, site=cluster.site, contents=some
    )
    next(tasks)
    tasks.close()  # type: ignore[attr-defined]  # it is a generator
    # Tasks that were running end, and no other one starts: all of them would take 100 s.
    begun, seen = len(list(tmp_path.iterdir())), -1
    while begun != seen:
        time.sleep(1.0)
        begun, seen = len(list(tmp_path.iterdir())), begun
    assert seen < 300


def test_bytes_that_arrive_altered_are_refused(
    cluster: ShopCluster, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    submit = Client.submit

    def elsewhere(self: object, work: object, *given: object, **named: object) -> object:
        if work is do:
            given = (*given[:-1], b"another job")
        return submit(self, work, *given, **named)

    monkeypatch.setattr(Client, "submit", elsewhere)
    work = partial(noted, str(tmp_path))
    (answer,) = run_tasks(work, [7], numbered, site=cluster.site, contents=some)
    assert isinstance(answer, StorageError)
    assert answer.code == "cluster.content"
    assert not list(tmp_path.iterdir())


def test_a_worker_of_another_version_is_refused(cluster: ShopCluster, tmp_path: Path) -> None:
    older = tmp_path / "older.py"
    older.write_text("import ocmm_core\nocmm_core.__version__ = '0.0.1'\n", encoding="utf-8")
    worker = cluster.start_worker("--preload", str(older))
    until = time.monotonic() + HANG_S
    refused: InputError | None = None
    while refused is None and time.monotonic() < until:
        try:
            list(run_tasks(drawn, SEEDS[:4], of_seed, site=cluster.site))
        except InputError as error:
            refused = error
    cluster.kill(worker)
    assert refused is not None
    assert refused.code == "cluster.version"
    assert "has OCMM 0.0.1 (build" in refused.what


def test_without_certificates_nobody_gets_in(cluster: ShopCluster, tmp_path: Path) -> None:
    with pytest.raises(StorageError, match="cannot be reached"):
        list(run_tasks(drawn, SEEDS, of_seed, site=Site(f"tcp://127.0.0.1:{cluster.port}")))
    with pytest.raises(InputError, match="needs the CA"):
        list(run_tasks(drawn, SEEDS, of_seed, site=Site(cluster.address)))
    missing = replace(cluster.site, key=tmp_path / "none.pem")
    with pytest.raises(InputError, match="cannot be read"):
        list(run_tasks(drawn, SEEDS, of_seed, site=missing))


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("tcp://10.1.2.3:8786", "anybody in that network can run programs"),
        ("tcp://shop.example:8786", "anybody in that network can run programs"),
        ("http://127.0.0.1:8786", "is none of"),
        ("tcp://127.0.0.1", "is none of"),
        ("tcp://127.0.0.1:x", "cannot be read"),
        ("tcp://a@127.0.0.1:8786", "more than a host"),
        ("8786", "is none of"),
    ],
)
def test_addresses_that_are_refused(address: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Site(address).check()


def test_a_network_without_tls_has_to_be_told() -> None:
    needs_package("distributed", "extra `shop`")
    Site("tcp://10.1.2.3:8786", unencrypted=True).check()
    Site("tcp://localhost:8786").check()
    Site("tcp://[::1]:8786").check()


def test_without_dask_a_sentence_says_what_to_install(tmp_path: Path) -> None:
    script = (
        "import sys\n"
        "class Without:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name.partition('.')[0] in ('dask', 'distributed'):\n"
        "            raise ModuleNotFoundError(name)\n"
        "import importlib.util as u\n"
        "spec = u.find_spec\n"
        "u.find_spec = lambda n, p=None: None if n in ('dask', 'distributed') else spec(n, p)\n"
        "sys.meta_path.insert(0, Without())\n"
        "from ocmm_core.cluster import Site, run_tasks\n"
        "print(list(run_tasks(abs, [-1, 2], str, site=Site(workers=1, dask=True))))\n"
        "try:\n"
        "    Site('tcp://127.0.0.1:8786').check()\n"
        "except Exception as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=HANG_S, check=True
    )
    assert done.stdout.splitlines()[0] == "[1, 2]"
    assert "./run setup --shop" in done.stdout


def test_processes_of_dask_on_this_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    needs_package("distributed", "extra `shop`")
    if not long_form():
        # Each death costs the start of a worker; Dask's own default is three.
        monkeypatch.setitem(_CONFIG, "distributed.scheduler.allowed-failures", 1)
    before = set(threading.enumerate())
    here = list(run_tasks(drawn, SEEDS, of_seed))
    assert list(run_tasks(drawn, SEEDS, of_seed, site=Site(workers=2, dask=True))) == here
    found = list(run_tasks(wrong, ["a", "die", "b"], str, site=Site(workers=2, dask=True)))
    assert [found[0], found[2]] == ["a", "b"]
    assert isinstance(found[1], OcmmError)
    assert found[1].code == "cluster.died"
    assert threading.active_count() <= len(before) + 3


@pytest.fixture
def bundles(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int, int]]:
    """Return, for each task, the numbers of joined items and bytes, and of open tasks."""
    found: list[tuple[int, int, int]] = []
    futures: list[Future] = []
    submit = Client.submit

    def counted(self: object, work: object, *given: object, **named: object) -> object:
        if work is do:
            asked = given[2]
            assert isinstance(asked, list)
            size = sum(len(one) for one in given[3:] if isinstance(one, bytes))
            found.append((len(asked), size, sum(not one.done() for one in futures)))
        future: Future = submit(self, work, *given, **named)
        futures.append(future)
        return future

    monkeypatch.setattr(Client, "submit", counted)
    return found


def test_short_tasks_go_together_and_one_that_kills_is_found_among_them(
    bundles: list[tuple[int, int, int]],
) -> None:
    needs_package("distributed", "extra `shop`")
    things = [f"thing {number}" for number in range(200)]
    things[120] = "die"
    found = list(run_tasks(wrong, things, str, site=Site(workers=2, dask=True)))
    assert [one for one in found if isinstance(one, str)] == things[:120] + things[121:]
    assert isinstance(found[120], OcmmError)
    assert found[120].code == "cluster.died"
    sizes = [things for things, _, _ in bundles]
    assert max(sizes) > 1
    # All of them once; items joined with the killing one, or queued with it, once more alone.
    assert 200 < sum(sizes) <= 200 + 6 * 8


def test_an_answer_that_cannot_be_sent_spoils_no_other_and_many_bytes_go_by_themselves(
    bundles: list[tuple[int, int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    needs_package("distributed", "extra `shop`")
    monkeypatch.setattr("ocmm_shop.cluster._open_tasks._BUNDLE_BYTES", 4000)
    told: list[int] = []
    found = list(run_tasks(
        unsendable, range(200), numbered, site=Site(workers=2, dask=True), contents=growing,
        on_done=told.append,
    ))  # fmt: skip
    error = found.pop(UNSENDABLE)
    assert isinstance(error, OcmmError)
    assert "Task 120" in error.what
    assert found == [
        (thing, 10 if thing < 60 else 3000) for thing in range(200) if thing != UNSENDABLE
    ]
    assert told == list(range(201))
    assert max(things for things, _, _ in bundles) > 2
    # The one that went beyond is the last.
    assert max(size for _, size, _ in bundles) <= 4000 + 3000
    assert max(others for _, _, others in bundles) > 1
    bundles.clear()
    monkeypatch.setattr("ocmm_shop.cluster._open_tasks._OPEN_BYTES", 2000)
    site = Site(workers=2, dask=True)
    found = list(run_tasks(unsendable, range(60, 66), numbered, site=site, contents=growing))
    assert found == [(thing, 3000) for thing in range(60, 66)]
    assert [others for _, _, others in bundles] == [0] * 6


def test_who_only_waited_at_a_worker_that_ended_is_none_that_ends_it(
    own_cluster: ShopCluster,
) -> None:
    own_cluster.start_worker("--nanny")
    own_cluster.wait_for(1)
    found = list(run_tasks(wrong, ["die", "a", "b"], str, site=own_cluster.site))
    assert found[1:] == ["a", "b"]
    assert isinstance(found[0], OcmmError)
    assert found[0].code == "cluster.died"


def test_a_client_that_no_longer_hears_its_scheduler_ends_all_the_same(
    cluster: ShopCluster,
) -> None:
    client = cluster.client()

    async def hears_nothing() -> None:
        async def fails() -> None:
            raise ValueError

        client._handle_report_task.cancel()  # noqa: SLF001 - as a socket does it
        client._handle_report_task = asyncio.ensure_future(fails())  # noqa: SLF001 - as above

    client.sync(hears_nothing)
    end_client(client, 5.0)
    # A closed client stays silent when it is collected.
    assert client.status == "closed"


def test_bytes_that_no_worker_could_keep_go_with_the_next_task(cluster: ShopCluster) -> None:
    content, contents = b"job" * 1000, TaskContents()
    with cluster.client() as client:
        (sha256,), _ = contents.hand(client, [content])
        contents.hand(client, [content])
        contents.forget_failed([sha256])
        assert sha256 in contents.kept
        contents.kept[sha256] = client.submit(int, "no number")
        assert contents.kept[sha256].exception(timeout=HANG_S) is not None
        contents.forget_failed([sha256])
        assert contents.hand(client, [content]) == ((sha256,), [content])
        contents.give_back([sha256] * 3)
        assert not contents.users
        contents.clear()

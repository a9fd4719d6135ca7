from __future__ import annotations

import gc
import importlib.util
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.cluster_processes import ShopCluster, make_certificates
from tests.host import needs_package


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let Dask leave sockets to the collector in its own tests: they are no leak of ours."""
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.filterwarnings("ignore::ResourceWarning"))


@pytest.fixture(autouse=True)
def collected() -> Iterator[None]:
    """Let go of the sockets that Dask leaves to the collector, before another test is blamed."""
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        gc.collect()


@pytest.fixture(scope="module")
def shared_cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ShopCluster | None]:
    """Give a scheduler with TLS and two workers, once a module."""
    if importlib.util.find_spec("distributed") is None:
        yield None
        return
    folder = tmp_path_factory.mktemp("cluster")
    cluster = ShopCluster(folder, make_certificates(folder / "certificates"))
    try:
        cluster.start_scheduler()
        for _ in range(2):
            cluster.start_worker()
        yield cluster
    finally:
        cluster.close()


@pytest.fixture
def own_cluster(tmp_path: Path) -> Iterator[ShopCluster]:
    """Give a scheduler with TLS that a test may kill; it has no workers."""
    needs_package("distributed", "extra `shop`")
    folder = tmp_path / "own"
    folder.mkdir()
    own = ShopCluster(folder, make_certificates(folder / "certificates"))
    try:
        own.start_scheduler()
        yield own
    finally:
        own.close()


@pytest.fixture
def cluster(shared_cluster: ShopCluster | None) -> ShopCluster:
    """Return it; NOT RUN where Dask is missing."""
    needs_package("distributed", "extra `shop`")
    assert shared_cluster is not None
    return shared_cluster

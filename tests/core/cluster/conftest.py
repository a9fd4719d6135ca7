from __future__ import annotations

import importlib.util
from collections.abc import Iterator

import pytest

from benchmarks.cluster_processes import ShopCluster, make_certificates
from tests.host import needs_package


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
def cluster(shared_cluster: ShopCluster | None) -> ShopCluster:
    """Return it; NOT RUN where Dask is missing."""
    needs_package("distributed", "extra `shop`")
    assert shared_cluster is not None
    return shared_cluster

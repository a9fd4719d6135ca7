"""Fixtures of the servers."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.core.inspection.conftest import bench, quick_touches  # noqa: F401 - fixtures
from tests.host import needs_package
from tests.serve.opcua_bench import Access, certificate


@pytest.fixture
def access(tmp_path: Path) -> Access:
    """Return certificates of an OPC UA server and of a client that it trusts."""
    needs_package("asyncua", "extra `opcua`")
    own = certificate(tmp_path, "server", "urn:ocmm:here")
    folder = tmp_path / "trusted"
    folder.mkdir()
    return Access(own, certificate(tmp_path, "client", trusted=folder), folder)

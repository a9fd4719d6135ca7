"""Every query of the Grafana dashboard runs, as the role that Grafana has."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import Any

from ocmm_core.documents import resource
from ocmm_shop.archive.stores import open_archive
from tests.shop.archive.conftest import Place
from tests.shop.archive.made_jobs import made_delivery

_DASHBOARD = resource("grafana", "archive.json")


def queries() -> list[str]:
    board: dict[str, Any] = json.loads(_DASHBOARD.read_text("utf-8"))
    found = [target["rawSql"] for panel in board["panels"] for target in panel["targets"]]
    return found + [
        one["query"] for one in board["templating"]["list"] if one["query"].startswith("SELECT")
    ]


def as_grafana_sends_it(query: str) -> str:
    """Fill in what Grafana fills in before the query leaves it."""
    query = re.sub(
        r"\$__timeFilter\(([^()]*)\)",
        r"\1 BETWEEN '2026-01-01T00:00:00Z' AND '2027-01-01T00:00:00Z'",
        query,
    )
    query = query.replace("${part:sqlstring}", "'FLANGE'")
    return query.replace("${characteristic:sqlstring}", "'D1'")


def test_every_query_runs_and_finds_something(new_database: Callable[[], Place]) -> None:
    shop = new_database()
    assert shop.server is not None
    with open_archive(shop.address) as archive:
        archive.put_all([made_delivery(seed) for seed in range(12)])
        archive.put(made_delivery(20, fault="Altered after it was archived: step 3."))
    assert len(queries()) >= 9
    with open_archive(shop.server.address(shop.database, "looker"), read_only=True) as archive:
        for query in queries():
            text = as_grafana_sends_it(query)
            assert "$" not in text, text
            assert archive.query(text).rows, text

"""Results by OPC UA: whole, as in the report, and never better than proven; two makers' clients."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.core.inspection.conftest import Bench
from tests.host import HANG_S
from tests.serve.ippdme_server import ServedProcess, jobs_in
from tests.serve.opcua_bench import (
    RESULTS,
    Access,
    Pair,
    below,
    children,
    node_client,
    opcua_client,
    served_opcua,
)
from tests.serve.published_jobs import STATES, measure, measure_all, published, report_file
from tests.waiting import wait_until

# Five jobs, a server and two clients, each in its process.
pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


@pytest.fixture
def server(bench: Bench, tmp_path: Path, access: Access) -> Iterator[ServedProcess]:
    """Return a server with a job of each state."""
    measure_all(bench, tmp_path / "jobs")
    with served_opcua(tmp_path / "jobs", *access.options) as running:
        yield running


async def _values(server: ServedProcess, client: Pair) -> dict[str, Any]:
    """Return the values of all results, by name, after one of each state exists."""
    found: dict[str, Any] = {}
    async with opcua_client(server, client) as connected:
        for _ in range(int(HANG_S)):
            nodes = await children(connected, *RESULTS)
            if set(STATES) <= set(nodes):
                break
            await asyncio.sleep(1.0)
        for name, node in nodes.items():
            found[name] = await node.read_value()
            parts = await children(connected, *RESULTS, name)
            meta = await parts["ResultMetaData"].read_value()
            # Clients that cannot decode the whole read its parts.
            assert meta == found[name].ResultMetaData
            assert await parts["ResultContent"].read_value() == found[name].ResultContent
    return found


def _of_asyncua(value: Any) -> dict[str, Any]:
    meta, (content,) = value.ResultMetaData, value.ResultContent
    return {
        "id": meta.ResultId, "evaluation": int(meta.ResultEvaluation), "partial": meta.IsPartial,
        "simulated": meta.IsSimulated, "part": meta.PartId, "job": meta.JobId,
        "words": meta.ResultEvaluationDetails.Text,
        "report": json.loads(getattr(content, "Value", content)),
    }  # fmt: skip


def _of_node(value: Any) -> dict[str, Any]:
    meta, (content,) = value["resultMetaData"], value["resultContent"]
    return {
        "id": meta["resultId"], "evaluation": meta["resultEvaluation"],
        "partial": meta["isPartial"], "simulated": meta["isSimulated"], "part": meta["partId"],
        "job": meta["jobId"], "words": meta["resultEvaluationDetails"]["text"],
        "report": json.loads(content["value"]),
    }  # fmt: skip


def _check_whole(read: dict[str, Any], path: Path) -> None:
    """Compare a result with its report: every number to the last digit, nothing better."""
    name, whole = path.stem, json.loads(json.dumps(published(path)))
    assert read["report"] == whole
    assert (read["id"], read["job"], read["part"]) == (whole["job"]["uuid"], name, name)
    assert read["evaluation"] == STATES[name]
    assert read["simulated"] is (name == "simulated")
    assert read["partial"] is (name == "open")
    assert ("SIMULATED" in read["words"]) is (name == "simulated")
    assert read["words"].startswith(whole["part_verdict"]["word"])


def _check_characteristics(tree: dict[str, Any], last: Any) -> None:
    """Compare the characteristics of the last result with its report."""
    assert set(tree) == {one.name for one in last.results}
    for one in last.results:
        shown = tree[one.name]["below"]
        for field in ("nominal", "lower", "upper", "measured", "uncertainty", "verdict"):
            value, found = getattr(one, field), shown[field.title()]
            assert (found["status"] == "Good") is (value is not None)
            assert found["value"] == value
        assert (shown["Evaluation"]["value"] == 1) is (one.verdict == "CONFORM")


async def _becomes(server: ServedProcess, client: Pair, name: str, partial: bool | None) -> bool:
    """Return whether a result becomes partial or whole; None: whether it goes."""
    found: bool | None = None
    async with opcua_client(server, client) as connected:
        for _ in range(int(HANG_S)):
            there = name in await children(connected, *RESULTS)
            parts = await children(connected, *RESULTS, name) if there else {}
            meta = parts.get("ResultMetaData")
            found = None if meta is None else (await meta.read_value()).IsPartial
            if found is partial:
                return True
            await asyncio.sleep(1.0)
    return False


def test_clients_of_two_makers_read_results_as_in_the_report_and_see_them_change(
    server: ServedProcess, access: Access, bench: Bench, tmp_path: Path
) -> None:
    jobs = jobs_in(tmp_path / "jobs")
    values = asyncio.run(_values(server, access.client))
    tree = node_client(server, *access.client)
    shown = below(tree, *RESULTS)
    assert len(jobs) == len(STATES) == 5
    assert set(values) == set(shown) == set(STATES)
    for path in jobs:
        _check_whole(_of_asyncua(values[path.stem]), path)
        _check_whole(_of_node(shown[path.stem]["value"]), path)
    last = max(map(report_file, jobs), key=lambda one: one.job.created_utc)
    _check_characteristics(below(tree, "LatestResult", "Characteristics"), last)
    damaged, changed = tmp_path / "jobs" / "good.ocmm", tmp_path / "jobs" / "open.ocmm"
    damaged.write_bytes(damaged.read_bytes()[:5000])
    changed.unlink()
    measure(bench, tmp_path / "jobs", "open")
    assert asyncio.run(_becomes(server, access.client, "open", False))
    wait_until(lambda: "good.ocmm" in server.text)
    assert asyncio.run(_becomes(server, access.client, "good", None))
    changed.unlink()
    assert asyncio.run(_becomes(server, access.client, "open", None))

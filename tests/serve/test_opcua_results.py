"""Results by OPC UA: whole, as in the report, and never better than proven; two makers' clients."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from ocmm_serve.published import CalibrationFacts, CorrectionFacts, PublishedFacts
from tests.core.inspection.conftest import Bench
from tests.host import HANG_S, needs_package
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
from tests.serve.published_jobs import (
    STATES,
    measure,
    measure_all,
    published,
    record_equipment,
    report_file,
    state_offsets,
)
from tests.waiting import wait_until

FIELDS = {
    "nominal": "Nominal", "lower": "LowerToleranceLimit", "upper": "UpperToleranceLimit",
    "measured": "ResultValue", "uncertainty": "Uncertainty", "verdict": "Verdict",
}  # fmt: skip

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
        for field, name in FIELDS.items():
            value, found = getattr(one, field), shown[name]
            assert (found["status"] == "Good") is (value is not None)
            assert found["value"] == value
        for name in ("Nominal", "ResultValue", "LowerToleranceLimit", "UpperToleranceLimit"):
            unit = shown[name]["below"]["EngineeringUnits"]["value"]
            assert unit["displayName"]["text"] == {"mm": "mm", "deg": "°"}[one.unit]
            assert unit["unitId"] == {"mm": 5066068, "deg": 17476}[one.unit]
        assert shown["LowerToleranceLimit"]["below"]["ToleranceForm"]["value"] == 1
        assert (shown["ResultEvaluation"]["value"] == 1) is (one.verdict == "CONFORM")


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


async def _types(server: ServedProcess, client: Pair) -> dict[str, str]:
    """Return the name of the type of each node of the specification for measuring systems."""
    found: dict[str, str] = {}

    async def look(node: Any, path: str) -> None:
        for one in await node.get_children():
            below = f"{path}/{(await one.read_browse_name()).Name}"
            kind = await one.read_type_definition()
            if kind is not None and kind.NamespaceIndex == space:
                type_name = await connected.get_node(kind).read_browse_name()
                found[below] = type_name.Name
            await look(one, below)

    async with opcua_client(server, client) as connected:
        own = await connected.get_namespace_index("urn:ocmm:station")
        space = await connected.get_namespace_index("http://opcfoundation.org/UA/GMS/")
        machine = connected.get_node(f"ns={own};s=Machine")
        kind = connected.get_node(await machine.read_type_definition())
        found[""] = (await kind.read_browse_name()).Name
        await look(machine, "")
    return found


def test_it_is_a_measuring_system_with_tools_prognoses_and_corrections(
    bench: Bench, tmp_path: Path, access: Access
) -> None:
    jobs, records = tmp_path / "jobs", tmp_path / "records"
    made = datetime.now(UTC) - timedelta(days=1)
    due = made + timedelta(days=300)
    record_equipment(records, made, due.isoformat())
    document, registers = state_offsets(tmp_path)
    path = measure(bench, jobs, "good")
    sources = "--probes", records, "--calibrations", records, "--corrections", document
    with served_opcua(jobs, *access.options, *sources, "--records", registers) as server:

        def tree() -> dict[str, Any]:
            return node_client(server, *access.client)

        wait_until(lambda: bool(below(tree(), "Equipment", "Tools")))
        wait_until(lambda: bool(below(tree(), "ResultManagement", "CorrectionsFolder")))
        seen, types = tree(), asyncio.run(_types(server, access.client))
    features = {f"/LatestResult/Characteristics/{one.name}" for one in report_file(path).results}
    assert types == {
        "": "GMSType", "/Identification": "GMSIdentificationType",
        "/Equipment": "GMSEquipmentType", "/Monitoring": "GMSMonitoringType",
        "/ResultManagement": "GMSResultManagementType",
        "/ResultManagement/Results/good": "GMSResultType",
        "/MachineryBuildingBlocks/ResultManagement/Results/good": "GMSResultType",
        "/Equipment/Tools/standard/A": "SensorType",
        "/Notification/Prognoses/cameras recommended": "CalibrationPrognosisType",
        "/Notification/Prognoses/tip standard/A": "CalibrationPrognosisType",
        "/ResultManagement/CorrectionsFolder/H3": "CorrectionType",
        **dict.fromkeys(features, "CharacteristicType"),
    }  # fmt: skip
    tool = below(seen, "Equipment", "Tools", "standard/A")
    assert (tool["IsQualifiedStatus"]["value"], tool["Locked"]["value"]) == (0, False)
    assert tool["Class"]["value"] == 4
    for key in ("cameras recommended", "tip standard/A"):
        one = below(seen, "Notification", "Prognoses")[key]
        assert one["below"]["Calibrated"]["value"] is True
        for name, moment in (("DateOfCalibration", made), ("PredictedTime", due)):
            read = datetime.fromisoformat(one["below"][name]["value"])
            # The clients' own resolution is a millisecond.
            assert abs(read - moment) < timedelta(milliseconds=2)
    change = below(seen, "ResultManagement", "CorrectionsFolder", "H3")
    assert change["CorrectionValueAbsolute"]["value"] == 0.031
    assert change["CorrectionValueRelative"]["value"] == 0.031 - 0.02
    assert (
        change["CorrectionValueRelative"]["below"]["EngineeringUnits"]["value"]["unitId"] == 5066068
    )
    assert below(seen, "Monitoring", "MachineTool")["OperationMode"]["value"] == 0
    program = below(seen, "Production", "ActiveProgram", "State")
    assert program["CurrentState"]["status"] == "BadNoData"  # no live stream


def test_what_is_practised_or_expired_looks_neither_corrected_nor_qualified() -> None:
    needs_package("asyncua", "extra `opcua`")
    from ocmm_serve.opcua._trees import TypedObject, trees_of

    change = CorrectionFacts(
        machine="VMC 3", offset="H3", unit="mm", what="corrected", before=0.0, after=0.1,
        expanded=0.01, characteristics=("A",), job="J", by="me", made_utc="", practice=True,
    )  # fmt: skip
    for status, usable, shown in (
        ("VALID", True, 0), ("DUE", True, 1), ("EXPIRED", False, 2), ("NONE", False, 2),
    ):  # fmt: skip
        tip = CalibrationFacts(of="tip", name="A", status=status, usable=usable)
        trees = trees_of(PublishedFacts(calibrations=(tip,), corrections=(change,)))
        assert trees["Changes"] == {}
        tool = trees["Tools"]["A"]
        assert isinstance(tool, TypedObject)
        assert tool.members["gms:IsQualifiedStatus"].value == shown  # type: ignore[union-attr]
        assert tool.members["tool:Locked"].value is not usable  # type: ignore[union-attr]

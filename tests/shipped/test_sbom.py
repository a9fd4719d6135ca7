"""The bill of materials is valid, whole, the same every time, and made without a network."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from installer import sbom
from installer.licences import licences
from installer.locks import ROOT, RUNTIME, STEP, read_lock
from ocmm_core import __version__
from ocmm_core.errors import InputError
from tests.host import HANG_S

_WHEN = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)


@pytest.fixture(scope="module")
def bill() -> dict[str, Any]:
    """Return the bill of materials."""
    found: dict[str, Any] = json.loads(sbom.bill_of_materials())
    return found


@pytest.mark.parametrize("date", [None, _WHEN])
def test_is_a_cyclonedx_document(date: datetime | None) -> None:
    # Loading takes seconds, and each process of the tests collects this file.
    from cyclonedx.schema import SchemaVersion
    from cyclonedx.validation.json import JsonStrictValidator

    text = sbom.bill_of_materials(date).decode("utf-8")
    validator = JsonStrictValidator(SchemaVersion.V1_6)
    assert validator.validate_str(text) is None
    # The validator can say no.
    assert validator.validate_str(text.replace('"CycloneDX"', '"Cyclone"')) is not None


def test_its_components_are_what_is_locked(bill: dict[str, Any]) -> None:
    runtime, extra = read_lock(RUNTIME), read_lock(STEP)
    pins = runtime | extra
    components = {one["name"]: one for one in bill["components"]}
    assert components.keys() == pins.keys()
    for name, pin in pins.items():
        one = components[name]
        assert one["version"] == pin.version
        assert one["purl"] == f"pkg:pypi/{name}@{pin.version}"
        assert {h["content"] for h in one["hashes"]} == set(pin.hashes)
        assert {h["alg"] for h in one["hashes"]} == {"SHA-256"}
        assert one["licenses"] == [{"expression": licences().packages[name].licence}]
        inside = {part["name"] for part in one.get("components", ())}
        assert inside == {part.name for part in licences().parts_of(name)}
    scopes = {name: one["scope"] for name, one in components.items()}
    assert {
        n for n, scope in scopes.items() if scope == "optional"
    } == extra.keys() - runtime.keys()
    assert {n for n, scope in scopes.items() if scope == "excluded"} == {"setuptools"}
    assert bill["metadata"]["component"]["version"] == __version__


def test_it_says_who_depends_on_whom(bill: dict[str, Any]) -> None:
    edges = {one["ref"]: set(one.get("dependsOn", ())) for one in bill["dependencies"]}

    def ref(name: str) -> str:
        return str(next(one["bom-ref"] for one in bill["components"] if one["name"] == name))

    assert ref("numpy") in edges[f"ocmm@{__version__}"]
    assert edges[ref("numba")] == {ref("numpy"), ref("llvmlite")}
    # Everything is reached from OCMM.
    reached, open_ = set(), {f"ocmm@{__version__}"}
    while open_:
        reached |= open_
        open_ = {to for one in open_ for to in edges[one]} - reached
    assert reached == set(edges)


def test_the_same_lock_files_give_the_same_document(tmp_path: Path) -> None:
    """By another process, with another hash seed, without a network or a home folder."""
    outs = []
    for seed in ("1", "2"):
        target = tmp_path / f"{seed}.json"
        subprocess.run(
            [sys.executable, "-m", "installer.sbom", str(target)],
            cwd=ROOT, check=True, timeout=HANG_S,
            env={**os.environ, "PYTHONHASHSEED": seed, "SOURCE_DATE_EPOCH": "1767323045",
                 "PYTHONPATH": str(ROOT), "HOME": str(tmp_path / "nowhere")},
        )  # fmt: skip
        outs.append(target.read_bytes())
    assert outs[0] == outs[1] == sbom.bill_of_materials(_WHEN)


def test_another_content_has_another_serial_number(bill: dict[str, Any]) -> None:
    dated = json.loads(sbom.bill_of_materials(_WHEN))
    assert dated["metadata"]["timestamp"] == "2026-01-02T03:04:05+00:00"
    assert "timestamp" not in bill["metadata"]
    assert dated["serialNumber"] != bill["serialNumber"]


def test_nothing_is_asked_of_a_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_network(*_: object) -> None:
        raise AssertionError("a connection was wanted")

    monkeypatch.setattr("socket.socket.connect", no_network)
    monkeypatch.setattr("socket.getaddrinfo", no_network)
    assert sbom.bill_of_materials()


def test_an_environment_that_is_not_the_locked_one_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    text = RUNTIME.read_text(encoding="utf-8").replace("rich==", "rich==0.")
    (tmp_path / "other.lock").write_text(text, encoding="utf-8")
    monkeypatch.setattr(sbom, "RUNTIME", tmp_path / "other.lock")
    # The other set holds the runtime set in the same versions; here it does not.
    monkeypatch.setattr(sbom, "STEP", tmp_path / "other.lock")
    with pytest.raises(InputError, match="rich: version"):
        sbom.main([str(tmp_path / "bill.json")])
    assert not (tmp_path / "bill.json").exists()


def test_a_date_that_is_none_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(InputError, match="SOURCE_DATE_EPOCH"):
        sbom.main([])

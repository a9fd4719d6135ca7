"""Every source of frames provides all fields for commands, calibrations and documentation."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from pathlib import Path

import pytest

from ocmm_core.acquisition.bus_process import ChildProcess
from ocmm_core.acquisition.recording import FrameRecorder
from ocmm_core.camera import load_rig
from ocmm_core.composition import (
    DEFAULT_SOURCE,
    DEMO_PLAN,
    RECOMMENDED_RIG,
    STANDARD_PROBE,
    Feed,
    Origin,
    SourceSpec,
    StationRequest,
    make_feed,
    names_in_words,
    origin_of,
    source_help,
    source_of,
    sources,
)
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import load_plan
from ocmm_sim.calibration_scenes import FreeMotionScene
from ocmm_sim.sources import VirtualSite

_RIG = load_rig(RECOMMENDED_RIG)
_PLAN = load_plan(DEMO_PLAN)
_VALUES = {Origin.CAMERAS: "lo", Origin.RECORDING: "frames.rec", Origin.VIRTUAL: "1"}
"""Values after a prefix: an interface of every computer, a recording, a number."""


def named(spec: SourceSpec) -> str:
    """Return a name of the source."""
    if spec.rig and spec.takes_value:
        return f"{spec.prefix}localhost:18944"
    if spec.prefix == "genicam:":
        return spec.prefix + ",".join(str(camera.serial) for camera in _RIG.cameras)
    return spec.prefix + _VALUES[spec.origin] if spec.takes_value else spec.prefix


def made(spec: SourceSpec, folder: Path) -> Feed:
    """Return the source ready to start; a recording is made first."""
    source = named(spec)
    if spec.origin is Origin.RECORDING:
        simulated = make_feed(request(DEFAULT_SOURCE), _PLAN, _RIG)
        FrameRecorder(folder / "frames.rec", simulated.description, _RIG).close()
        simulated.ring.close()
        source = f"{spec.prefix}{folder / 'frames.rec'}"
    if not spec.rig:
        return make_feed(request(source), _PLAN, _RIG)
    rig = resource("rigs", spec.rig)
    return make_feed(replace(request(source), rig=rig), _PLAN, load_rig(rig))


def request(source: str) -> StationRequest:
    return StationRequest(plan=DEMO_PLAN, out=Path(), source=source)


@pytest.mark.parametrize("spec", sources(), ids=lambda spec: spec.prefix)
def test_an_entry_lacks_nothing(spec: SourceSpec) -> None:
    assert spec.prefix
    assert spec.prefix.endswith(":") is spec.takes_value
    assert spec.forms
    for form, words in spec.forms:
        assert form.startswith(spec.prefix)
        assert (form != spec.prefix) is spec.takes_value
        assert words.strip()
        assert not words.endswith(".")
        assert f"'{form}': {words}" in source_help()
    assert bool(spec.recorded_as) is (spec.origin is not Origin.RECORDING)
    assert (spec.segment is None) or spec.on_bus
    assert (spec.scenes is None) or spec.origin is Origin.VIRTUAL
    assert (spec.hand is None) is (spec.practice is None)
    # Trackers have scenes of their calibration, and no hand for acceptance tests.
    assert (spec.hand is None) is (spec.scenes is None or bool(spec.rig))
    assert {field.name for field in dataclasses.fields(SourceSpec)} == {
        "prefix", "forms", "takes_value", "origin", "live", "on_bus", "recorded_as", "make",
        "segment", "scenes", "hand", "practice", "rig",
    }, "a new field of an entry needs a check here"  # fmt: skip
    assert source_of(named(spec)).spec is spec
    assert spec.prefix + source_of(named(spec)).value == named(spec)
    assert origin_of(named(spec)) is spec.origin


@pytest.mark.parametrize("spec", sources(), ids=lambda spec: spec.prefix)
def test_what_is_made_is_what_the_entry_says(spec: SourceSpec, tmp_path: Path) -> None:
    feed = made(spec, tmp_path)
    try:
        assert feed.live is spec.live
        in_process = spec.on_bus or bool(spec.rig) or spec.prefix.startswith("genicam:")
        assert isinstance(feed.acquisition, ChildProcess) is in_process
        assert (feed.virtual is not None) is (spec.origin is Origin.VIRTUAL)
        assert bool(feed.recorded) is (spec.origin is Origin.RECORDING)
        assert feed.description.name.startswith(spec.recorded_as)
        if spec.origin is Origin.VIRTUAL:
            assert feed.description.simulated
    finally:
        feed.end()


@pytest.mark.parametrize(
    "spec", [spec for spec in sources() if spec.segment is not None], ids=lambda spec: spec.prefix
)
def test_software_cameras_are_those_of_the_rig(spec: SourceSpec) -> None:
    assert spec.segment is not None
    segment = spec.segment(request(spec.prefix), _PLAN, _RIG)
    assert [camera.serial for camera in segment.cameras] == [one.serial for one in _RIG.cameras]


@pytest.mark.parametrize(
    "spec", [spec for spec in sources() if spec.scenes is not None], ids=lambda spec: spec.prefix
)
def test_scenes_come_from_the_virtual_rig(spec: SourceSpec) -> None:
    rig = resource("rigs", spec.rig) if spec.rig else RECOMMENDED_RIG
    site = VirtualSite(rig, STANDARD_PROBE, 3, None)
    assert spec.scenes is not None
    feed = spec.scenes(site.script((FreeMotionScene(ways=1, seed=1),)), 0.0)
    try:
        assert feed.live is spec.live
        assert feed.description.simulated
        assert feed.description.name.startswith(spec.recorded_as)
    finally:
        feed.end()


def test_prefixes_are_unique() -> None:
    prefixes = [spec.prefix for spec in sources()]
    assert len(set(prefixes)) == len(prefixes)


@pytest.mark.parametrize(
    "name",
    ["", "simulated:", "Simulated", "ethercat", "ethercat:", "replay:", "replay", "usb:0",
     "simulated:1"],
)  # fmt: skip
def test_an_unknown_source_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="not a frame source") as caught:
        source_of(name)
    assert caught.value.code == "source.unknown"
    assert names_in_words(sources()) in caught.value.remedy


def test_names_that_begin_alike_are_told_apart() -> None:
    assert source_of("ethercat:virtual").value == ""
    assert source_of("ethercat:virtual0").value == "virtual0"
    assert source_of("ethercat:eth0+eth1").value == "eth0+eth1"
    assert source_of("replay:C:/a.rec").value == "C:/a.rec"

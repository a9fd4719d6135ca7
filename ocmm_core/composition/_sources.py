"""All frame sources: names, kind and maker of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ocmm_core.composition._defaults import (
    DEFAULT_SOURCE,
    IN_PROCESS,
    REAL_WIRE,
    SERVICE,
    VIRTUAL_WIRE,
)
from ocmm_core.errors import InputError
from ocmm_core.host import require_linux

if TYPE_CHECKING:
    from ocmm_core.camera import Rig
    from ocmm_core.composition._feeds import Feed, StationRequest
    from ocmm_core.inspection.plan import Plan
    from ocmm_core.simulation.bus import SegmentConfig
    from ocmm_core.simulation.calibration_scenes import CalibratingScript


class Origin(Enum):
    """Origin of the frames; decides which calibrations are allowed."""

    VIRTUAL = auto()
    """Virtual rig, measured with its documents."""
    CAMERAS = auto()
    RECORDING = auto()
    """Frames of either; see the recording."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceSpec:
    prefix: str
    """Prefix of the name; the whole name if no value follows."""
    forms: tuple[tuple[str, str], ...]
    """Forms of the name and their meaning, one row each."""
    takes_value: bool
    """A value follows the prefix, such as an interface or file."""
    origin: Origin
    live: bool
    """Frames arrive in real time; other sources wait for their reader."""
    on_bus: bool
    """Frames come from a bus process that can report on its cameras."""
    recorded_as: str
    """Prefix of the name in recordings; empty for a recording, which keeps its source name."""
    make: Callable[[StationRequest, Plan, Rig, str], Feed]
    segment: Callable[[StationRequest, Plan, Rig], SegmentConfig] | None
    """Software cameras of its virtual wire; None without one."""
    scenes: Callable[[CalibratingScript, float], Feed] | None
    """Makes the virtual rig with calibration scenes, by speed; None if unsupported."""


@dataclass(frozen=True, slots=True)
class NamedSource:
    """Source entry with the value after its prefix."""

    spec: SourceSpec
    value: str


def _late(maker: str) -> Callable[..., Any]:
    """Return a function of `_feed_makers`, imported when called, for fast help."""

    def make(*given: object) -> object:
        made: object = getattr(import_module("ocmm_core.composition._feed_makers"), maker)(*given)
        return made

    make.__name__ = maker
    return make


SOURCES: tuple[SourceSpec, ...] = (
    SourceSpec(
        prefix=DEFAULT_SOURCE,
        forms=(("simulated", "the virtual rig in this process"),),
        takes_value=False,
        origin=Origin.VIRTUAL,
        live=False,
        on_bus=False,
        recorded_as=IN_PROCESS,
        make=_late("virtual_rig_feed"),
        segment=None,
        scenes=_late("scenes_feed"),
    ),
    SourceSpec(
        prefix="ethercat:virtual",
        forms=(
            (
                "ethercat:virtual",
                "the virtual rig over the whole wire: software cameras, a pair of virtual "
                "interfaces and the bus process, in a private network namespace, without root",
            ),
        ),
        takes_value=False,
        origin=Origin.VIRTUAL,
        live=True,
        on_bus=True,
        recorded_as=VIRTUAL_WIRE,
        make=_late("wire_feed"),
        segment=_late("segment_of"),
        scenes=_late("scenes_wire_feed"),
    ),
    SourceSpec(
        prefix="ethercat:pixels",
        forms=(
            (
                "ethercat:pixels",
                "the same, with cameras that render images pixel by pixel and find the spots in "
                "them; 1 kHz",
            ),
        ),
        takes_value=False,
        origin=Origin.VIRTUAL,
        live=True,
        on_bus=True,
        recorded_as=VIRTUAL_WIRE,
        make=_late("pixel_feed"),
        segment=_late("pixel_segment_of"),
        scenes=None,
    ),
    SourceSpec(
        prefix="ethercat:",
        forms=(
            (
                "ethercat:IFACE",
                "real cameras on a network interface; the bus process needs rights, which "
                "`installer/linux/grant-rights.sh` gives it",
            ),
            ("ethercat:IFACE+IFACE", "the same on a ring with a redundancy cable"),
        ),
        takes_value=True,
        origin=Origin.CAMERAS,
        live=True,
        on_bus=True,
        recorded_as=REAL_WIRE,
        make=_late("cameras_feed"),
        segment=None,
        scenes=None,
    ),
    SourceSpec(
        prefix="ethercat:service",
        forms=(
            (
                "ethercat:service",
                "real cameras through a service of this computer, so that operators need no "
                "special rights",
            ),
        ),
        takes_value=False,
        origin=Origin.CAMERAS,
        live=True,
        on_bus=True,
        recorded_as=SERVICE,
        make=_late("service_feed"),
        segment=None,
        scenes=None,
    ),
    SourceSpec(
        prefix="replay:",
        forms=(("replay:FILE", "a recording made with `ocmm record`"),),
        takes_value=True,
        origin=Origin.RECORDING,
        live=False,
        on_bus=False,
        recorded_as="",
        make=_late("recording_feed"),
        segment=None,
        scenes=None,
    ),
)

VIRTUAL_NAMES = tuple(
    sorted({spec.recorded_as for spec in SOURCES if spec.origin is Origin.VIRTUAL})
)
"""Prefixes of virtual source names in recordings."""


def source_of(name: str) -> NamedSource:
    """Return the source with this name; raise InputError if unknown."""
    for spec in SOURCES:
        if not spec.takes_value and name == spec.prefix:
            return NamedSource(spec, "")
    for spec in SOURCES:
        if spec.takes_value and name.startswith(spec.prefix) and name != spec.prefix:
            return NamedSource(spec, name.removeprefix(spec.prefix))
    raise InputError(
        "source.unknown",
        f"The source is {name!r}, which is not a frame source.",
        f"Give {names_in_words(SOURCES)}.",
    )


def origin_of(name: str) -> Origin:
    """Return the origin of a source's frames; InputError as `source_of`."""
    return source_of(name).spec.origin


def names_in_words(specs: Sequence[SourceSpec]) -> str:
    """Return the accepted names as the end of a sentence."""
    *first, last = (spec.forms[0][0] for spec in specs)
    return f"{', '.join(first)} or {last}" if first else last


def source_help(specs: Sequence[SourceSpec] = SOURCES) -> str:
    """Return all forms of the names with explanations, for command help."""
    return "; ".join(f"'{form}': {words}" for spec in specs for form, words in spec.forms) + "."


def make_feed(request: StationRequest, plan: Plan, rig: Rig) -> Feed:
    """Return the requested source, ready to start; InputError as `source_of`."""
    source = source_of(request.source)
    if source.spec.on_bus:
        require_linux("The camera bus")
    return source.spec.make(request, plan, rig, source.value)

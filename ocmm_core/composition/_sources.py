"""All sources of frames: an entry for each says how it is called, what it is and how it is made."""

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
    """What is behind the frames: it decides which calibration they may be measured with."""

    VIRTUAL = auto()
    """The virtual rig: measured with its documents."""
    CAMERAS = auto()
    """Real cameras: measured with their calibration."""
    RECORDING = auto()
    """Frames of either, as the recording says."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceSpec:
    """One kind of source."""

    prefix: str
    """How its name begins; the whole name where nothing follows."""
    forms: tuple[tuple[str, str], ...]
    """What a person types, and what that is: one row for each way to write it."""
    takes_value: bool
    """Something follows the prefix, such as an interface or a file."""
    origin: Origin
    """What is behind the frames."""
    live: bool
    """Frames come by themselves; other sources wait for who reads them."""
    on_bus: bool
    """A bus process brings them, which can be asked about its cameras."""
    recorded_as: str
    """How its name begins in recordings; empty for a recording, which keeps the name it has."""
    make: Callable[[StationRequest, Plan, Rig, str], Feed]
    """Makes it ready, from the request, its plan, the rig and what follows the prefix."""
    segment: Callable[[StationRequest, Plan, Rig], SegmentConfig] | None
    """The software cameras on its virtual wire; None where there is none."""
    scenes: Callable[[CalibratingScript, float], Feed] | None
    """Makes the virtual rig with the scenes of a calibration, times real time; None where there are
    no such scenes."""


@dataclass(frozen=True, slots=True)
class NamedSource:
    """A source that somebody named: its entry, and what followed the prefix."""

    spec: SourceSpec
    value: str


def _late(maker: str) -> Callable[..., Any]:
    """Return a function of `_feed_makers` that loads it when called: names and help come before."""

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
"""In the order in which they are explained."""

VIRTUAL_NAMES = tuple(
    sorted({spec.recorded_as for spec in SOURCES if spec.origin is Origin.VIRTUAL})
)
"""How the names of virtual sources begin in recordings."""


def source_of(name: str) -> NamedSource:
    """Return the source that somebody named, as the commands take it.

    Raises
    ------
    InputError
        There is no such source.
    """
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
    """Return what is behind the frames of a source; InputError as `source_of`."""
    return source_of(name).spec.origin


def names_in_words(specs: Sequence[SourceSpec]) -> str:
    """Return what a person may type, as the end of a sentence."""
    *first, last = (spec.forms[0][0] for spec in specs)
    return f"{', '.join(first)} or {last}" if first else last


def source_help(specs: Sequence[SourceSpec] = SOURCES) -> str:
    """Return all ways to name a source with what each is, for the help of a command."""
    return "; ".join(f"'{form}': {words}" for spec in specs for form, words in spec.forms) + "."


def make_feed(request: StationRequest, plan: Plan, rig: Rig) -> Feed:
    """Return the source that the request names, ready to start; InputError as `source_of`."""
    source = source_of(request.source)
    if source.spec.on_bus:
        require_linux("The camera bus")
    return source.spec.make(request, plan, rig, source.value)

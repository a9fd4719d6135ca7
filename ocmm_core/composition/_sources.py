"""All frame sources: names, kind and maker of each; packages add more by entry points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ocmm_core.composition._defaults import IN_PROCESS, REAL_WIRE, SERVICE, VIRTUAL_WIRE
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.host import require_linux
from ocmm_core.plugins import load_all

if TYPE_CHECKING:
    from ocmm_core.acceptance import AcceptanceProcedure
    from ocmm_core.camera import Rig
    from ocmm_core.composition._feeds import Feed, StationRequest
    from ocmm_core.composition.hands import Hand
    from ocmm_core.inspection.plan import Plan

GROUP = "ocmm.sources"
"""Entry points of added sources, each a `SourceSpec`."""
Failed = Callable[[OcmmError], None]


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
    takes_value: bool = False
    """A value follows the prefix, such as an interface or file."""
    origin: Origin
    live: bool
    """Frames arrive in real time; other sources wait for their reader."""
    on_bus: bool = False
    """Frames come from a bus process that can report on its cameras."""
    recorded_as: str
    """Prefix of the name in recordings; empty for a recording, which keeps its source name."""
    make: Callable[[StationRequest, Plan, Rig, str], Feed]
    segment: Callable[[StationRequest, Plan, Rig], Any] | None = None
    """Software cameras of its virtual wire (`ocmm_sim.bus.SegmentConfig`); None without one."""
    scenes: Callable[[Any, float], Feed] | None = None
    """Plays calibration scenes (`ocmm_sim.calibration_scenes`) at a speed; None if unsupported."""
    hand: Callable[[StationRequest, AcceptanceProcedure, Failed], Hand] | None = None
    """Virtual hand of an acceptance test; None if unsupported."""
    practice: Callable[[StationRequest], Any] | None = None
    """Virtual hand of the wizards (`ocmm_sim.practice.Practice`); None if unsupported."""
    rig: str = ""
    """Name of the shipped document in place of the recommended rig; empty: that rig."""


@dataclass(frozen=True, slots=True)
class NamedSource:
    """Source entry with the value after its prefix."""

    spec: SourceSpec
    value: str

    @property
    def name(self) -> str:
        return self.spec.prefix + self.value


def late(module: str, maker: str, *first: object) -> Callable[..., Any]:
    """Return a function of a module that is imported when it is called, for fast help.

    ``first``: its first arguments.
    """

    def make(*given: object) -> object:
        return getattr(import_module(module), maker)(*first, *given)

    make.__name__, make.__module__ = maker, module
    return make


_MAKERS = "ocmm_core.composition._feed_makers"

OWN: tuple[SourceSpec, ...] = (
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
        make=late(_MAKERS, "cameras_feed"),
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
        origin=Origin.CAMERAS,
        live=True,
        on_bus=True,
        recorded_as=SERVICE,
        make=late(_MAKERS, "service_feed"),
    ),
    SourceSpec(
        prefix="replay:",
        forms=(("replay:FILE", "a recording made with `ocmm record`"),),
        takes_value=True,
        origin=Origin.RECORDING,
        live=False,
        recorded_as="",
        make=late(_MAKERS, "recording_feed"),
    ),
)

_VIRTUAL = (IN_PROCESS, VIRTUAL_WIRE)
"""A recording of the virtual rig is recognised without its package, too."""


@cache
def sources() -> tuple[SourceSpec, ...]:
    """Return the sources that packages add, then our own; the names of ours cannot be taken."""
    taken = {spec.prefix for spec in OWN}
    return (*(one for one in load_all(GROUP, SourceSpec) if one.prefix not in taken), *OWN)


def virtual_names() -> tuple[str, ...]:
    """Return the prefixes of virtual source names in recordings."""
    added = {one.recorded_as for one in sources() if one.origin is Origin.VIRTUAL}
    # No package can declare recordings of real cameras virtual.
    real = tuple(one for one in added if any(name.startswith(one) for name in (REAL_WIRE, SERVICE)))
    return tuple(sorted({*_VIRTUAL, *added}.difference(real)))


def source_of(name: str) -> NamedSource:
    """Return the source with this name; raise InputError if unknown."""
    for spec in sources():
        if not spec.takes_value and name == spec.prefix:
            return NamedSource(spec, "")
    for spec in sources():
        if spec.takes_value and name.startswith(spec.prefix) and name != spec.prefix:
            return NamedSource(spec, name.removeprefix(spec.prefix))
    raise InputError(
        "source.unknown",
        f"The source is {name!r}, which is not a frame source.",
        f"Give {names_in_words(sources())}.",
    )


def origin_of(name: str) -> Origin:
    """Return the origin of a source's frames; InputError as `source_of`."""
    return source_of(name).spec.origin


def names_in_words(specs: Sequence[SourceSpec]) -> str:
    """Return the accepted names as the end of a sentence."""
    *first, last = (spec.forms[0][0] for spec in specs)
    return f"{', '.join(first)} or {last}" if first else last


def source_help(specs: Sequence[SourceSpec] | None = None) -> str:
    """Return all forms of the names with explanations, for command help."""
    specs = sources() if specs is None else specs
    return "; ".join(f"'{form}': {words}" for spec in specs for form, words in spec.forms) + "."


def make_feed(request: StationRequest, plan: Plan, rig: Rig, *, untimed: bool = False) -> Feed:
    """Return the requested source, ready to start; InputError as `source_of`.

    `untimed`: accept cameras without proof of a common exposure time. Their reader must measure it.
    """
    source = source_of(request.source)
    if source.spec.on_bus:
        require_linux("The camera bus")
    feed: Feed = source.spec.make(request, plan, rig, source.value)
    if feed.description.untimed and not untimed:
        feed.ring.close()
        raise InputError(
            "source.untimed",
            f"The source '{feed.description.name}' does not prove that its cameras expose at the "
            "same time, as calibrations and acceptance tests require.",
            "Use cameras with a common clock (PTP). Cameras can also be calibrated with a board "
            "that rests: ocmm calibrate boards.",
        )
    return feed

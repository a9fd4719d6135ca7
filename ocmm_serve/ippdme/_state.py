"""State of a session and of what outlives it, and what the server needs of a machine. Pure."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from ocmm_core.geometry import Float
from ocmm_serve.ippdme import _grammar as grammar
from ocmm_serve.ippdme._frames import CsyFrames

NO_TOOL, REF_TOOL, UNDEFINED, BASE_TOOL = "NoTool", "RefTool", "UnDefTool", "BaseTool"


@dataclass(frozen=True, slots=True)
class DmeTool:
    """A tip, or one of the reserved tools."""

    name: str
    id: str
    radius: float = 0.0
    qualified: str = "00000000T000000Z"
    """Time of the qualification in the form of 2.5; zeros if never."""


@dataclass(frozen=True, slots=True)
class BallPose:
    """The probe now."""

    tip_world: Float
    rotation_world_from_probe: Float
    box_probe: Float
    """(2, 3), mm: corners of the probe about its ball."""


@dataclass(frozen=True, slots=True)
class CommandedTouch:
    """Nominal of a commanded point, in the machine's system."""

    surface: Float
    """(3,), mm."""
    normal: Float | None
    """(3,), unit, out of the material; None if not given."""
    search_mm: float
    words: str
    """For the operator."""


class DmeMachine(Protocol):
    """Interface of a station for a server. DmeError with the sentence for the operator."""

    @property
    def simulated(self) -> bool: ...
    @property
    def mounted(self) -> str:
        """Return the name of the mounted tip."""

    @property
    def part_c(self) -> float | None:
        """Return the temperature of the part in the job; None if unknown."""

    @property
    def tools(self) -> Sequence[DmeTool]:
        """Return the mounted tip, and the others of the probe."""

    @property
    def volume(self) -> Float:
        """Return the corners (2, 3) of the measuring volume, mm."""

    def mount(self, name: str) -> None:
        """Make a tip the active one; DmeError if it cannot be."""

    def trouble(self) -> grammar.DmeError | None:
        """Return why no point can be recorded at any place."""

    def require_qualified(self) -> None:
        """Raise DmeError unless the mounted tip is qualified."""

    def pose(self) -> BallPose:
        """Return the present pose; DmeError if it is not trusted."""

    def end(self) -> None:
        """Close the job of the session."""

    def keep(self, note: Mapping[str, object]) -> None:
        """Make a note durable in the job; DmeError if it is not."""

    def discard(self, number: int, reason: str) -> None:
        """Take a point out of the job."""

    def expect(self, target: CommandedTouch | None) -> int:
        """Show a target, or None; return the number of the newest frame."""

    def remind(self, after_s: float) -> None:
        """Let a virtual hand touch the target again if it gave no point for a time."""

    def lead(self, *, allowed: bool) -> None:
        """Note whether the operator may measure unasked."""

    def tell(self, words: str) -> None:
        """Show a sentence to the operator."""


@dataclass(frozen=True, slots=True)
class ParLimits:
    """Limits of a parameter: minimum, maximum, default."""

    low: float
    high: float
    default: float


_SPEED, _ACCEL = ParLimits(0.0, 1000.0, 100.0), ParLimits(0.0, 10_000.0, 1000.0)
PARAMETERS: Mapping[str, Mapping[str, ParLimits]] = {
    "GoToPar": {"Speed": _SPEED, "Accel": _ACCEL},
    "PtMeasPar": {
        "Speed": _SPEED, "Accel": _ACCEL, "Approach": ParLimits(0.0, 50.0, 5.0),
        "Search": ParLimits(0.5, 50.0, 10.0), "Retract": ParLimits(-50.0, 50.0, 5.0),
    },
    "Part": {
        "Temperature": ParLimits(-50.0, 150.0, 20.0),
        "XpanCoefficient": ParLimits(-100.0, 1000.0, 0.0), "Approach": ParLimits(0.0, 50.0, 0.0),
        "Search": ParLimits(0.0, 50.0, 0.0), "Retract": ParLimits(-50.0, 50.0, 0.0),
    },
}  # fmt: skip
"""Parameters of a tool, and in 2.5 of the part. Only PtMeasPar.Search has an effect: the operator
moves the probe."""
OF_TOOL = ("GoToPar", "PtMeasPar")
AXES = ("X", "Y", "Z")
NO_SCAN = "This machine does not scan. Use single points in the program."


@dataclass(slots=True)
class MoveDaemon:
    """A running OnMoveReportE."""

    tag: str
    every_s: float
    step_mm: float
    items: tuple[str, ...]
    last_s: float
    last: Float | None = None


@dataclass(slots=True)
class DmeState:
    """State of the server towards its client; changed by commands, on one thread."""

    machine: DmeMachine
    dialect: grammar.DmeDialect
    frames: CsyFrames
    any_place: bool = False
    """Accept hits away from the nominal."""
    surface: bool = False
    """Send compensated points, with radius 0, in place of ball centres."""
    now: Callable[[], float] = time.monotonic
    in_session: bool = False
    locked: bool = False
    """Error state: only ClearAllErrors and some others are executed."""
    homed: bool = False
    user_enabled: bool = False
    user_asked: bool = False
    """EnableUser is in force; an implicit DisableUser ends with the next error."""
    tool: str = NO_TOOL
    found: str = UNDEFINED
    report: tuple[str, ...] = AXES
    daemon: MoveDaemon | None = None
    acts: dict[tuple[str, str], float] = field(default_factory=dict)
    """Values of parameters that differ from their default, by block and name."""
    active_errors: dict[int, str] = field(default_factory=dict)
    """Errors since the last ClearAllErrors, with the sentence for the operator."""

    def tool_named(self, name: str) -> DmeTool | None:
        """Return a tool by name, also a reserved one that a client may choose; None if unknown."""
        reserved = {one: DmeTool(one, one) for one in (REF_TOOL, NO_TOOL)}
        return {**reserved, **{one.name: one for one in self.machine.tools}}.get(name)

    def reset(self) -> None:
        """Return to the state at the start of a session."""
        self.report, self.daemon, self.locked = AXES, None, False
        self.active_errors.clear()
        for key in [key for key in self.acts if key[0] == "Part"]:
            del self.acts[key]

    def parameter(self, block: str, name: str) -> float:
        default = PARAMETERS[block][name].default
        measured = self.machine.part_c if (block, name) == ("Part", "Temperature") else None
        return self.acts.get((block, name), default if measured is None else measured)

    def set_parameter(self, block: str, name: str, value: float) -> bool:
        """Set a value within its limits; return whether it was inside."""
        limits = PARAMETERS[block][name]
        clamped = min(max(value, limits.low), limits.high)
        self.acts[block, name] = clamped
        return clamped == value

    def require_ready(self) -> None:
        """Raise DmeError if no point can be recorded at any place."""
        trouble = self.machine.trouble()
        if trouble is not None:
            # Its place is the command.
            raise grammar.DmeError(trouble.number, detail=trouble.detail)

    def changed_frames(self) -> None:
        """Show the active system, and let a running daemon report the virtual move."""
        self.machine.tell(self.frames.origin_words)
        if self.daemon is not None:
            self.daemon.last = None

    def user(self, *, enabled: bool) -> None:
        if enabled != self.user_enabled:
            self.user_enabled = enabled
            self.machine.lead(allowed=enabled)


Handler = Callable[[DmeState, tuple[grammar.Value, ...]], "list[str] | CommandedTouch | None"]
"""Returns the data lines of an answer, if any, or the target of a touch that is waited for."""


def names_in(args: Sequence[grammar.Value], allowed: Sequence[str]) -> tuple[str, ...]:
    """Return the names of a set ``X(), Y()``; DmeError 0510 if empty, repeated or unknown."""
    names = tuple(one.name for one in args if isinstance(one, grammar.Call) and not one.args)
    wrong = len(names) != len(args) or len(set(names)) != len(names) or set(names) - set(allowed)
    if wrong or not names:
        raise grammar.DmeError(510)
    return names


def numbers_in(args: Sequence[grammar.Value], count: int) -> tuple[float, ...]:
    """Return arguments that are `count` numbers; DmeError 0502 or 0509."""
    if len(args) != count:
        raise grammar.DmeError(502)
    found = tuple(one for one in args if isinstance(one, float))
    if len(found) != count:
        raise grammar.DmeError(509)
    return found


def properties(state: DmeState, call: grammar.Call) -> str:
    """Return a property with its value, as asked; DmeError 0510 if unknown."""
    block, _, rest = call.name.partition(".")
    if call.args or not rest:
        raise grammar.DmeError(510)
    if block == "Part" and state.dialect is grammar.DmeDialect.V25:
        return f"{call.name}({_limit(state, 'Part', rest)})"
    if block not in ("Tool", "FoundTool"):
        raise grammar.DmeError(510)
    name = state.tool if block == "Tool" else state.found
    tool = state.tool_named(name) or DmeTool(name, name)
    par, _, item = rest.partition(".")
    if par in OF_TOOL:
        return f"{call.name}({_limit(state, par, item)})"
    if rest in ("Name", "Id"):
        return f"{call.name}({grammar.quoted(tool.name if rest == 'Name' else tool.id)})"
    if block == "Tool" and rest in ("Alignment", "CollisionVolume"):
        return f"{call.name}({_orientation(state, rest)})"
    newer = state.dialect is grammar.DmeDialect.V25
    if newer and rest == "AvrRadius":
        return grammar.call_text(call.name, tool.radius)
    if newer and rest == "LastQualified":
        return f"{call.name}({grammar.quoted(tool.qualified)})"
    raise grammar.DmeError(510)


def _limit(state: DmeState, block: str, item: str) -> str:
    name, _, kind = item.partition(".")
    limits = PARAMETERS[block].get(name)
    if limits is None or kind not in ("", "Act", "Min", "Max", "Def"):
        raise grammar.DmeError(510)
    own = {"Min": limits.low, "Max": limits.high, "Def": limits.default}
    return grammar.number_text(own.get(kind, state.parameter(block, name)))


def _orientation(state: DmeState, kind: str) -> str:
    """Return the direction of the handle now, or the box about the probe; empty if not seen."""
    to_active = state.frames.active_from_machine().rotation
    try:
        pose = state.machine.pose()
    except grammar.DmeError:
        return "0, 0, 0" if kind == "Alignment" else ""
    axes = to_active @ pose.rotation_world_from_probe
    if kind == "Alignment":
        return grammar.list_text(axes[:, 2])
    low, high = pose.box_probe
    values = (*(axes @ (0.5 * (low + high))), *(0.5 * (high - low)), *axes.T.ravel())
    return grammar.list_text(("OBB", *values))


def property_kinds(state: DmeState, call: grammar.Call) -> Iterator[tuple[str, str]]:
    """Yield names and kinds of the members of a property; DmeError 0510 if unknown."""
    block, _, par = call.name.partition(".")
    if call.args or block not in ("Tool", "FoundTool", "Part"):
        raise grammar.DmeError(510)
    if block == "Part" and state.dialect is grammar.DmeDialect.V25 and not par:
        yield from ((name, "Number") for name in PARAMETERS["Part"])
        return
    if par in OF_TOOL and block != "Part":
        yield from ((name, "Number") for name in PARAMETERS[par])
        yield from ((name, "Property") for name in PARAMETERS[par])
        return
    limit, _, name = par.partition(".")
    if limit in OF_TOOL and block != "Part" and name in PARAMETERS[limit]:
        yield from ((kind, "Number") for kind in ("Min", "Max", "Act", "Def"))
        return
    if par or block == "Part":
        raise grammar.DmeError(510)
    yield from (("Name", "String"), ("Id", "String"))
    yield from ((name, "Property") for name in OF_TOOL)

"""Table of the commands: one entry each, which the session, the documentation and tests read.

The handlers of the classes Cartesian, TouchTrigger, Tool, ToolChanger and Scanning come first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from ocmm_core.geometry import Float
from ocmm_serve.ippdme import _commands as own
from ocmm_serve.ippdme._commands import Args, text_in
from ocmm_serve.ippdme._frames import CHAIN, checked
from ocmm_serve.ippdme._grammar import Call, DmeDialect, DmeError, call_text, quoted
from ocmm_serve.ippdme._points import ABSENT, POINT_ITEMS, pose_text
from ocmm_serve.ippdme._state import (
    AXES,
    BASE_TOOL,
    NO_SCAN,
    NO_TOOL,
    REF_TOOL,
    UNDEFINED,
    CommandedTouch,
    DmeState,
    Handler,
    names_in,
    numbers_in,
)


def on_pt_meas_report(state: DmeState, args: Args) -> None:
    state.report = names_in(args, POINT_ITEMS[state.dialect])


def pt_meas(state: DmeState, args: Args) -> CommandedTouch:
    if not args:
        raise DmeError(502)
    place: dict[str, float] = {}
    normal: Float | None = None
    for one in args:
        if not isinstance(one, Call):
            raise DmeError(509)
        if one.name == "IJK" and normal is None:
            normal = np.array(numbers_in(one.args, 3))
        elif one.name in (*AXES, "R") and one.name not in place:
            (place[one.name],) = numbers_in(one.args, 1)
        elif one.name in (*AXES, "R", "IJK"):
            raise DmeError(502)
        else:
            raise DmeError(506 if one.name in POINT_ITEMS[DmeDialect.V25] else 505)
    if not set(place) & set(AXES):
        raise DmeError(502)
    require_measuring(state)
    return _target(state, place, normal)


def _target(state: DmeState, place: dict[str, float], normal: Float | None) -> CommandedTouch:
    active = state.frames.active_from_machine()
    back = active.inverse()
    words = " ".join(f"{axis} {place[axis]:.3f}" for axis in AXES if axis in place)
    if normal is not None:
        size = float(np.linalg.norm(normal))
        if size < 1e-9:
            raise DmeError(1010)
        words += " from I {:.3f} J {:.3f} K {:.3f}".format(*(normal / size).tolist())
        normal = back.rotation @ (normal / size)
    if len(set(place) & set(AXES)) < len(AXES):
        before = active.apply(state.machine.pose().tip_world).tolist()
        place = {**dict(zip(AXES, before, strict=True)), **place}
    surface = back.apply(np.array([place[axis] for axis in AXES]))
    low, high = state.machine.volume
    if not state.any_place and not ((surface >= low) & (surface <= high)).all():
        raise DmeError(1008, detail=f"{words} is outside the measuring volume. Check the part "
                       "alignment of the program, and the sign of its shift.")  # fmt: skip
    search = state.parameter("PtMeasPar", "Search")
    return CommandedTouch(surface, normal, search, f"Touch {words} ({state.frames.active}).")


def require_measuring(state: DmeState) -> None:
    """Raise DmeError unless the machine is homed, and the active tool can measure."""
    if not state.homed or state.tool == NO_TOOL:
        raise DmeError(507, detail="Home, and choose a tool in the program.")
    if state.tool == UNDEFINED:
        raise DmeError(1503)
    if state.tool == REF_TOOL:
        raise DmeError(2000, detail="Choose a tip in the program.")
    state.require_ready()


def get(state: DmeState, args: Args) -> list[str]:
    return [pose_text(state, names_in(args, (*AXES, *ABSENT)), state.machine.pose())]


def on_scan_report(state: DmeState, args: Args) -> None:
    names_in(args, (*POINT_ITEMS[state.dialect], "Q"))


def align_tool(state: DmeState, args: Args) -> list[str]:
    raise DmeError(501 if state.dialect is DmeDialect.V14 else 1505)


def enum_tools(state: DmeState, args: Args) -> list[str]:
    names = (REF_TOOL, NO_TOOL, *(one.name for one in state.machine.tools))
    return [quoted(one) if state.dialect is DmeDialect.V14 else one for one in names]


def find_tool(state: DmeState, args: Args) -> None:
    name = text_in(args)
    found = state.tool_named(name)
    state.found = UNDEFINED if found is None else found.name
    if found is None:
        raise DmeError(1502, detail=_tip_words(state, name))


def change_tool(state: DmeState, args: Args) -> None:
    name = text_in(args)
    if name == BASE_TOOL or state.tool_named(name) is None:
        raise DmeError(1502, detail=_tip_words(state, name))
    if name not in (NO_TOOL, REF_TOOL):
        state.tool = UNDEFINED
        state.machine.mount(name)
    state.tool = name
    state.acts = {key: value for key, value in state.acts.items() if key[0] == "Part"}
    if state.daemon is not None:
        state.daemon.last = None


def _tip_words(state: DmeState, name: str) -> str:
    known = ", ".join(one.name for one in state.machine.tools)
    return f"The program asks for the tip {name}; this probe has {known}. Choose one of them there."


def get_change_tool_action(state: DmeState, args: Args) -> list[str]:
    name = text_in(args)
    if state.tool_named(name) is None:
        raise DmeError(1502, detail=_tip_words(state, name))
    action = "Switch" if name == state.tool else "MoveMan"
    if state.dialect is DmeDialect.V14:
        return [f"ChangeToolAction({action}, X(0), Y(0), Z(0))"]
    return [f"Argument({action}), X(0), Y(0), Z(0)"]


def found_tool(state: DmeState, args: Args) -> list[str]:
    if state.found == UNDEFINED:
        raise DmeError(1503)
    return [] if state.dialect is DmeDialect.V14 else [state.found]


BOTH = frozenset(DmeDialect)
NEWER = frozenset({DmeDialect.V25})


@dataclass(frozen=True, slots=True)
class CommandSpec:
    """A command in the table of the server."""

    name: str
    group: str
    """Class of the protocol."""
    arguments: str
    about: str
    """What this machine does, a sentence for the documentation."""
    handler: Handler
    dialects: frozenset[DmeDialect] = BOTH
    fast: bool = False
    """Overtakes waiting commands, and may carry an event tag."""
    always: bool = False
    """Executed also in the error state."""
    takes_user: bool = False
    """Executes DisableUser implicitly."""


def supported(dialect: DmeDialect) -> Mapping[str, CommandSpec]:
    """Return the commands of a dialect, in the order of the table."""
    return {one.name: one for one in COMMANDS if dialect in one.dialects}


def _same(
    group: str,
    names: str,
    arguments: str,
    about: str,
    handler: Handler,
    *,
    takes_user: bool = False,
) -> tuple[CommandSpec, ...]:
    """Return commands of one handler."""
    return tuple(
        CommandSpec(name, group, arguments, about, handler, takes_user=takes_user)
        for name in names.split()
    )


COMMANDS: tuple[CommandSpec, ...] = (
    CommandSpec("StartSession", "Server", "", "Starts a session and its job.", own.start_session,
        always=True),
    CommandSpec("EndSession", "Server", "", "Ends the session and closes its job.",
        own.end_session, always=True),
    CommandSpec("AbortE", "Server", "", "Aborts all pending commands.", own.abort, fast=True,
        always=True),
    CommandSpec("ClearAllErrors", "Server", "", "Leaves the error state.", own.clear_all_errors,
        always=True),
    CommandSpec("StopDaemon", "Server", "tag", "Stops OnMoveReportE.", own.stop_daemon),
    CommandSpec("StopAllDaemons", "Server", "", "Stops OnMoveReportE.", own.stop_all_daemons),
    CommandSpec("GetErrorInfo", "Server", "number", "Returns the text of an error.",
        own.get_error_info),
    CommandSpec("GetErrStatusE", "Server", "", "1 in the error state.", own.get_err_status,
        fast=True, always=True),
    CommandSpec("GetXtdErrStatus", "Server", "", "State, and the operator's sentences.",
        own.get_xtd_err_status, always=True),
    CommandSpec("GetProp", "Server", "properties", "Values of properties, in the requested "
        "order.", own.get_prop),
    CommandSpec("GetPropE", "Server", "properties", "As GetProp, at once.", own.get_prop,
        fast=True),
    CommandSpec("SetProp", "Server", "properties", "Within limits; PtMeasPar.Search has an "
        "effect.", own.set_prop),
    CommandSpec("EnumProp", "Server", "property", "Members of a property, one a line.",
        own.enum_prop),
    CommandSpec("EnumAllProp", "Server", "property", "Members of all levels, with dotted names.",
        own.enum_all_prop),
    CommandSpec("GetDMEVersion", "DME", "", "Version of the dialect.",
        lambda state, _: [call_text("DMEVersion", quoted(state.dialect.version))]),
    CommandSpec("GetMachineClass", "DME", "", "CartCMM; in 2.5 the class of manual machines.",
        own.get_machine_class),
    CommandSpec("GetSupportedCommands", "DME", "", "Names of all commands.",
        lambda state, _: list(supported(state.dialect)), dialects=NEWER),
    CommandSpec("Home", "DME", "", "Moves nothing; succeeds if points can be recorded.",
        own.home, takes_user=True),
    CommandSpec("IsHomed", "DME", "", "1 after Home.",
        lambda state, _: [f"IsHomed({state.homed:d})"]),
    CommandSpec("EnableUser", "Mover", "", "The operator leads: each touch is sent as an event.",
        own.enable_user),
    CommandSpec("DisableUser", "Mover", "", "Touches are no longer sent unasked.",
        partial(own.enable_user, enabled=False)),
    CommandSpec("IsUserEnabled", "Mover", "", "1 while the operator leads.",
        lambda state, _: [f"IsUserEnabled({state.user_enabled:d})"]),
    CommandSpec("OnMoveReportE", "Mover", "Time(s), Dis(d), X(), ...", "While LEDs are seen.",
        own.on_move_report, fast=True),
    CommandSpec("SetCoordSystem", "CartCMM", "name", "Selects the system of all numbers.",
        own.set_coord_system),
    CommandSpec("GetCoordSystem", "CartCMM", "", "The active system.", own.get_coord_system),
    CommandSpec("SetCsyTransformation", "CartCMM", "name, 6 numbers", "See the sign of the "
        "shift above.", own.set_csy_transformation),
    CommandSpec("GetCsyTransformation", "CartCMM", "name", "The six numbers of a system.",
        own.get_csy_transformation),
    CommandSpec("SaveActiveCoordSystem", "CartCMM", '"name"', "Stores that of the part.",
        lambda state, args: own.store_csy(
            state, text_in(args), state.frames.transformation(CHAIN[-1])
        ), dialects=NEWER),
    CommandSpec("SaveNamedCsyTransformation", "CartCMM", '"name", 6 numbers', "Stores it.",
        lambda state, args: own.store_csy(
            state, text_in(args[:1]), checked(numbers_in(args[1:], 6))
        ), dialects=NEWER),
    CommandSpec("LoadCoordSystem", "CartCMM", '"name"', "Makes it that of the part.",
        own.load_coord_system, dialects=NEWER),
    CommandSpec("DeleteCoordSystem", "CartCMM", '"name"', "Forgets a stored one.",
        own.delete_coord_system, dialects=NEWER),
    CommandSpec("EnumCoordSystems", "CartCMM", "", "Names of the stored ones.",
        lambda state, _: [quoted(name) for name in state.frames.named], dialects=NEWER),
    CommandSpec("GetNamedCsyTransformation", "CartCMM", '"name"', "Its six numbers.",
        lambda state, args: [own.transformation_text(state, own.named_csy(state, args))],
        dialects=NEWER),
    *_same("Cartesian", "GoTo", "any", "Not offered (0501): there are no drives.",
        own.refusing(501)),
    *_same("RotaryTable", "AlignPart", "any", "Not offered (0501): no rotary table.",
        own.refusing(501)),
    *_same("FormTester", "CenterPart TiltPart TiltCenterPart LockAxis LockPosition", "any",
        "Not offered (0501): there are no drives.", own.refusing(501)),
    *_same("Scanning", "ScanOnCircle ScanOnLine ScanOnCurve ScanUnknown ScanInPlaneEndIsSphere "
        "ScanInPlaneEndIsPlane ScanInPlaneEndIsCyl ScanInCylEndIsSphere ScanInCylEndIsPlane "
        "ScanOnHelix PtMeasSelfCenter PtMeasSelfCenterLocked", "any", "Refused (2002): the "
        "probe does not scan.", own.refusing(2002, NO_SCAN), takes_user=True),
    *_same("Scanning", "ScanOnCircleHint ScanOnLineHint ScanOnCurveHint ScanOnCurveDensity "
        "ScanUnknownHint ScanUnknownDensity", "any", "Accepted without effect.", own.ignore),
    *_same("Tool", "GoToPar PtMeasPar ScanPar", "", "A pointer; no answer.", own.ignore),
    *_same("items", " ".join((*AXES, *ABSENT, "IJK", "ER", "Q", "IJKAct", "Tool.Alignment")),
        "any", "Only an argument (0508).", own.refusing(508)),
    CommandSpec("OnPtMeasReport", "TouchTrigger", "X(), Y(), Z(), IJK(), ER(), ...", "Format "
        "of points.", on_pt_meas_report),
    CommandSpec("PtMeas", "TouchTrigger", "X(x), Y(y), Z(z), IJK(i, j, k)", "Waits for a touch "
        "near the nominal.", pt_meas, takes_user=True),
    CommandSpec("Get", "Cartesian", "X(), Y(), Z(), ...", "Position of the ball now.", get),
    CommandSpec("OnScanReport", "Scanning", "X(), Y(), Z(), Q(), ...", "Accepted; there are no "
        "scans.", on_scan_report),
    CommandSpec("AlignTool", "Alignable", "any", "Not offered (0501; in 2.5 1505).",
        align_tool),
    CommandSpec("EnumTools", "ToolChanger", "", "Reserved tools, and the tips of the probe.",
        enum_tools),
    CommandSpec("FindTool", "ToolChanger", '"name"', "Selects the tool of FoundTool.",
        find_tool),
    CommandSpec("ChangeTool", "ToolChanger", '"name"', "Makes a tip the active tool.",
        change_tool, takes_user=True),
    CommandSpec("SetTool", "ToolChanger", '"name"', "As ChangeTool.", change_tool,
        takes_user=True),
    CommandSpec("GetChangeToolAction", "ToolChanger", '"name"', "Tips are changed by hand.",
        get_change_tool_action),
    CommandSpec("Tool", "Tool", "", "The active tool.",
        lambda state, _: [] if state.dialect is DmeDialect.V14 else [state.tool]),
    CommandSpec("FoundTool", "Tool", "", "The tool of FindTool.", found_tool),
    CommandSpec("ReQualify", "Tool", "", "Succeeds if the qualification of the tip is in force.",
        lambda state, _: state.machine.require_qualified()),
    CommandSpec("IsAlignable", "Alignable", "", "0: the probe is in the operator's hand.",
        lambda *_: ["0"], dialects=NEWER),
)  # fmt: skip

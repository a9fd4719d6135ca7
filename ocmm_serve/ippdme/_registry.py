"""Table of the commands: one entry each, which the session, the documentation and tests read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ocmm_serve.ippdme import _commands as own
from ocmm_serve.ippdme import _touch_commands as touch
from ocmm_serve.ippdme._grammar import DmeDialect, Value
from ocmm_serve.ippdme._points import ABSENT
from ocmm_serve.ippdme._state import AXES, NO_SCAN, DmeState, Handler

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


def get_supported_commands(state: DmeState, args: tuple[Value, ...]) -> list[str]:
    return list(supported(state.dialect))


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
    CommandSpec("GetDMEVersion", "DME", "", "Version of the dialect.", own.get_dme_version),
    CommandSpec("GetMachineClass", "DME", "", "CartCMM; in 2.5 the class of manual machines.",
        own.get_machine_class),
    CommandSpec("GetSupportedCommands", "DME", "", "Names of all commands.",
        get_supported_commands, dialects=NEWER),
    CommandSpec("Home", "DME", "", "Moves nothing; succeeds if points can be recorded.",
        own.home, takes_user=True),
    CommandSpec("IsHomed", "DME", "", "1 after Home.", own.is_homed),
    CommandSpec("EnableUser", "Mover", "", "The operator leads: each touch is sent as an event.",
        own.enable_user),
    CommandSpec("DisableUser", "Mover", "", "Touches are no longer sent unasked.",
        own.disable_user),
    CommandSpec("IsUserEnabled", "Mover", "", "1 while the operator leads.", own.is_user_enabled),
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
        own.save_active_coord_system, dialects=NEWER),
    CommandSpec("SaveNamedCsyTransformation", "CartCMM", '"name", 6 numbers', "Stores it.",
        own.save_named_csy_transformation, dialects=NEWER),
    CommandSpec("LoadCoordSystem", "CartCMM", '"name"', "Makes it that of the part.",
        own.load_coord_system, dialects=NEWER),
    CommandSpec("DeleteCoordSystem", "CartCMM", '"name"', "Forgets a stored one.",
        own.delete_coord_system, dialects=NEWER),
    CommandSpec("EnumCoordSystems", "CartCMM", "", "Names of the stored ones.",
        own.enum_coord_systems, dialects=NEWER),
    CommandSpec("GetNamedCsyTransformation", "CartCMM", '"name"', "Its six numbers.",
        own.get_named_csy_transformation, dialects=NEWER),
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
        "of points.", touch.on_pt_meas_report),
    CommandSpec("PtMeas", "TouchTrigger", "X(x), Y(y), Z(z), IJK(i, j, k)", "Waits for a touch "
        "near the nominal.", touch.pt_meas, takes_user=True),
    CommandSpec("Get", "Cartesian", "X(), Y(), Z(), ...", "Position of the ball now.", touch.get),
    CommandSpec("OnScanReport", "Scanning", "X(), Y(), Z(), Q(), ...", "Accepted; there are no "
        "scans.", touch.on_scan_report),
    CommandSpec("AlignTool", "Alignable", "any", "Not offered (0501; in 2.5 1505).",
        touch.align_tool),
    CommandSpec("EnumTools", "ToolChanger", "", "Reserved tools, and the tips of the probe.",
        touch.enum_tools),
    CommandSpec("FindTool", "ToolChanger", '"name"', "Selects the tool of FoundTool.",
        touch.find_tool),
    CommandSpec("ChangeTool", "ToolChanger", '"name"', "Makes a tip the active tool.",
        touch.change_tool, takes_user=True),
    CommandSpec("SetTool", "ToolChanger", '"name"', "As ChangeTool.", touch.change_tool,
        takes_user=True),
    CommandSpec("GetChangeToolAction", "ToolChanger", '"name"', "Tips are changed by hand.",
        touch.get_change_tool_action),
    CommandSpec("Tool", "Tool", "", "The active tool.", touch.tool),
    CommandSpec("FoundTool", "Tool", "", "The tool of FindTool.", touch.found_tool),
    CommandSpec("ReQualify", "Tool", "", "Succeeds if the qualification of the tip is in force.",
        touch.re_qualify),
    CommandSpec("IsAlignable", "Alignable", "", "0: the probe is in the operator's hand.",
        touch.is_alignable, dialects=NEWER),
)  # fmt: skip

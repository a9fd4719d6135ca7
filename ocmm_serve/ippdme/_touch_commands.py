"""Commands of the classes Cartesian, TouchTrigger, Tool, ToolChanger and Scanning."""

from __future__ import annotations

import numpy as np

from ocmm_core.geometry import Float
from ocmm_serve.ippdme._commands import Args, text_in
from ocmm_serve.ippdme._grammar import Call, DmeDialect, DmeError, quoted
from ocmm_serve.ippdme._points import ABSENT, POINT_ITEMS, pose_text
from ocmm_serve.ippdme._state import (
    AXES,
    BASE_TOOL,
    NO_TOOL,
    REF_TOOL,
    UNDEFINED,
    CommandedTouch,
    DmeState,
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
    names = names_in(args, (*AXES, *ABSENT))
    return [pose_text(state, names, state.machine.pose())]


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


def tool(state: DmeState, args: Args) -> list[str]:
    return [] if state.dialect is DmeDialect.V14 else [state.tool]


def found_tool(state: DmeState, args: Args) -> list[str]:
    if state.found == UNDEFINED:
        raise DmeError(1503)
    return [] if state.dialect is DmeDialect.V14 else [state.found]


def re_qualify(state: DmeState, args: Args) -> None:
    state.machine.require_qualified()


def is_alignable(state: DmeState, args: Args) -> list[str]:
    return ["0"]

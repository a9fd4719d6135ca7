"""Commands of the classes Server, DME, Mover and CartCMM: sessions, properties, systems."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from ocmm_serve.ippdme import _grammar as grammar
from ocmm_serve.ippdme._frames import CHAIN, MACHINE, CsyTransformation
from ocmm_serve.ippdme._points import ABSENT
from ocmm_serve.ippdme._state import (
    AXES,
    OF_TOOL,
    PARAMETERS,
    DmeState,
    Handler,
    MoveDaemon,
    names_in,
    numbers_in,
    properties,
    property_kinds,
)
from ocmm_serve.ippdme._state import NO_SCAN as NO_SCAN

T = TypeVar("T")
Args = tuple[grammar.Value, ...]
LEAST_PERIOD_S = 0.1
"""s: between two lines of OnMoveReportE."""


def word_in(args: Args) -> str:
    """Return the only argument, a bare word; DmeError 0502 or 0509."""
    return _only(args, grammar.BareWord).name


def text_in(args: Args) -> str:
    """Return the only argument, a string; DmeError 0502 or 0509."""
    return _only(args, str)


def _only(args: Args, kind: type[T]) -> T:
    if len(args) != 1:
        raise grammar.DmeError(502)
    if not isinstance(args[0], kind):
        raise grammar.DmeError(509)
    return args[0]


def start_session(state: DmeState, args: Args) -> None:
    if state.in_session:
        raise grammar.DmeError(8)
    state.reset()
    state.machine.keep({"dialect": state.dialect, **state.frames.note()})
    state.in_session = True
    trouble = state.machine.trouble()
    if trouble is not None:
        # Known from the start: the first command that needs the machine fails by it.
        state.active_errors[trouble.number] = trouble.detail


def end_session(state: DmeState, args: Args) -> None:
    if state.in_session:
        state.in_session, state.daemon, state.locked = False, None, False
        state.user_asked = False
        state.user(enabled=False)
        state.machine.end()


def abort(state: DmeState, args: Args) -> None:
    # The session aborts pending transactions.
    state.locked = True


def clear_all_errors(state: DmeState, args: Args) -> None:
    state.locked = False
    state.active_errors.clear()


def stop_daemon(state: DmeState, args: Args) -> None:
    running = "" if state.daemon is None else state.daemon.tag
    # A command of the fast queue may have a tag of digits, which is a number here.
    if running.isdigit() and args == (float(running),):
        args = (grammar.BareWord(running),)
    if word_in(args) != running:
        raise grammar.DmeError(513)
    state.daemon = None


def stop_all_daemons(state: DmeState, args: Args) -> None:
    if state.daemon is None:
        raise grammar.DmeError(512)
    state.daemon = None


def get_error_info(state: DmeState, args: Args) -> list[str]:
    (number,) = numbers_in(args, 1)
    row = grammar.ERRORS[state.dialect].get(int(number)) if number.is_integer() else None
    if row is None:
        raise grammar.DmeError(509)
    return [grammar.quoted(row.text)]


def get_err_status(state: DmeState, args: Args) -> list[str]:
    status = str(int(state.locked))
    return [f"ErrStatus({status})" if state.dialect is grammar.DmeDialect.V14 else status]


def get_xtd_err_status(state: DmeState, args: Args) -> list[str]:
    lines = [f"IsHomed({state.homed:d})", f"IsUserEnabled({state.user_enabled:d})"]
    rows = grammar.ERRORS[state.dialect]
    for number, detail in state.active_errors.items():
        if state.dialect is grammar.DmeDialect.V25:
            lines.append(f"ActiveError({number:04d}), Severity({rows[number].severity})")
        else:
            lines.append(grammar.quoted(f"{number:04d} {detail or rows[number].text}"))
    if state.dialect is grammar.DmeDialect.V25 and state.machine.simulated:
        lines.append("ActiveError(8000), Severity(0)")
    return lines


def get_prop(state: DmeState, args: Args) -> list[str]:
    calls = [one for one in args if isinstance(one, grammar.Call)]
    if not calls or len(calls) != len(args):
        raise grammar.DmeError(502 if not args else 510)
    return [", ".join(properties(state, one) for one in calls)]


def set_prop(state: DmeState, args: Args) -> None:
    if not args:
        raise grammar.DmeError(502)
    wanted: list[tuple[str, str, float]] = []
    for one in args:
        if not isinstance(one, grammar.Call):
            raise grammar.DmeError(510)
        first, _, rest = one.name.partition(".")
        block, _, item = rest.partition(".") if first == "Tool" else (first, "", rest)
        name, _, kind = item.partition(".")
        own = first == "Part" and state.dialect is grammar.DmeDialect.V25
        if not (own or (first == "Tool" and block in OF_TOOL)) or name not in PARAMETERS.get(
            block, {}
        ):
            raise grammar.DmeError(510)
        if kind not in ("", "Act"):
            raise grammar.DmeError(509)
        wanted.append((block, name, numbers_in(one.args, 1)[0]))
    inside = [state.set_parameter(*one) for one in wanted]
    if not all(inside):
        raise grammar.DmeError(504)


def enum_prop(state: DmeState, args: Args) -> list[str]:
    found = property_kinds(state, _only(args, grammar.Call))
    return [f"{grammar.quoted(name)}, {grammar.quoted(kind)}" for name, kind in found]


def enum_all_prop(state: DmeState, args: Args) -> list[str]:
    top = _only(args, grammar.Call)
    lines: list[str] = []

    def walk(name: str, prefix: str) -> None:
        for member, kind in property_kinds(state, grammar.Call(name, ())):
            if kind == "Property":
                walk(f"{name}.{member}", f"{prefix}{member}.")
            else:
                lines.append(f"{grammar.quoted(prefix + member)}, {grammar.quoted(kind)}")

    walk(top.name, "")
    return lines


def get_machine_class(state: DmeState, args: Args) -> list[str]:
    if state.dialect is grammar.DmeDialect.V14:
        return ['GetMachineClass("CartCMM")']
    return ['"CartCMM_TouchTrigger_Fixed_None_ToolChanger_None_None"']


def home(state: DmeState, args: Args) -> None:
    state.homed = False
    state.require_ready()
    state.homed = True


def enable_user(state: DmeState, args: Args, *, enabled: bool = True) -> None:
    state.user_asked = enabled
    state.user(enabled=enabled)


def on_move_report(state: DmeState, args: Args) -> None:
    if state.daemon is not None:
        raise grammar.DmeError(515)
    limits = {"Time": 0.0, "Dis": 0.0}
    items: list[grammar.Value] = []
    for one in args:
        if isinstance(one, grammar.Call) and one.name in limits and one.args:
            (limits[one.name],) = numbers_in(one.args, 1)
            if limits[one.name] < (LEAST_PERIOD_S if one.name == "Time" else 1e-9):
                raise grammar.DmeError(509)
        else:
            items.append(one)
    names = names_in(items, (*AXES, *ABSENT))
    # The session has the tag.
    state.daemon = MoveDaemon("", limits["Time"], limits["Dis"], names, state.now())


def set_coord_system(state: DmeState, args: Args) -> None:
    name = word_in(args)
    if state.dialect is grammar.DmeDialect.V25 and name not in (MACHINE, *CHAIN):
        raise grammar.DmeError(1013)
    state.frames = state.frames.activated(name)
    state.changed_frames()


def get_coord_system(state: DmeState, args: Args) -> list[str]:
    active = state.frames.active
    return [f"CoordSystem({active})" if state.dialect is grammar.DmeDialect.V14 else active]


def set_csy_transformation(state: DmeState, args: Args) -> None:
    state.frames = state.frames.transformed(word_in(args[:1]), numbers_in(args[1:], 6))
    state.changed_frames()


def get_csy_transformation(state: DmeState, args: Args) -> list[str]:
    name = word_in(args)
    if name not in CHAIN:
        raise grammar.DmeError(505)
    return [transformation_text(state, state.frames.transformation(name))]


def transformation_text(state: DmeState, found: CsyTransformation) -> str:
    if state.dialect is grammar.DmeDialect.V14:
        return grammar.call_text("GetCsyTransformation", *found.values)
    pairs = zip(("X0", "Y0", "Z0", "Theta", "Psi", "Phi"), found.values, strict=True)
    return grammar.list_text(grammar.call_text(name, value) for name, value in pairs)


_MOST_NAMED = 256


def store_csy(state: DmeState, name: str, found: CsyTransformation) -> None:
    named = {**state.frames.named, name: found}
    if len(named) > _MOST_NAMED:
        raise grammar.DmeError(511, detail="Too many named coordinate systems. Delete some.")
    state.frames = replace(state.frames, named=named)


def load_coord_system(state: DmeState, args: Args) -> None:
    state.frames = state.frames.transformed(CHAIN[-1], named_csy(state, args).values)
    state.changed_frames()


def delete_coord_system(state: DmeState, args: Args) -> None:
    named_csy(state, args)
    left = {name: one for name, one in state.frames.named.items() if name != text_in(args)}
    state.frames = replace(state.frames, named=left)


def named_csy(state: DmeState, args: Args) -> CsyTransformation:
    found = state.frames.named.get(text_in(args))
    if found is None:
        raise grammar.DmeError(1013)
    return found


def refusing(number: int, detail: str = "") -> Handler:
    def refuse(state: DmeState, args: Args) -> None:
        raise grammar.DmeError(number, detail=detail)

    return refuse


def ignore(state: DmeState, args: Args) -> None:
    """Accept a command that has no effect here."""

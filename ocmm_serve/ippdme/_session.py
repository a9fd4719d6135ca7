"""The session: lines of a client and events of a machine in, lines to the client out. Pure.

Normal commands are executed in their order; one that waits for a touch delays the others. Commands
of the fast queue overtake them. Every command is acknowledged first and completed by exactly one
``%``.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from ocmm_core.measuring import MeasuredPoint, Refusal
from ocmm_serve.ippdme import _grammar
from ocmm_serve.ippdme import _points as points
from ocmm_serve.ippdme._commands import LEAST_PERIOD_S
from ocmm_serve.ippdme._registry import CommandSpec, supported
from ocmm_serve.ippdme._state import NO_TOOL, REF_TOOL, UNDEFINED, CommandedTouch, DmeState

_LOCKING, _LOCKED = 2, 514
"""Severity from which an error locks the session; error of a locked one."""
_REMIND_S = 20.0
"""A virtual hand takes some seconds for a touch."""
_ALONE = ("StartSession", "EndSession")
"""Commands without a session."""
_MOST_PENDING = 64
"""Commands that wait; more are answered by "Buffer full"."""
_TOO_EARLY = "It was touched before the program asked for it."
_NOT_ASKED = "The program did not ask for a point."
OPERATOR = "done, del, goto (a clearance point), cancel (no touch is possible), search MM, or a key"
"""Words of the operator."""


@dataclass(slots=True)
class OpenCommand:
    """A command between its ``&`` and its ``%``."""

    command: _grammar.DmeCommand
    spec: CommandSpec | None
    target: CommandedTouch | None = None
    since_s: float = 0.0
    first_frame: int = 0
    refused: int = 0
    """`target` and below: of a command that waits for a touch."""


class DmeSession:
    """Commands of one client at a time; `pop_lines` returns the lines to send.

    `patience_s`: longest wait for a touch. `tries`: refused touches after which a command fails.
    """

    def __init__(self, state: DmeState, patience_s: float = 600.0, tries: int = 3) -> None:
        self.state = state
        self._patience_s, self._tries = patience_s, tries
        self._specs = supported(state.dialect)
        self._pending: deque[OpenCommand] = deque()
        self._waiting: OpenCommand | None = None
        self._out: list[str] = []
        self._led: deque[int] = deque(maxlen=_MOST_PENDING)
        """Points that the operator led, which he can delete."""

    def pop_lines(self) -> list[str]:
        """Return the lines since the last call."""
        out, self._out = self._out, []
        return out

    # Lines of the client.

    def receive(self, line: bytes) -> None:
        """Process a line without CR LF."""
        try:
            command = _grammar.parse(line)
            spec = self._specs.get(command.name)
            event_tag = command.tag.startswith("E")
            if (event_tag and (spec is None or not spec.fast)) or self._is_open(command.tag):
                raise _grammar.DmeError(1, "Protocol")
        except _grammar.DmeError as error:
            self._malformed(error)
            return
        self._out.append(f"{command.tag} &")
        opened = OpenCommand(command, spec)
        if spec is not None and spec.fast:
            self._execute(opened)
        elif len(self._pending) >= _MOST_PENDING:
            self._fail(opened, _grammar.DmeError(0))
        else:
            self._pending.append(opened)
            self._advance()

    def disconnect(self) -> None:
        """End the session of a client that has gone; nothing is sent."""
        self._abort_pending()
        self._led.clear()
        spec = self._specs["EndSession"]
        try:
            spec.handler(self.state, ())
        except _grammar.DmeError as error:
            self.state.machine.tell(error.detail)
        self._out.clear()

    def _is_open(self, tag: str) -> bool:
        opened = [*self._pending, *([self._waiting] if self._waiting else [])]
        return any(one.command.tag == tag for one in opened)

    def _malformed(self, error: _grammar.DmeError) -> None:
        if error.tag != _grammar.NO_TAG:
            self._out.append(f"{error.tag} &")
        self._error(error.tag, error)
        if error.tag != _grammar.NO_TAG:
            self._out.append(f"{error.tag} %")
        self._lock_after(error)

    # Execution.

    def _advance(self) -> None:
        while self._pending and self._waiting is None:
            self._execute(self._pending.popleft())

    def _execute(self, opened: OpenCommand) -> None:
        command, state = opened.command, self.state
        try:
            spec = self._allowed(opened)
            if spec.takes_user:
                state.user(enabled=False)
            answer = spec.handler(state, command.args)
        except _grammar.DmeError as error:
            self._fail(opened, error)
            return
        if isinstance(answer, CommandedTouch):
            opened.target, opened.since_s = answer, state.now()
            opened.first_frame = state.machine.expect(answer)
            self._waiting = opened
            return
        if command.name == "AbortE":
            self._abort_pending()
        if command.name == "OnMoveReportE" and state.daemon is not None:
            state.daemon.tag = command.tag
        self._complete(opened, answer or [])

    def _allowed(self, opened: OpenCommand) -> CommandSpec:
        """Return the entry of a command that may be executed now."""
        state, name, spec = self.state, opened.command.name, opened.spec
        if not state.in_session and name not in _ALONE:
            raise _grammar.DmeError(507 if state.dialect is _grammar.DmeDialect.V14 else 8)
        if state.locked and (spec is None or not spec.always):
            raise _grammar.DmeError(_LOCKED)
        if spec is None:
            raise _grammar.DmeError(501)
        if opened.command.args and not spec.arguments:
            raise _grammar.DmeError(502)
        return spec

    def _complete(self, opened: OpenCommand, data: list[str]) -> None:
        tag = opened.command.tag
        self._out += [f"{tag} # {line}" for line in data]
        self._out.append(f"{tag} %")

    def _fail(self, opened: OpenCommand, error: _grammar.DmeError) -> None:
        tag = opened.command.tag
        error.where = error.where or opened.command.name
        self._error(tag, error)
        self._out.append(f"{tag} %")
        self._lock_after(error)

    def _error(self, tag: str, error: _grammar.DmeError) -> None:
        state = self.state
        self._out.append(_grammar.error_line(state.dialect, tag, error.number, error.where))
        if error.detail:
            state.machine.tell(error.detail)
        if (
            error.number != _LOCKED
            and _grammar.ERRORS[state.dialect][error.number].severity >= _LOCKING
        ):
            state.active_errors[error.number] = error.detail

    def _lock_after(self, error: _grammar.DmeError) -> None:
        state = self.state
        if _grammar.ERRORS[state.dialect][error.number].severity < _LOCKING:
            return
        self._abort_pending()
        if state.in_session:
            state.locked = True
            state.user(enabled=state.user_asked)

    def _abort_pending(self) -> None:
        """Abort the command that waits for a touch, and those behind it."""
        opened = [*([self._waiting] if self._waiting else []), *self._pending]
        self._waiting = None
        self._pending.clear()
        for one in opened:
            tag = one.command.tag
            self._out.append(_grammar.error_line(self.state.dialect, tag, 6, one.command.name))
            self._out.append(f"{tag} %")
        if opened:
            self.state.machine.expect(None)

    # Touches.

    def touched(self, point: MeasuredPoint) -> None:
        """Answer or report a durable point."""
        state, waiting = self.state, self._waiting
        if waiting is not None and waiting.target is not None:
            if point.first_frame <= waiting.first_frame:
                self._discard(point.number, _TOO_EARLY)
                return
            fault = "" if state.any_place else points.fault_of(point, waiting.target)
            if fault:
                self._take_out(point.number, fault)
                self._count_refusal(waiting, _grammar.DmeError(1006, detail=fault))
                return
            self._answer(waiting, point, waiting.target)
        elif self._leads:
            answer = points.point_text(state, point, None)
            try:
                state.machine.keep(points.point_note(state, _grammar.NO_TAG, point, answer, None))
            except _grammar.DmeError as error:
                self.report(error)
                return
            self._event("PtMeas", answer)
            self._led.append(point.number)
        else:
            self._discard(point.number, _NOT_ASKED)

    def refused(self, refusal: Refusal) -> None:
        """Note that the chain refused a touch; it is never answered."""
        number, waiting = points.refusal_number(refusal.code), self._waiting
        error = _grammar.DmeError(number, detail=f"{refusal.what} {refusal.remedy}")
        if waiting is None:
            self.state.machine.tell(error.detail)
            return
        if refusal.code in points.FINAL:
            waiting.refused = self._tries
        self._count_refusal(waiting, error)

    def cancel(self, why: str) -> None:
        """End the wait for a touch without one."""
        if self._waiting is not None:
            self._end_wait(self._waiting, _grammar.DmeError(1006, detail=why))

    def _answer(self, opened: OpenCommand, point: MeasuredPoint, target: CommandedTouch) -> None:
        state, tag = self.state, opened.command.tag
        self._waiting = None
        state.machine.expect(None)
        answer = points.point_text(state, point, target.normal)
        try:
            # Durable before it is sent.
            state.machine.keep(points.point_note(state, tag, point, answer, target))
        except _grammar.DmeError as error:
            self._fail(opened, error)
        else:
            self._complete(opened, [answer])
        self._advance()

    def _discard(self, number: int, reason: str) -> None:
        self.state.machine.tell(f"Point {number} is not used. {reason}")
        self._take_out(number, reason)

    def _take_out(self, number: int, reason: str) -> None:
        try:
            self.state.machine.discard(number, reason)
        except _grammar.DmeError as error:
            self.report(error)

    def _count_refusal(self, opened: OpenCommand, error: _grammar.DmeError) -> None:
        opened.refused += 1
        if opened.refused >= self._tries:
            self._end_wait(opened, error)
            return
        self.state.machine.tell(error.detail)
        if opened.target is not None:
            self.state.machine.expect(opened.target)

    def _end_wait(self, opened: OpenCommand, error: _grammar.DmeError) -> None:
        self._waiting = None
        self.state.machine.expect(None)
        self._fail(opened, error)
        self._advance()

    # Events without a command.

    def report(self, error: _grammar.DmeError) -> None:
        """Send an error that no command caused."""
        if not self.state.in_session:
            return
        self._error(_grammar.NO_TAG, error)
        self._lock_after(error)

    def operate(self, words: str) -> None:
        """Obey the operator: a name of `OPERATOR`, or another key; unknown words are keys."""
        verb, _, value = words.strip().partition(" ")
        if verb == "cancel":
            self.cancel("The operator cancelled the touch.")
        elif verb == "goto":
            self._pass_by()
        elif verb == "search" and value.replace(".", "", 1).isdigit():
            self.state.set_parameter("PtMeasPar", "Search", float(value))
            found = self.state.parameter("PtMeasPar", "Search")
            self._event("SetProp", _grammar.call_text("Tool.PtMeasPar.Search", found))
        elif verb:
            self._press(verb)

    def _press(self, key: str) -> None:
        if not self._leads:
            self.state.machine.tell("The program does not listen to keys now.")
            return
        key = {"done": "Done", "del": "Del"}.get(key, key)
        if key == "Del" and self._led:
            self._discard(self._led.pop(), "Deleted by the operator.")
        self._event("KeyPress", _grammar.quoted(key))

    def _pass_by(self) -> None:
        """Send the present position as a clearance point."""
        state = self.state
        if not self._leads:
            return
        try:
            pose = state.machine.pose()
        except _grammar.DmeError as error:
            state.machine.tell(error.detail)
            return
        radius = next((one.radius for one in state.machine.tools if one.name == state.tool), 0.0)
        self._event("GoTo", points.pose_text(state, state.report, pose, radius))

    def _event(self, name: str, argument: str) -> None:
        if self.state.in_session:
            self._out.append(f"{_grammar.NO_TAG} # {name}({argument})")

    @property
    def _leads(self) -> bool:
        """Return whether the operator's points and keys are sent unasked."""
        state = self.state
        return state.in_session and state.user_enabled and not state.locked

    def tick(self) -> None:
        """End a wait that is too long, and report a move."""
        state, waiting = self.state, self._waiting
        now = state.now()
        if waiting is not None and now - waiting.since_s > self._patience_s:
            self._end_wait(
                waiting,
                _grammar.DmeError(
                    1006, detail="No touch came in time. Repeat the point in the program."
                ),
            )
        state.machine.remind(_REMIND_S)
        if state.in_session and state.tool not in (NO_TOOL, REF_TOOL, UNDEFINED):
            mounted = state.machine.mounted
            if mounted != state.tool:
                # Another tip was mounted at the machine.
                state.tool = mounted
                self._event("ChangeTool", _grammar.quoted(mounted))
        trouble = state.machine.trouble() if state.in_session else None
        if trouble is not None and trouble.number not in state.active_errors:
            # Also after ClearAllErrors while the cause persists.
            self.report(trouble)
        daemon = state.daemon
        if daemon is None or now - daemon.last_s < LEAST_PERIOD_S:
            return
        try:
            pose = state.machine.pose()
        except _grammar.DmeError:
            # Nothing is sent of a probe that is not seen.
            return
        moved = np.inf
        if daemon.last is not None:
            moved = float(np.linalg.norm(pose.tip_world - daemon.last))
        late = daemon.every_s and now - daemon.last_s >= daemon.every_s
        if late or (daemon.step_mm and moved >= daemon.step_mm) or not np.isfinite(moved):
            daemon.last, daemon.last_s = pose.tip_world, now
            self._out.append(f"{daemon.tag} # {points.pose_text(state, daemon.items, pose)}")

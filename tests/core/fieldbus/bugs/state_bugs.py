"""Bugs of firmware: states."""

from __future__ import annotations

from typing import Any

from ocmm_sim.slave import registers as reg
from tests.core.fieldbus.bugs.bug_tools import add, answers, bug, refusal

# ruff: noqa: SLF001 - see bug_tools

add(
    "state.forbidden",
    "INIT to SAFEOP is allowed",
    refusal(lambda code, now, to: 0 if (now, to) == (1, 4) else code),
)
add(
    "state.forbidden",
    "a forbidden change has no code of its own",
    refusal(lambda code, _now, _to: 0x0001 if code == 0x0011 else code),
)
add(
    "state.forbidden",
    "an unknown state is taken for an invalid change",
    refusal(lambda code, _now, _to: 0x0011 if code == 0x0012 else code),
)
add(
    "state.sync_managers",
    "mailboxes are not looked at",
    refusal(lambda code, _now, _to: 0 if code == 0x0016 else code),
)
add(
    "state.sync_managers",
    "outputs are not looked at",
    refusal(lambda code, _now, _to: 0 if code == 0x001D else code),
)
add(
    "state.sync_managers",
    "wrong inputs are told as wrong outputs",
    refusal(lambda code, _now, _to: 0x001D if code == 0x001E else code),
)
add(
    "state.clock",
    "any SYNC0 is taken",
    refusal(lambda code, _now, _to: 0 if code == 0x0030 else code),
)
add(
    "state.boot",
    "PREOP after BOOT",
    refusal(lambda code, now, to: 0 if (now, to) == (3, 2) else code),
)
add(
    "state.boot",
    "BOOT without mailboxes",
    refusal(lambda code, _now, _to: 0 if code == 0x0015 else code),
)
add("state.boot", "no BOOT at all", lambda camera: setattr(camera.esc, "can_boot", False))
add(
    "state.boot",
    "CoE in BOOT",
    answers(lambda camera, asked, found: camera.coe.answer(asked) if found is None else found),
)
add(
    "state.forbidden",
    "BOOT from PREOP",
    refusal(lambda code, now, to: 0 if (now, to) == (2, 3) else code),
)


@bug("state.acknowledge", "an error needs no acknowledgement")
def _no_acknowledgement(camera: Any) -> None:
    before = camera.esc._al_control

    def control() -> None:
        camera.esc.memory[reg.AL_CONTROL] |= reg.ERROR
        before()

    camera.esc._al_control = control


@bug("state.acknowledge", "the AL status code stays")
def _code_stays(camera: Any) -> None:
    before = camera.esc._al_control

    def control() -> None:
        code = camera.esc._get(reg.AL_STATUS_CODE, "<H")
        before()
        if not camera.esc._get(reg.AL_STATUS_CODE, "<H"):
            camera.esc._set(reg.AL_STATUS_CODE, "<H", code)

    camera.esc._al_control = control


@bug("state.forbidden", "a refusal does not set the error bit")
def _no_error_bit(camera: Any) -> None:
    before = camera.esc._al_control

    def control() -> None:
        before()
        camera.esc.memory[reg.AL_STATUS] &= ~reg.ERROR

    camera.esc._al_control = control


@bug("state.allowed", "SAFEOP takes 1.2 s")
def _slow_state(camera: Any) -> None:
    before, poll = camera.esc._al_control, camera.esc.poll
    due: list[int] = []

    def control() -> None:
        if camera.esc.memory[reg.AL_CONTROL] & 0x0F == reg.SAFEOP:
            due.append(camera.esc.now_ns + 1_200_000_000)
        else:
            before()

    def polled(now_ns: int) -> None:
        poll(now_ns)
        while due and due[0] <= now_ns:
            due.clear()
            before()

    camera.esc._al_control, camera.esc.poll = control, polled


@bug("state.configuration", "an exposure longer than the period is started")
def _any_exposure(camera: Any) -> None:
    camera._config = lambda: type(camera)._config.__get__(_Short(camera))()


class _Short:
    """A camera whose exposure reads as 1 ns."""

    def __init__(self, camera: Any) -> None:
        self._camera = camera

    @property
    def coe(self) -> _Short:
        """Return itself."""
        return self

    def value(self, index: int, sub: int) -> Any:
        """Return a value."""
        if (index, sub) == (0x8000, 2):
            return b"\x01\x00\x00\x00"
        return self._camera.coe.value(index, sub)


@bug("state.configuration", "a contradiction has the code of missing outputs")
def _other_code(camera: Any) -> None:
    before = camera.esc.fall_back
    camera.esc.fall_back = lambda state, code: before(state, 0x1D if code == 0x26 else code)

"""Frames from the EtherCAT bus: each read is one validated and counted bus cycle."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator, Sequence

from ocmm_core.acquisition.frames import (
    Cycle,
    CycleVerdict,
    ExposureCount,
    Given,
    SourceDescription,
)
from ocmm_core.errors import BusError
from ocmm_core.fieldbus.cycle import (
    ERROR_OVER,
    OPERATION,
    BusAccounts,
    BusSettings,
    CameraBus,
    CameraPast,
    CycleAnswer,
    CycleFault,
    CyclePacer,
    Next,
    Supervisor,
    Trouble,
    advance,
    first_frame,
    judge,
)
from ocmm_core.fieldbus.described import Role
from ocmm_core.fieldbus.device import frames_of
from ocmm_core.fieldbus.objects import ObjectService, RequestPort, Thermometer
from ocmm_core.fieldbus.report import Alarm, BusPhase, BusReport, encode_report, pace_words
from ocmm_core.fieldbus.wire import HostTime, MasterWatch, is_virtual_cable, is_virtual_interface

_FOREIGN_NS = 20_000_000
"""Cycles are refused for this long after a frame of another master."""
_VERDICT = {Trouble.LOST: CycleVerdict.LOST, Trouble.BAD: CycleVerdict.BAD}
_PASSING = frozenset(
    {"bus.no_answer", "bus.map", "bus.clock", "bus.state", "bus.duplicate_address"}
)
"""May result from a computer that stalled briefly; the first start retries."""
_ANSWER_SHARE = 0.7
"""Part of a cycle spent waiting for the answer."""
_BUSY_SHARE = 0.5
"""A cycle starting later than by this part was spoilt by this computer."""
_PHASE_NS = 100_000
"""Time the cameras need to prepare a finished block of exposures."""
_SLICE_NS = 20_000_000
"""Duration of bring-up work before the lost cycles are returned."""
_REPORT_NS = 50_000_000
_DRIFT_LIMIT_PPM = 500.0


class EthercatSource:
    """Cameras on an EtherCAT bus, as a `FrameSource`.

    Bus faults do not end it: cycles are lost or refused until the cameras are in operation again,
    after a new bring-up if needed. The cycle follows the bus clock, so that frames are exchanged
    right after a block of exposures ends. `publish`: receives the encoded `BusReport`, at every
    change and 20 times a second. BusError: a waiting time was given for a physical interface.
    """

    def __init__(
        self,
        settings: BusSettings,
        publish: Callable[[bytes], None] | None = None,
        port: RequestPort | None = None,
        notes: Sequence[str] = (),
        host_time: HostTime | None = None,
    ) -> None:
        self._time = host_time or HostTime()
        if self._time.stretched and not is_virtual_cable(settings.interface):
            raise BusError(
                "bus.stretched",
                f"The time of interface '{settings.interface}' cannot wait for this computer.",
                "Start real cameras without a virtual time.",
            )
        self._settings = settings
        self._publish = publish
        names = tuple(camera.name for camera in settings.cameras)
        self._thermometer = Thermometer(port, names)
        self._objects = ObjectService(self._thermometer, names)
        self._bus = CameraBus(settings, self._objects, self._time)
        self._accounts = BusAccounts(settings, notes)
        self._masters = MasterWatch((settings.interface, settings.redundant_interface))
        self._supervisor = Supervisor(self._time.now_ns())
        self._exposures = ExposureCount(len(names))
        self._records: list[CameraPast] = []
        self._steps: Iterator[BusPhase] = iter(())
        self._pacer: CyclePacer | None = None
        self._published: tuple[BusPhase, str, str] | None = None
        self._published_ns = self._foreign = self._foreign_until_ns = 0
        self.lateness_ns = 0

    @property
    def description(self) -> SourceDescription:
        return SourceDescription(
            name=f"EtherCAT ({self._settings.interface})",
            camera_serials=tuple(camera.serial for camera in self._settings.cameras),
            frame_period_ns=self._settings.frame_period_ns,
            cycle_period_ns=self._settings.cycle_period_ns,
            live=True,
            simulated=is_virtual_interface(self._settings.interface),
            stretched=self._time.stretched,
        )

    @property
    def report(self) -> BusReport:
        phase_ns = 0.0 if self._pacer is None else self._pacer.phase_ns
        return self._accounts.report(
            self._bus,
            self._supervisor,
            self._objects,
            phase_ns,
            self._thermometer.celsius,
            self._time.pace,
        )

    def open(self) -> None:
        """Bring the cameras to operation; raise BusError with the remedy on failure."""
        for last in (False, False, True):
            try:
                for phase in self._bus.open_steps():
                    self._supervisor.stepping(phase)
                    self._publish_report()
                break
            except BusError as error:
                if error.code in _PASSING and not last:
                    continue
                now_ns = self._time.now_ns()
                self._supervisor.failed(error, now_ns)
                self._supervisor.phase = BusPhase.FAILED
                self._note(self._supervisor.alarm, error.what, now_ns, remedy=error.remedy)
                self._publish_report()
                raise
        self._begin_session()
        self._pacer = CyclePacer(self._settings.cycle_period_ns, self._time.now_ns())

    def read(self) -> Cycle:
        """Run the next bus cycle or recovery step; raise BusError if not open."""
        if self._pacer is None:
            raise BusError("bus.closed", "The camera bus is not open.", "Open it first.")
        wanted = self._supervisor.next(self._time.now_ns())
        step = self._exchange if wanted is Next.CYCLE else self._recover
        cycle = step(self._pacer)
        self._accounts.cycle(cycle.verdict.value, cycle.skipped.value, cycle.elapsed)
        self._listen()
        self._publish_report()
        return cycle

    def close(self) -> None:
        """Close the bus; idempotent, also after a failed open."""
        self._bus.close()
        if self._pacer is not None:
            self._pacer = None
            self._supervisor.phase = BusPhase.CLOSED
            self._publish_report()

    def _exchange(self, pacer: CyclePacer) -> Cycle:
        self.lateness_ns = self._time.wait_until(pacer.deadline_ns)
        elapsed = pacer.start_cycle(self._time.now_ns())
        self._accounts.lateness.add(max(0, self.lateness_ns))
        answer = self._bus.exchange(
            [record.next_frame for record in self._records],
            int(_ANSWER_SHARE * self._settings.cycle_period_ns),
        )
        passage, clock = self._bus.passage, self._bus.clock
        if passage is not None and passage.whole:
            self._accounts.round_trip.add(passage.answered_ns - passage.sent_ns)
        late = self._time.now_ns() > pacer.deadline_ns
        if clock.known:
            pacer.follow(clock, self._bus.schedule.start_ns + _PHASE_NS)
        fault = judge(answer, self._records, self._bus.schedule)
        fault = self._second_master(disturbed=fault is not None) or fault
        if fault is not None:
            self._bus.look_closer()
            return self._refuse(self._or_the_computer(fault, elapsed), elapsed)
        given = self._receive(answer)
        end_ns = self._time.now_ns()
        if self._supervisor.good(end_ns):
            self._note(OPERATION, "The cameras are in operation.", end_ns)
        if late or elapsed > 1:
            busy = "The computer was busy and answered the cameras late."
            self._note(Alarm.HOST_BUSY, busy, end_ns, cycles=elapsed - 1 + late)
        if slow := pace_words(self._time.pace):
            self._note(Alarm.STRETCHED, slow, end_ns)
        if self._bus.redundancy_broken:
            ring = "The ring is open: the next cable fault stops measuring."
            self._note(Alarm.REDUNDANCY, ring, end_ns)
        if abs(clock.drift_ppm) > _DRIFT_LIMIT_PPM:
            words = f"The bus clock drifts {clock.drift_ppm:+.0f} ppm against this computer."
            self._note(Alarm.CLOCK_DRIFT, words, end_ns)
        return Cycle(
            CycleVerdict.LATE if late else CycleVerdict.GOOD,
            "The computer was busy and answered the cameras late." if late else "",
            frames=given.frames,
            elapsed=elapsed,
            frames_lost=given.lost,
        )

    def _second_master(self, *, disturbed: bool) -> CycleFault | None:
        """Return the fault of a cycle while another master is on the bus."""
        program = self._masters.trouble(self._time.now_ns(), disturbed=disturbed)
        if program:
            return CycleFault(Trouble.BAD, Alarm.SECOND_MASTER, program)
        before, self._foreign = self._foreign, self._bus.foreign_frames
        if self._foreign > before:
            # It may send less often than we do, and affects the cameras in between.
            self._foreign_until_ns = self._time.now_ns() + _FOREIGN_NS
        elif self._time.now_ns() >= self._foreign_until_ns:
            return None
        words = f"Another master sends on the camera bus ({self._foreign} frames until now)."
        return CycleFault(Trouble.BAD, Alarm.SECOND_MASTER, words)

    def _or_the_computer(self, fault: CycleFault, elapsed: int) -> CycleFault:
        """Attribute a lost answer to this computer if it stalled; cables also lose timely ones."""
        if fault.alarm not in (Alarm.LOST_ANSWERS, Alarm.LATE_ANSWERS) or self._time.stretched:
            return fault
        period_ns, passage = self._settings.cycle_period_ns, self._bus.passage
        waited_ns = 0 if passage is None else passage.answered_ns - passage.sent_ns
        if elapsed == 1 and self.lateness_ns <= _BUSY_SHARE * period_ns and waited_ns <= period_ns:
            return fault
        words = (
            "The computer was busy and did not look for the answers of the cameras in time "
            f"({max(self.lateness_ns, waited_ns) / 1e6:.1f} ms)."
        )
        return CycleFault(fault.trouble, Alarm.HOST_BUSY, words)

    def _refuse(self, fault: CycleFault, elapsed: int) -> Cycle:
        now_ns = self._time.now_ns()
        self._accounts.refused(fault.camera)
        self._note(fault.alarm, fault.reason, now_ns, camera=fault.camera, remedy=fault.remedy)
        self._supervisor.bad(fault, now_ns)
        return Cycle(_VERDICT[fault.trouble], fault.reason, elapsed=elapsed)

    def _recover(self, pacer: CyclePacer) -> Cycle:
        """Continue the bring-up briefly; its cycles are lost."""
        supervisor = self._supervisor
        begin_ns = now_ns = self._time.now_ns()
        while now_ns - begin_ns < _SLICE_NS:
            wanted = supervisor.next(now_ns)
            if wanted is Next.CYCLE:
                break
            if wanted is not Next.STEP:
                self._time.flow()
            if wanted is Next.PAUSE:
                # Time is not critical now, and collection is disabled elsewhere.
                gc.collect()
                left_ns = min(supervisor.pause_left_ns(now_ns), _SLICE_NS - (now_ns - begin_ns))
                time.sleep(max(0, left_ns) * 1e-9)
            else:
                self._step(wanted)
            now_ns = self._time.now_ns()
        self._objects.work(now_ns)
        elapsed = pacer.passed(now_ns)
        if not elapsed:
            # The due cycle counts for this call; the next one starts a period later.
            time.sleep(max(0, pacer.deadline_ns - now_ns) * 1e-9)
            elapsed = pacer.start_cycle(max(self._time.now_ns(), pacer.deadline_ns))
        reason = supervisor.message or "The cameras are starting up."
        return Cycle(CycleVerdict.LOST, reason, elapsed=elapsed, skipped=CycleVerdict.LOST)

    def _step(self, wanted: Next) -> None:
        supervisor = self._supervisor
        try:
            if wanted is Next.RESTART:
                self._steps = self._bus.open_steps()
            phase = next(self._steps, None)
        except BusError as error:
            now_ns = self._time.now_ns()
            supervisor.failed(error, now_ns)
            self._note(supervisor.alarm, error.what, now_ns, remedy=error.remedy)
            return
        if phase is not None:
            supervisor.stepping(phase)
            return
        self._begin_session()

    def _begin_session(self) -> None:
        """Adopt the exposures started by a bring-up."""
        self._foreign = self._foreign_until_ns = 0
        schedule = self._bus.schedule
        device = self._settings.device
        self._records = [
            CameraPast(
                camera.name,
                layout=layout,
                mark=layout.mark(camera.serial),
                counts=device is None or device.has(Role.COUNTER),
            )
            for camera, layout in zip(
                self._settings.cameras, self._bus.session.layouts, strict=True
            )
        ]
        gap = self._exposures.start(schedule, self._bus.session.start_host_ns)
        self._accounts.lost(gap)
        self._supervisor.brought_up(self._time.now_ns())

    def _receive(self, answer: CycleAnswer) -> Given:
        """Add frames that are new by their counters; return the completed ones."""
        schedule = self._bus.schedule
        for camera, header in enumerate(answer.headers):
            record, first = self._records[camera], first_frame(header, schedule)
            if self._accounts.taken(record, header, first):
                words = f"Camera '{record.name}' was power-cycled."
                self._note(Alarm.RESTARTED, words, self._time.now_ns(), camera=record.name)
            known = max(0, record.next_frame - first)
            frames = frames_of(answer.inputs[camera], known, header.frames_valid)
            self._exposures.push(camera, first + known, frames)
            self._records[camera] = advance(record, header, first)
        return self._exposures.pull()

    def _listen(self) -> None:
        """Log the cameras' messages and finished requests."""
        now_ns = self._time.now_ns()
        for camera, trouble in self._bus.port_news():
            self._note(Alarm.PORT_ERRORS, trouble.message(camera), now_ns, camera=camera)
        while self._objects.emergencies:
            camera, emergency = self._objects.emergencies.popleft()
            if emergency.is_over:
                # This message reports the end of an error and needs no action.
                words = f"Camera '{camera}' reports that its error is over"
                rest = f"; its error register still shows {emergency.register:#04x}"
                words += f"{rest if emergency.register else ''}."
                self._note(ERROR_OVER, words, now_ns, camera=camera)
                continue
            self._accounts.emergency(camera)
            words = (
                f"Camera '{camera}' reports an emergency: {emergency.text} "
                f"({emergency.code:#06x}, error register {emergency.register:#04x})."
            )
            self._note(Alarm.EMERGENCY, words, now_ns, camera=camera)
        while self._objects.failures:
            camera, reply = self._objects.failures.popleft()
            self._note(reply.code, reply.what, now_ns, camera=camera, remedy=reply.remedy)

    def _note(
        self, code: str, what: str, now_ns: int, *, camera: str = "", remedy: str = "",
        cycles: int = 1,
    ) -> None:  # fmt: skip
        self._accounts.journal.note(
            code, what, cycle=self._accounts.elapsed, now_ns=now_ns, camera=camera, remedy=remedy,
            cycles=cycles,
        )  # fmt: skip

    def _publish_report(self) -> None:
        """Publish the report after a change or an interval."""
        if self._publish is None:
            return
        supervisor, now_ns = self._supervisor, time.monotonic_ns()
        state = (supervisor.phase, supervisor.alarm, supervisor.camera)
        if state == self._published and now_ns - self._published_ns < _REPORT_NS:
            return
        self._published, self._published_ns = state, now_ns
        self._publish(encode_report(self.report))

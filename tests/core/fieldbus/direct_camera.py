"""One software camera without a network: mailboxes are written into its controller's memory."""

from __future__ import annotations

import struct
from collections.abc import Callable

from ocmm_core.fieldbus.device import (
    INPUT_DTYPE,
    INPUT_START,
    MAILBOX_BYTES,
    MAILBOX_IN_START,
    MAILBOX_OUT_START,
    OUTPUT_START,
    OUTPUT_STRUCT,
    SYNC_MANAGERS,
)
from ocmm_core.fieldbus.objects import Progress
from ocmm_core.fieldbus.objects._sdo import SdoRead, SdoTransfer, SdoWrite
from ocmm_sim.slave import CameraFrames, CameraStore, SoftwareCamera, TestPattern
from ocmm_sim.slave import registers as reg

SERIAL = 1001
STEP_NS = 1_000_000


class DirectCamera:
    """A camera connected to a host without a wire; implements `ObjectAccess`.

    Parameters
    ----------
    provider, store
        Of the camera.
    state
        Its target state.
    serial
        Serial number.
    """

    def __init__(
        self,
        provider: CameraFrames | None = None,
        store: CameraStore | None = None,
        state: int = reg.PREOP,
        serial: int = SERIAL,
    ) -> None:
        self.camera = SoftwareCamera(0, serial, 1, provider or TestPattern(), 1, store)
        self.esc = self.camera.esc
        self.esc.now_ns = 10**12
        self.emergencies: list[bytes] = []
        self.on_mailbox: Callable[[bytes], object] = lambda _mailbox: None
        for number, manager in enumerate(SYNC_MANAGERS):
            settings = struct.pack("<HHBBBB", *manager[:5], 0)
            self.esc.write(reg.SYNC_MANAGER + 8 * number, settings)
        self.go(state)

    @property
    def status(self) -> tuple[int, int]:
        """Return AL state with error bit, and AL status code."""
        content = self.esc.read(reg.AL_STATUS, 6) or b""
        return content[0], int.from_bytes(content[4:6], "little")

    def go(self, state: int) -> None:
        """Ask for every state up to this one; errors are acknowledged."""
        for each in (reg.PREOP, reg.SAFEOP, reg.OP):
            if self.esc.state < each <= state:
                self.esc.write(reg.AL_CONTROL, struct.pack("<H", each | reg.ERROR))
        if self.esc.state > state:
            self.esc.write(reg.AL_CONTROL, struct.pack("<H", state))

    def work(self, steps: int = 1) -> None:
        """Let time pass, as the loop on the wire does."""
        for _ in range(steps):
            now = self.esc.now_ns + STEP_NS
            for _chunk in range(5):
                self.camera.generate(now)

    def exchange(self, mailbox: bytes) -> bytes | None:
        """Write a mailbox; return the answer, or None. Emergencies are put aside."""
        self.on_mailbox(mailbox)
        assert self.esc.write(MAILBOX_OUT_START, mailbox.ljust(MAILBOX_BYTES, b"\x00"))
        return self.receive()

    def receive(self) -> bytes | None:
        """Return the next mailbox that is no emergency, or None."""
        while (content := self.esc.read(MAILBOX_IN_START, MAILBOX_BYTES)) is not None:
            if content[5] & 0x0F == 3 and content[7] >> 4 == 1:
                self.emergencies.append(content)
                continue
            return content
        return None

    def cycle(self, control: int = 0, acknowledge: int = 0) -> bytes:
        """Exchange process data once; return the inputs."""
        outputs = OUTPUT_STRUCT.pack(control, 0, acknowledge, 0)
        self.esc.store_outputs(OUTPUT_START, memoryview(outputs))
        self.work()
        self.esc.refresh_inputs()
        return bytes(self.esc.memory[INPUT_START : INPUT_START + INPUT_DTYPE.itemsize])

    def read(
        self, index: int, sub: int, *, room: int = 1 << 20, progress: Progress | None = None
    ) -> bytes:
        """Return the value of an entry; see `ObjectAccess`."""
        return self._run(SdoRead(index, sub, room, mailbox_bytes=MAILBOX_BYTES)).result

    def write(
        self, index: int, sub: int, value: bytes, *, progress: Progress | None = None
    ) -> None:
        """Write the value of an entry; see `ObjectAccess`."""
        self._run(SdoWrite(index, sub, value, mailbox_bytes=MAILBOX_BYTES))

    def _run(self, transfer: SdoTransfer) -> SdoTransfer:
        while not transfer.done:
            answer = self.exchange(transfer.request(1))
            assert answer is not None
            transfer.answer(answer)
            self.work()
        return transfer

"""Faults of software GigE Vision cameras, each a scenario with the report it must cause."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ocmm_core.errors import OcmmError
from ocmm_sim.genicam import Feature, GigeConfig
from tests.genicam.genicam_rig import CONFIG, SECOND, SIZE, Rig, read_for  # fmt: skip
from tests.genicam.packet_edits import (
    Edit,
    Which,
    any_packet,
    damaged,
    every_second,
    from_one,
    leader,
    old_time,
    payload,
    put,
    renumbered,
    some,
)  # fmt: skip


def _packets(fault: str, value: object, *, resent: bool = True) -> Callable[[int], Any]:
    """Return a scenario of packets that do not arrive as sent."""

    def play(repeats: int) -> Any:
        rig = Rig(CONFIG, SECOND)
        source = rig.source()
        try:
            source.open()
            clean = read_for(rig, source, 0.5)
            counts = []
            for _ in range(repeats):
                for camera in rig.cameras:
                    camera.faults.refuse_resend = not resent
                    setattr(camera.faults, fault, value)
                during = read_for(rig, source, 0.5)
                for camera in rig.cameras:
                    setattr(camera.faults, fault, None if callable(value) else type(value)())
                began = time.monotonic()
                after = 0
                while after < 20 and time.monotonic() - began < 3.0:
                    after += read_for(rig, source, 0.05)
                counts.append((during, after, time.monotonic() - began))
            accounts = [
                [one.exposures - one.delivered - one.lost, one.lost, one.incomplete]
                for one in source.accounts.values()
            ]
            return {"clean": clean, "counts": counts, "wrong": rig.wrong, "right": rig.right,
                    "accounts": accounts}  # fmt: skip
        finally:
            source.close()
            rig.close()

    return play


def _sentence(
    deed: Callable[[Rig], None], *configs: GigeConfig, opens: bool = True
) -> Callable[[int], Any]:
    """Return a scenario that ends with a sentence: at the opening, or after an act."""

    def play(repeats: int) -> Any:
        told = []
        wrong = 0
        for _ in range(repeats):
            rig = Rig(*(configs or (CONFIG, SECOND)))
            source = rig.source()
            began = time.monotonic()
            try:
                if not opens:
                    deed(rig)
                source.open()
                if opens:
                    read_for(rig, source, 0.5)
                    deed(rig)
                    began = time.monotonic()
                read_for(rig, source, 6.0)
                told.append(["", "", 0.0])
            except OcmmError as error:
                source.close()
                told.append([error.code, str(error), time.monotonic() - began])
            finally:
                source.close()
                rig.close()
            wrong += rig.wrong
        return {"told": told, "wrong": wrong}

    return play


def _first(**changes: object) -> Callable[[Rig], None]:
    def deed(rig: Rig) -> None:
        for name, value in changes.items():
            setattr(rig.cameras[0].faults, name, value)

    return deed


def _controlled(repeats: int) -> Any:
    """Open cameras that another program controls, then again after it has ended."""
    rig = Rig(CONFIG, SECOND)
    first, told = rig.source(), []
    try:
        first.open()
        for _ in range(repeats):
            second = rig.source()
            try:
                second.open()
                told.append(["", "", 0.0])
            except OcmmError as error:
                told.append([error.code, str(error), 0.0])
            finally:
                second.close()
        frames = read_for(rig, first, 0.5)
    finally:
        first.close()
        rig.close()
    return {"told": told, "wrong": rig.wrong, "frames": frames}


def _edited(which: Which, edit: Edit) -> Callable[[Rig], None]:
    """Return an act that changes packets of the first camera."""

    def deed(rig: Rig) -> None:
        rig.cameras[0].faults.edit = lambda one: edit(one) if which(one) else one

    return deed


def _both(**changes: object) -> Callable[[Rig], None]:
    def deed(rig: Rig) -> None:
        for camera in rig.cameras:
            for name, value in changes.items():
                setattr(camera.faults, name, value)

    return deed


def _register(place: int, value: int) -> Callable[[Rig], None]:
    return lambda rig: rig.cameras[0].memory.set_u32(place, value)


def _blanked(rig: Rig) -> None:
    rig.cameras[0].memory.write(0x2_0400, bytes(0x8000))


def _exposed(exposure_us: float, *, both: bool = False) -> Callable[[Rig], None]:
    def deed(rig: Rig) -> None:
        for camera in rig.cameras[: 2 if both else 1]:
            camera.memory.write(Feature.EXPOSURE, struct.pack(">d", exposure_us))
            camera.memory.settle()

    return deed


def _nothing(_rig: Rig) -> None:
    pass


def _ptp(**changes: Any) -> Callable[[Rig], None]:
    def deed(rig: Rig) -> None:
        rig.cameras[0].reconfigure(**changes)

    return deed


FAULTS: dict[str, Callable[[int], Any]] = {
    "lost": _packets("edit", some(0.05, any_packet)),
    "swapped": _packets("swap", 0.3),
    "doubled": _packets("double", 0.3),
    "damaged": _packets("edit", some(0.05, any_packet, damaged)),
    "resend refused": _packets("edit", some(0.005, any_packet), resent=False),
    "controlled": _controlled,
    "unplugged": _sentence(_first(deaf=True, edit=lambda _: b"")),
    "nothing complete": _sentence(_first(edit=some(0.5, any_packet), refuse_resend=True)),
    "clock step": _sentence(_first(clock_step_ns=10**9)),
    "clock step back": _sentence(_first(clock_step_ns=-(10**9))),
    "small clock step": _sentence(_first(clock_step_ns=100_000)),
    "old time": _sentence(_edited(leader, old_time())),
    "wrong format": _sentence(_edited(leader, put(20, ">I", 0x0108_0001))),
    "half as wide": _sentence(_edited(leader, put(24, ">I", SIZE // 2))),
    "higher": _sentence(_edited(leader, put(28, ">I", 2 * SIZE))),
    "another part": _sentence(_edited(leader, put(32, ">I", 8))),
    "no time": _sentence(_edited(leader, put(12, ">Q", 0))),
    "far time": _sentence(_edited(leader, put(12, ">Q", 1 << 62))),
    "same number": _sentence(_edited(any_packet, put(2, ">H", 7))),
    "numbers jump": _sentence(_edited(any_packet, lambda packet: renumbered(packet, 500))),
    "numbers of a restart": _sentence(_edited(any_packet, from_one())),
    "half the rate": _sentence(_edited(any_packet, every_second())),
    "large packets lost": _sentence(
        _edited(any_packet, lambda one: one if len(one) < 1000 else b"")
    ),
    "every leader lost": _sentence(_edited(leader, lambda _: b"")),
    "every packet cut": _sentence(_edited(payload, lambda one: one[:200])),
    "commands not heard": _sentence(_first(deaf=True)),
    "control taken": _sentence(lambda rig: rig.cameras[0].release()),
    "both unplugged": _sentence(_both(deaf=True, edit=lambda _: b"")),
    "ticks of a microsecond": _sentence(_register(0x0940, 1_000_000), opens=False),
    "no ticks": _sentence(_register(0x0940, 0), opens=False),
    "no description": _sentence(_register(0x0200, 0), opens=False),
    "description cut": _sentence(_blanked, opens=False),
    "long exposure": _sentence(_exposed(50_000.0, both=True), opens=False),
    "other exposure": _sentence(_exposed(200.0), opens=False),
    "PTP uncalibrated": _sentence(_nothing, CONFIG, replace(SECOND, ptp="Uncalibrated"),
                                  opens=False),
    "PTP far off": _sentence(_nothing, CONFIG, replace(SECOND, ptp_offset_ns=-50_000), opens=False),
    "other numbers of rows": _sentence(_nothing, CONFIG, replace(SECOND, height=128), opens=False),
    "leaders lost": _packets("edit", some(0.1, leader)),
    "trailers lost": _packets("edit", some(0.1, lambda one: one[4] == 2)),
    "cut packets": _packets("edit", some(0.02, payload, lambda one: one[:100])),
    "headers only": _packets("edit", some(0.02, payload, lambda one: one[:8])),
    "foreign packets": _packets("edit", some(0.02, payload, lambda one: renumbered(one, 9000))),
    "unknown kinds": _packets("edit", some(0.02, payload, lambda one: one[:4] + b"\7" + one[5:])),
    "PTP lost": _sentence(_ptp(ptp="Uncalibrated")),
    "PTP offset": _sentence(_ptp(ptp_offset_ns=5_000)),
    "other master": _sentence(_ptp(grandmaster=7)),
    "two masters": _sentence(_nothing, replace(CONFIG, ptp="Master"),
                             replace(SECOND, ptp="Master"), opens=False),
    "no PTP": _sentence(_nothing, CONFIG, replace(SECOND, ptp=""), opens=False),
    "late exposures": _sentence(_first(clock_step_ns=2_000_000), opens=False),
    "absent": _sentence(lambda rig: rig.cameras.pop().close(), opens=False),
    "other size": _sentence(_nothing, CONFIG, replace(SECOND, width=128), opens=False),
    "gamma stays": _sentence(
        _nothing, CONFIG, replace(SECOND, keeps_gamma=True), opens=False
    ),
    "slow link": _sentence(_nothing, CONFIG, replace(SECOND, link_hz=80.0), opens=False),
    "colour": _sentence(_nothing, CONFIG, replace(SECOND, formats=("RGB8",)), opens=False),
    "other model": _sentence(_nothing, CONFIG, replace(SECOND, model="Other"), opens=False),
}  # fmt: skip
IN_USE = {
    "unplugged": "genicam.silent", "both unplugged": "genicam.silent",
    "nothing complete": "genicam.silent", "clock step": "genicam.clock_step",
    "clock step back": "genicam.clock_step", "small clock step": "genicam.apart",
    "old time": "genicam.clock_step", "far time": "genicam.clock_step",
    "no time": "genicam.no_time", "wrong format": "genicam.image",
    "half as wide": "genicam.image", "higher": "genicam.image",
    "another part": "genicam.image", "same number": "genicam.silent",
    "numbers jump": "genicam.clock_step", "numbers of a restart": "genicam.clock_step",
    "half the rate": "genicam.clock_step", "large packets lost": "genicam.silent",
    "every leader lost": "genicam.silent", "every packet cut": "genicam.silent",
    "commands not heard": "genicam.silent", "control taken": "genicam.camera",
    "PTP lost": "genicam.ptp", "PTP offset": "genicam.ptp",
    "other master": "genicam.grandmasters",
}  # fmt: skip
"""Faults of cameras in use, and the sentence of each."""
AT_START = {
    "controlled": "genicam.controlled", "two masters": "genicam.grandmasters",
    "no PTP": "genicam.no_ptp", "late exposures": "genicam.apart", "absent": "genicam.absent",
    "other size": "genicam.size", "other numbers of rows": "genicam.size",
    "colour": "genicam.format", "gamma stays": "genicam.setting", "slow link": "genicam.link",
    "other model": "genicam.unlike", "other exposure": "genicam.unlike",
    "long exposure": "genicam.rate", "no ticks": "genicam.ticks",
    "ticks of a microsecond": "genicam.ticks", "no description": "genicam.camera",
    "description cut": "genicam.camera", "PTP uncalibrated": "genicam.ptp",
    "PTP far off": "genicam.ptp",
}  # fmt: skip
"""Cameras that cannot measure, and the sentence of each."""
OF_PACKETS = (
    "lost", "swapped", "doubled", "damaged", "resend refused", "leaders lost", "trailers lost",
    "cut packets", "headers only", "foreign packets", "unknown kinds",
)  # fmt: skip
"""Faults that end without help."""

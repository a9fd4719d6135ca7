"""The program that reads GenICam cameras: a library of others cannot end the station with it.

It reads its configuration as one line of JSON from standard input, fills a ring, and ends on
request in the ring, on SIGTERM, or at the end of standard input.
"""

from __future__ import annotations

import sys

import msgspec

from ocmm_core.acquisition.bus_process import ProcessConfig, read_first_line, stopped_by_parent
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing, SourceDescription
from ocmm_core.camera import USUAL_SLOTS
from ocmm_core.failure import REOPEN, exit_with
from ocmm_genicam._aravis import FRAME_KEPT_US, AravisCameras
from ocmm_genicam._set_up import Expected
from ocmm_genicam._source import GenicamSource
from ocmm_genicam._timing import SKEW_BOUND_NS

_STRETCHED_US = 2_000_000


class GenicamConfig(ProcessConfig, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Cameras of a rig and the ring that their frames go to."""

    name: str
    ring_path: str
    serials: tuple[str, ...]
    cameras: tuple[tuple[str, int, int], ...]
    """Name in the rig, width and height, px, of each camera."""
    rig_serials: tuple[int, ...]
    period_ns: int
    stretched: bool = False
    """Virtual cameras, whose time waits for this computer."""
    silence_s: float = 1.5
    button_line: int = -1
    """Input line of the first camera that the button of the probe is wired to; negative: none."""
    untimed: bool = False
    """Accept cameras without proof of a common clock and common exposures."""
    n_slots: int = USUAL_SLOTS
    """Spots of each camera."""


def genicam_command() -> list[str]:
    """Return the command of this program."""
    return [sys.executable, "-m", "ocmm_genicam._process"]


def genicam_description(config: GenicamConfig) -> SourceDescription:
    return SourceDescription(
        name=config.name,
        camera_serials=config.rig_serials,
        frame_period_ns=config.period_ns,
        cycle_period_ns=config.period_ns,
        live=True,
        simulated=config.stretched,
        stretched=config.stretched,
        skew_ns=0 if config.untimed else SKEW_BOUND_NS,
        untimed=config.untimed,
        n_slots=config.n_slots,
    )


def main() -> None:
    """Run the program."""
    try:
        sys.exit(_run())
    except Exception as error:
        exit_with(error, "The camera process", REOPEN)


def _run() -> int:
    line = read_first_line(sys.stdin.fileno())
    config = msgspec.json.decode(line, type=GenicamConfig)
    ring = FrameRing.attach(config.ring_path)
    try:
        stop = stopped_by_parent()
        lines = [config.button_line, *[-1] * (len(config.cameras) - 1)]
        expected = [
            Expected(*one, config.period_ns, line, config.n_slots)
            for one, line in zip(config.cameras, lines, strict=True)
        ]
        source = GenicamSource(
            genicam_description(config),
            AravisCameras(_STRETCHED_US if config.stretched else FRAME_KEPT_US),
            config.serials, expected, config.silence_s, untimed=config.untimed,
        )  # fmt: skip
        return AcquisitionWorker(source, ring, stop).run_program()
    finally:
        ring.close()


if __name__ == "__main__":
    main()

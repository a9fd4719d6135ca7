"""Programs that read GenICam cameras: a library of others cannot end the station with them.

The one of a station reads its configuration as one line of JSON from standard input, fills a ring,
and ends on request in the ring, on SIGTERM, or at the end of standard input.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Sequence
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.acquisition.bus_process import ProcessConfig, read_first_line, stopped_by_parent
from ocmm_core.acquisition.frames import AcquisitionWorker, FrameRing, SourceDescription
from ocmm_core.errors import AcquisitionError, OcmmError
from ocmm_core.failure import REOPEN, contained, exit_with
from ocmm_core.processes import end_process, end_with_parent, process_context
from ocmm_genicam._aravis import FRAME_KEPT_US
from ocmm_genicam._harvesters import camera_library
from ocmm_genicam._set_up import Expected
from ocmm_genicam._source import GenicamSource
from ocmm_genicam._timing import SKEW_BOUND_NS
from ocmm_genicam._viewfinder import CameraLook, Viewfinder

_STRETCHED_US = 2_000_000
_ANSWER_S = 30.0


class GenicamConfig(ProcessConfig, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Cameras of a rig and the ring that their frames go to."""

    name: str
    ring_path: str
    serials: tuple[str, ...]
    cameras: tuple[Expected, ...]
    rig_serials: tuple[int, ...]
    stretched: bool = False
    """Virtual cameras, whose time waits for this computer."""
    silence_s: float = 1.5
    untimed: bool = False
    """Accept cameras without proof of a common clock and common exposures."""
    gentl: bool = False
    """Read by GenTL producers."""


def genicam_command() -> list[str]:
    """Return the command of this program."""
    return [sys.executable, "-m", "ocmm_genicam._process"]


def genicam_description(config: GenicamConfig) -> SourceDescription:
    return SourceDescription(
        name=config.name,
        camera_serials=config.rig_serials,
        frame_period_ns=config.cameras[0].period_ns,
        cycle_period_ns=config.cameras[0].period_ns,
        live=True,
        simulated=config.stretched,
        stretched=config.stretched,
        skew_ns=0 if config.untimed else SKEW_BOUND_NS,
        untimed=config.untimed,
        n_slots=config.cameras[0].n_slots,
    )


class ViewfinderProcess:
    """A `Viewfinder` in a separate process, with the same methods and errors.

    AcquisitionError also if the process ended, or gave no answer for half a minute.
    """

    def __init__(
        self, serials: Sequence[str], expected: Sequence[Expected], gentl: bool = False
    ) -> None:
        context = process_context()
        self._pipe, theirs = context.Pipe()
        self._process: BaseProcess | None = context.Process(
            target=_serve, args=(theirs, gentl, tuple(serials), tuple(expected)),
            name="ocmm-viewfinder", daemon=True,
        )  # fmt: skip
        self._process.start()
        theirs.close()
        try:
            self._answer()
        except BaseException:
            self.close()
            raise

    def look(self) -> tuple[CameraLook, ...]:
        found: tuple[CameraLook, ...] = self._ask("look")
        return found

    def pictures(self) -> list[NDArray[np.uint16]]:
        found: list[NDArray[np.uint16]] = self._ask("pictures")
        return found

    def expose(self, exposure_us: float) -> None:
        self._ask("expose", exposure_us)

    def gain(self, value: float) -> None:
        self._ask("gain", value)

    def settle(self) -> tuple[CameraLook, ...]:
        found: tuple[CameraLook, ...] = self._ask("settle")
        return found

    def black(self, folder: Path) -> tuple[int, ...]:
        found: tuple[int, ...] = self._ask("black", folder)
        return found

    def store(self) -> None:
        self._ask("store")

    def close(self) -> None:
        """Release the cameras within two seconds; idempotent."""
        if self._process is not None:
            with contextlib.suppress(OSError):
                self._pipe.send(None)
            end_process(self._process)
            self._pipe.close()
            self._process = None

    def _ask(self, name: str, *values: object) -> Any:
        with contextlib.suppress(OSError):
            self._pipe.send((name, values))
        return self._answer()

    def _answer(self) -> Any:
        try:
            found = self._pipe.recv() if self._pipe.poll(_ANSWER_S) else None
        except (EOFError, OSError):
            found = None
        if found is None:
            raise AcquisitionError(
                "genicam.viewfinder",
                "The program that reads the cameras has ended or does not answer.",
                "Check network and cameras, wait some seconds, then open the cameras again.",
            )
        if isinstance(found, OcmmError):
            raise found
        return found[0]


def _serve(pipe: Connection, gentl: bool, *asked: Any) -> None:
    end_with_parent()
    try:
        finder = Viewfinder(camera_library(gentl), *asked)
    except Exception as error:
        pipe.send(contained(error, "The viewfinder"))
        return
    pipe.send((None,))
    with contextlib.closing(finder), contextlib.suppress(EOFError, OSError):
        while (asked := pipe.recv()) is not None:
            name, values = asked
            try:
                pipe.send((getattr(finder, name)(*values),))
            except Exception as error:
                pipe.send(contained(error, "The viewfinder"))


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
        source = GenicamSource(
            genicam_description(config),
            camera_library(config.gentl, _STRETCHED_US if config.stretched else FRAME_KEPT_US),
            config.serials, config.cameras, config.silence_s, untimed=config.untimed,
        )  # fmt: skip
        return AcquisitionWorker(source, ring, stop).run_program()
    finally:
        ring.close()


if __name__ == "__main__":
    main()

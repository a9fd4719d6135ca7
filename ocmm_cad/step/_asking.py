"""The process that reads a STEP file; its messages are not trusted."""

from __future__ import annotations

import signal
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec

from ocmm_cad.step._model_files import ModelFiles, model_files, step_error
from ocmm_cad.step._profiled import StepAnswer
from ocmm_cad.step._worker import Wanted, read_step
from ocmm_cad.step.brep import LESS
from ocmm_core.blas import use_one_thread
from ocmm_core.documents import decode_json
from ocmm_core.errors import InputError, InternalError, OcmmError
from ocmm_core.host import HOST
from ocmm_core.part_model import LARGEST_MODEL, PartModel, model_from_bytes
from ocmm_core.plugins import install_line
from ocmm_core.processes import process_context

"""How the extra is installed, by its lock file and with hashes."""
STEP_SIZE_MB = 400
_LOOK_S = 0.05
_STILL_S = 1.0
_WAITED = 10.0
"""Multiple of the CPU limit that is waited for in wall time."""
_LONGEST_ANSWER = 100_000_000
READER_MODULES = (
    "ocmm_cad.step._worker",
    "OCP.STEPCAFControl", "OCP.XCAFDoc", "OCP.TDocStd", "OCP.BRepMesh", "OCP.BRepAdaptor",
    "OCP.StepShape", "OCP.GeomConvert", "OCP.GCPnts", "OCP.DE", "OCP.BRepLib", "OCP.collections",
)  # fmt: skip
"""Modules of a reader, for preloading; see `process_context`."""
REMEDY = "Export the model as STEP (AP203, AP214 or AP242) again, with exact surfaces (no mesh)."


@dataclass(frozen=True, slots=True)
class Asking:
    """Limit of work, s of CPU time; see `read_model`."""

    timeout_s: float
    given_up: Callable[[], bool]
    progress: Callable[[str], None]


def has_step() -> bool:
    return find_spec("OCP") is not None


def request_answer(
    path: Path, wanted: Wanted, with_part: bool, asking: Asking
) -> tuple[StepAnswer, PartModel | None]:
    """Return the contents of a STEP file, and optionally its part; errors of `read_model`."""
    files = model_files(path)
    wanted = replace(
        wanted, limit_s=asking.timeout_s, parts=tuple(sorted(files.parts)),
        source_name=_printable(path.name), tolerances_in_parts=files.have_tolerances,
        papers=tuple(map(_printable, files.papers)),
    )  # fmt: skip
    if with_part:
        wanted = replace(wanted, source_sha256=files.sha256)
    if not files.parts and _printable(str(path)) == str(path):
        return _asked(path, path, wanted, files, asking)
    # Part files are read as a copy, so that no name leads to another file; the library takes names
    # in UTF-8 only.
    with tempfile.TemporaryDirectory(prefix="ocmm-step-") as folder:
        return _asked(path, files.copied(Path(folder)), wanted, files, asking)


def _asked(
    path: Path, copy: Path, wanted: Wanted, files: ModelFiles, asking: Asking
) -> tuple[StepAnswer, PartModel | None]:
    use_one_thread()
    context = process_context()
    answer, asked = context.Pipe(duplex=False)
    worker = context.Process(target=read_step, args=(str(copy), wanted, asked), daemon=True)
    worker.start()
    asked.close()
    reading = _Reading(path, answer, asking, worker.pid)
    said = refusal = None
    try:
        said = reading.last()
        part = reading.part(said) if said is not None and wanted.source_sha256 else None
    except OcmmError as error:
        refusal = error
    except (EOFError, OSError):
        # It has ended, or is about to: the exit status has details.
        said = None
        worker.join(1.0)
    finally:
        worker.terminate()
        worker.join()
        ended = worker.exitcode
        worker.close()
        answer.close()
    if not files.is_unchanged():
        # The hash and the contents, or half of them, would be of different files.
        raise step_error(path, "the file was changed while it was read", "Import it again.")
    if refusal is not None:
        raise refusal
    if said is None:
        raise reading.failed(ended)
    return said, part


class _Reading:
    """Messages of a reader, up to the last one."""

    def __init__(self, path: Path, answer: Connection, asking: Asking, pid: int | None) -> None:
        self._path, self._answer, self._asking, self._pid = path, answer, asking, pid
        self._begun = time.monotonic()
        self._doing = "the start of the library"

    def last(self) -> StepAnswer | None:
        """Return the last answer; None if it is malformed."""
        while True:
            self._wait()
            try:
                said = decode_json(self._answer.recv_bytes(_LONGEST_ANSWER), StepAnswer)
            except msgspec.MsgspecError:
                return None
            if not said.doing:
                return _checked(self._path, said)
            self._doing = said.doing
            self._asking.progress(said.doing)

    def part(self, said: StepAnswer) -> PartModel:
        self._doing = "the part"
        if not 0 < said.part_bytes <= LARGEST_MODEL:
            raise step_error(self._path, "the reader of STEP files made no part of it", REMEDY)
        self._wait()
        return model_from_bytes(self._answer.recv_bytes(LARGEST_MODEL), str(self._path))

    def _wait(self) -> None:
        """Wait for a message; InputError on timeout or cancellation."""
        begun = told = time.monotonic()
        while True:
            # A reader that keeps sending is limited as well.
            if self._asking.given_up():
                raise given_up_error(self._path)
            if self._answer.poll(_LOOK_S):
                return
            if (now := time.monotonic()) - told >= _STILL_S:
                # The library sends nothing while it reads, and a mesh is one call of it.
                told = now
                self._asking.progress(f"{self._doing} ({now - begun:.0f} s)")
            if self._is_too_long():
                limit = self._asking.timeout_s
                what = f"reading took longer than {limit:.0f} s (at {self._doing})"
                raise step_error(self._path, what, LESS)

    def _is_too_long(self) -> bool:
        """Return whether CPU time, independent of other programs, is exceeded; later if idle."""
        limit, took = self._asking.timeout_s, time.monotonic() - self._begun
        if took <= limit:
            return False
        worked = None if self._pid is None else HOST.processor_seconds(self._pid)
        return worked is None or worked > limit or took > _WAITED * limit

    def failed(self, ended: int | None) -> InputError:
        """Return the error of a reader that ended without an answer."""
        how = ""
        if ended is not None and ended < 0:
            how = f" ({signal.Signals(-ended).name})"
        what = f"the reader of STEP files failed on it{how}, while it read {self._doing}"
        return step_error(self._path, what, REMEDY)


def _checked(path: Path, said: StepAnswer) -> StepAnswer:
    if said.error is not None:
        raise InternalError(*said.error)
    if said.fault == "MISSING":
        raise InputError(
            "plan.step_extra",
            "Reading STEP files needs an extra that is not installed.",
            f"Install it: {install_line('step')}, some {STEP_SIZE_MB} MB on the disk. Or import "
            "the features from CSV.",
        )
    if said.fault:
        raise step_error(path, said.fault, said.remedy or REMEDY)
    return said


def given_up_error(path: Path | str) -> InputError:
    return InputError("plan.step_given_up", f"{path}: import cancelled.", "Import it again.")


def _printable(name: str) -> str:
    """Return a file name as text: bytes that are no UTF-8 become question marks."""
    return name.encode("utf-8", errors="replace").decode("utf-8")

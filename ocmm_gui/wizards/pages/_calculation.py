"""Calculations of a wizard in a separate process, not to freeze the window.

The process resumes the session from its file, calculates, and returns the result. A dense solution
holds the GIL for more than a second; in a thread it would block the window.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from multiprocessing.connection import Connection

from ocmm_core.calibration.guided import Procedure
from ocmm_core.errors import CalibrationError, OcmmError
from ocmm_core.failure import contained
from ocmm_core.processes import process_context

_LOOK_S = 0.05
_END_S = 1.0


class ProcessCalculation:
    """Repeatable calculation of a procedure; module-level ``resume`` remakes it elsewhere."""

    def __init__(self, procedure: Procedure, resume: Callable[[], Procedure]) -> None:
        self._procedure = procedure
        self._resume = resume
        self._given_up = threading.Event()

    def run(self) -> None:
        """Calculate; raise OcmmError on failure or cancellation."""
        self._given_up.clear()
        self._procedure.compute(self._elsewhere)

    def cancel(self) -> None:
        """Make `run` end early; thread-safe."""
        self._given_up.set()

    def _elsewhere(self) -> object:
        context = process_context()
        receiver, sender = context.Pipe(duplex=False)
        process = context.Process(
            target=_calculate, args=(self._resume, sender), name="ocmm-calculation", daemon=True
        )
        process.start()
        sender.close()
        try:
            while not receiver.poll(_LOOK_S):
                if self._given_up.is_set():
                    raise CalibrationError(
                        "calculation.given_up",
                        "Calculation cancelled.",
                        "Recalculate when you are ready.",
                    )
            answer: object = receiver.recv()
        except EOFError as error:
            raise CalibrationError(
                "calculation.died",
                "The calculation ended unexpectedly; the computer may be out of memory.",
                "Close other programs and recalculate.",
            ) from error
        finally:
            process.terminate()
            process.join(_END_S)
            if process.is_alive():
                process.kill()
                process.join()
            process.close()
            receiver.close()
        if isinstance(answer, OcmmError):
            raise answer
        return answer


def _calculate(resume: Callable[[], Procedure], sender: Connection) -> None:
    answer: object
    try:
        procedure = resume()
        procedure.compute()
        outcome = procedure.view.outcome
        if outcome is None:
            raise CalibrationError(
                "calculation.nothing", "The calculation gave no result.", "Recalculate."
            )
        answer = outcome
    except Exception as error:
        answer = contained(error, "The calculation")
    sender.send(answer)
    sender.close()

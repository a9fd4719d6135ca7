"""The reading of a STEP file, in a process of its own.

The geometry kernel is C++ that is given whatever somebody saved: if it ends the process, or never
comes back, the program that asked goes on, and knows what was being read.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from multiprocessing.connection import Connection

import msgspec

from ocmm_core.errors import InputError
from ocmm_core.failure import contained
from ocmm_core.host import HOST
from ocmm_core.inspection.reach import Reach, make_obstacle
from ocmm_core.inspection.step._answer import StepAnswer
from ocmm_core.inspection.step._joined import bore_axes, surfaces_of
from ocmm_core.inspection.step._raw_faces import UnusableModelError, as_numbers, read_faces
from ocmm_core.inspection.step._request import StepRequest, setting_of

_MOST_BYTES = 1_500_000_000


def read_step(path: str, asked: bytes, to: Connection) -> None:
    """Send what is being done, and at last the surfaces or a sentence that says why there are none.

    Parameters
    ----------
    asked
        A `StepRequest` as JSON: with what the surfaces are to be touched.
    """
    _be_silent()
    HOST.limit_memory(_MOST_BYTES)

    def tell(answer: StepAnswer) -> None:
        to.send_bytes(msgspec.json.encode(answer, enc_hook=as_numbers))

    doing = "the start of the library"

    def now(what: str) -> None:
        nonlocal doing
        doing = what
        tell(StepAnswer(doing=what))

    try:
        answer = _read(path, msgspec.json.decode(asked, type=StepRequest), now)
    except ImportError:
        answer = StepAnswer(fault="MISSING")
    except InputError as error:
        answer = StepAnswer(fault=error.what, remedy=error.remedy)
    except UnusableModelError as error:
        answer = StepAnswer(fault=error.what, remedy=error.remedy)
    except ValueError as error:
        answer = StepAnswer(fault=str(error))
    except MemoryError:
        answer = StepAnswer(
            fault=f"reading it takes more than {_MOST_BYTES / 1e9:.1f} GB of memory (at {doing})"
        )
    except Exception as error:
        told = contained(error, f"Reading the STEP file (at {doing})")
        answer = StepAnswer(error=(told.code, told.what, told.remedy))
    try:
        tell(answer)
    finally:
        to.close()


def _read(path: str, asked: StepRequest, doing: Callable[[str], None]) -> StepAnswer:
    model = read_faces(path, doing)
    doing("placing targets")
    radius = 0.5 * asked.ball_mm
    reach = None
    if len(model.triangles):
        part = make_obstacle(model.triangles, model.owners, model.n_faces, model.deflection_mm)
        reach = Reach(part, radius, setting_of(asked), bore_axes(model.faces))
    surfaces = surfaces_of(model.faces, radius, reach, doing)
    return StepAnswer(surfaces=tuple(surfaces), others=model.others)


def _be_silent() -> None:
    """Keep what the geometry kernel prints out of the terminal of the program that asked."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    for descriptor in (1, 2):
        os.dup2(nothing, descriptor)
    os.close(nothing)

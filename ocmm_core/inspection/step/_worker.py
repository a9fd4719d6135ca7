"""The reading of a STEP file, in a process of its own.

The geometry kernel is C++ that is given whatever somebody saved: if it ends the process, or never
comes back, the program that asked goes on, and knows what was being read.
"""

from __future__ import annotations

import os
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import msgspec

from ocmm_core.failure import contained
from ocmm_core.host import HOST
from ocmm_core.inspection.pmi import read_pmi
from ocmm_core.inspection.step._answer import StepAnswer
from ocmm_core.inspection.step._face_order import order_fault
from ocmm_core.inspection.step._joined import surfaces_of
from ocmm_core.inspection.step._raw_faces import UnusableModelError, as_numbers, read_faces

_MOST_BYTES = 1_500_000_000


def read_step(path: str, ball_radius: float, to: Connection) -> None:
    """Send what is being done, and at last the surfaces or a sentence that says why there are none.

    Parameters
    ----------
    ball_radius
        mm: of the ball that is to touch them.
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
        answer = _read(path, ball_radius, now)
    except ImportError:
        answer = StepAnswer(fault="MISSING")
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


def _read(path: str, ball_radius: float, doing: Any) -> StepAnswer:
    faces, others = read_faces(path, doing)
    doing("the tolerances of the model")
    pmi, texts = read_pmi(Path(path).read_text(encoding="utf-8", errors="replace"))
    fault = order_fault(faces, texts)
    if fault:
        pmi = msgspec.structs.replace(pmi, fault=pmi.fault or fault)
        texts = ()
    doing("placing targets")
    numbers = [text.number for text in texts]
    return StepAnswer(
        surfaces=tuple(surfaces_of(faces, ball_radius, numbers)), others=others, pmi=pmi,
        face_words={text.number: text.shape for text in texts},
    )  # fmt: skip


def _be_silent() -> None:
    """Keep what the geometry kernel prints out of the terminal of the program that asked."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    for descriptor in (1, 2):
        os.dup2(nothing, descriptor)
    os.close(nothing)

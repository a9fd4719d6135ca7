"""Features of a plan from the surfaces of a STEP file; needs the extra ``step``."""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.documents import decode_json, read_bytes
from ocmm_core.errors import InputError, InternalError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.plan._edit import usual_points
from ocmm_core.inspection.plan._step_worker import StepAnswer, StepFace, read_step

TIMEOUT_S = 120.0
MOST_FEATURES = 1000
_LOOK_S = 0.05
_DECIMALS = 6
_LONGEST_ANSWER = 100_000_000
_REMEDY = "Export the model as STEP (AP203, AP214 or AP242) again, with exact surfaces (no mesh)."


def features_from_step(
    path: Path | str,
    timeout_s: float = TIMEOUT_S,
    given_up: Callable[[], bool] = lambda: False,
) -> tuple[NominalFeature, ...]:
    """Return the planes, cylinders, cones, spheres and tori of a model, in its own frame.

    Faces of one round surface come together; fillets are left out. The file is read in a process
    of its own, which may fail or be stopped without harm.

    Parameters
    ----------
    timeout_s
        After so long the reading is given up.
    given_up
        Asked some twenty times a second; the reading ends within a moment then.

    Raises
    ------
    InputError
        The extra is not installed, the file is no STEP file that can be read, it has no such
        surfaces, or reading takes too long or was given up.
    """
    path = Path(path)
    if not read_bytes(path).lstrip().startswith(b"ISO-10303-21"):
        raise _error(path, "not a STEP file", "Choose a file ending in .step or .stp.")
    context = multiprocessing.get_context("spawn")
    answer, asked = context.Pipe(duplex=False)
    worker = context.Process(target=read_step, args=(str(path), asked), daemon=True)
    worker.start()
    asked.close()
    content = b""
    try:
        until = time.monotonic() + timeout_s
        while not (ready := answer.poll(_LOOK_S)) and time.monotonic() < until and not given_up():
            pass
        if not ready and given_up():
            raise InputError("plan.step_given_up", f"{path}: import cancelled.", "Import it again.")
        if not ready:
            raise _error(path, f"reading took longer than {timeout_s:.0f} s", _REMEDY)
        content = answer.recv_bytes(_LONGEST_ANSWER)
    except (EOFError, OSError):
        # It has ended, or is about to: how says more.
        worker.join(1.0)
    finally:
        worker.terminate()
        worker.join()
        ended = worker.exitcode
        worker.close()
        answer.close()
    found = _faces(path, content, ended)
    if not 0 < len(found) <= MOST_FEATURES:
        raise _error(
            path,
            f"it has {len(found)} planes, cylinders, cones, spheres and tori",
            f"Give a model with 1 to {MOST_FEATURES} of them.",
        )
    counts: Counter[str] = Counter()
    features = []
    for face in found:
        counts[face.shape] += 1
        features.append(_feature(face, f"{face.shape.upper()}_{counts[face.shape]}"))
    return tuple(features)


def _faces(path: Path, content: bytes, ended: int | None) -> tuple[StepFace, ...]:
    """Return the surfaces that the reading sent, or raise what it said, also by its end."""
    try:
        said = decode_json(content, StepAnswer)
    except msgspec.MsgspecError as error:
        how = ""
        if ended is not None and ended < 0:
            how = f" ({signal.Signals(-ended).name})"
        raise _error(path, f"the reader of STEP files failed on it{how}", _REMEDY) from error
    if said.error is not None:
        raise InternalError(*said.error)
    if said.fault == "MISSING":
        raise InputError(
            "plan.step_extra",
            "Reading STEP files needs an extra that is not installed.",
            "Install it with: .venv/bin/pip install --require-hashes -r requirements-step.lock; "
            "or import the features from CSV.",
        )
    if said.fault:
        raise _error(path, said.fault, _REMEDY)
    return said.faces


def _feature(face: StepFace, name: str) -> NominalFeature:
    shape = Shape(face.shape)
    middle = np.array(face.point)
    if shape is Shape.CYLINDER:
        middle = middle + 0.5 * (face.low + face.high) * np.array(face.direction)
    width = 2.0 * face.second if shape.spec.has_size("width") else face.width
    return NominalFeature(
        name=name,
        shape=shape,
        points=usual_points(shape),
        point=_rounded(middle),
        direction=_rounded(np.array(face.direction)),
        across=_rounded(np.array(face.across)),
        diameter=round(2.0 * float(face.radius), _DECIMALS),
        length=round(float(face.high - face.low), _DECIMALS),
        width=round(float(width), _DECIMALS),
        angle_deg=round(2.0 * float(np.degrees(face.half_angle)), _DECIMALS),
        side="inner" if face.inner else "outer",
    )


def _rounded(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> tuple[float, float, float]:
    x, y, z = (round(float(value), _DECIMALS) + 0.0 for value in values)
    return (x, y, z)


def _error(path: Path, what: str, remedy: str) -> InputError:
    return InputError("plan.step", f"{path}: {what}.", remedy)

"""Features of a plan from the surfaces of a STEP file, by a process that may fail without harm."""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.documents import decode_json, read_bytes
from ocmm_core.errors import InputError, InternalError
from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.inspection.step._answer import StepAnswer, StepFace, StepSurface, Triple
from ocmm_core.inspection.step._request import StepRequest, setting_of
from ocmm_core.inspection.step._worker import read_step

STEP_ENDINGS = (".step", ".stp", ".p21")
USUAL_BALL_MM = 6.0
"""Diameter of the ball of the standard probe."""
TIMEOUT_S = 120.0
MOST_FEATURES = 1000
_LOOK_S = 0.05
_DECIMALS = 6
_LONGEST_ANSWER = 100_000_000
_REMEDY = "Export the model as STEP (AP203, AP214 or AP242) again, with exact surfaces (no mesh)."


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A surface that is no feature to begin with.

    Attributes
    ----------
    feature
        What it would be; without targets.
    why
        Part of a sentence.
    faces
        Numbers of its faces, from 1 in the order of the file.
    """

    feature: NominalFeature
    why: str
    faces: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class StepModel:
    """What a model holds.

    Attributes
    ----------
    features
        Surfaces that can be probed, with targets on their faces, in the frame of the model.
    left_out
        Surfaces with a reason against them, such as fillets, engraved text and narrow faces.
    others
        How many faces have another kind of surface, by its word.
    faces
        Numbers of the faces of each of ``features``, from 1 in the order of the file.
    held
        For each of ``features`` how the probe is held at its targets: rotation vectors, rad, frame
        of the model from that of the probe. Empty where nobody asked.
    ways
        For each of ``features`` the straight way along the normal, mm, that is free at a target.
    """

    features: tuple[NominalFeature, ...]
    left_out: tuple[LeftOut, ...]
    others: dict[str, int]
    faces: tuple[tuple[int, ...], ...] = ()
    held: tuple[tuple[Triple, ...], ...] = ()
    ways: tuple[tuple[float, ...], ...] = ()

    def why_not(self) -> list[tuple[str, int]]:
        """Return reasons and how many surfaces have each, the most frequent first."""
        counts = Counter(one.why for one in self.left_out)
        counts.update({f"its surface is of the kind {kind}": n for kind, n in self.others.items()})
        return counts.most_common()


def read_model(
    path: Path | str,
    ball_mm: float = USUAL_BALL_MM,
    timeout_s: float = TIMEOUT_S,
    given_up: Callable[[], bool] = lambda: False,
    *,
    request: StepRequest | None = None,
    told: Callable[[str], None] = lambda _: None,
) -> StepModel:
    """Return the planes, cylinders, cones, spheres and tori of a model, in its own frame.

    Faces of one round surface come together where they touch or lie beside each other about its
    axis; two bores on one axis stay two. The file is read in a process of its own, which may fail
    or be stopped without harm.

    Parameters
    ----------
    ball_mm
        Diameter of the ball, mm: it needs room on a face and in a bore.
    timeout_s
        After so long the reading is given up.
    given_up
        Asked some twenty times a second; the reading ends within a moment then.
    request
        Probe, cameras and placement, by which targets are chosen; its ball goes before ``ball_mm``.
        Without it the ball alone is asked whether it has room.
    told
        Called with what is being read.

    Raises
    ------
    InputError
        The extra is not installed, the file is no STEP file that can be read, it has no such
        surfaces, or reading takes too long or was given up.
    """
    path = Path(path)
    if not read_bytes(path).lstrip().startswith(b"ISO-10303-21"):
        raise _error(path, "not a STEP file", f"Choose a file ending in {', '.join(STEP_ENDINGS)}.")
    wanted = request or StepRequest(ball_mm=ball_mm)
    # What is wrong with its documents is said here and not by another process.
    setting_of(wanted)
    context = multiprocessing.get_context("spawn")
    answer, asked = context.Pipe(duplex=False)
    arguments = (str(path), msgspec.json.encode(wanted), asked)
    worker = context.Process(target=read_step, args=arguments, daemon=True)
    worker.start()
    asked.close()
    reading = _Reading(path, answer, given_up, told, time.monotonic() + timeout_s, timeout_s)
    said = None
    try:
        said = reading.last()
    except (EOFError, OSError):
        # It has ended, or is about to: how says more.
        worker.join(1.0)
    finally:
        worker.terminate()
        worker.join()
        ended = worker.exitcode
        worker.close()
        answer.close()
    if said is None:
        raise reading.failed(ended)
    return _model(path, _checked(path, said))


class _Reading:
    """What a reader tells, until it has told all."""

    def __init__(
        self,
        path: Path,
        answer: Connection,
        given_up: Callable[[], bool],
        told: Callable[[str], None],
        until: float,
        limit: float,
    ) -> None:
        self._path, self._answer, self._given_up = path, answer, given_up
        self._told, self._until, self._limit = told, until, limit
        self._doing = "the start of the library"

    def last(self) -> StepAnswer | None:
        """Return the last answer; None where the reader says what nobody understands."""
        while True:
            while not self._answer.poll(_LOOK_S):
                if self._given_up():
                    raise InputError(
                        "plan.step_given_up", f"{self._path}: import cancelled.", "Import it again."
                    )
                if time.monotonic() > self._until:
                    what = f"reading took longer than {self._limit:.0f} s (at {self._doing})"
                    raise _error(self._path, what, _REMEDY)
            try:
                said = decode_json(self._answer.recv_bytes(_LONGEST_ANSWER), StepAnswer)
            except msgspec.MsgspecError:
                return None
            if not said.doing:
                return said
            self._doing = said.doing
            self._told(said.doing)

    def failed(self, ended: int | None) -> InputError:
        """Return what a reader failed on that ended without an answer."""
        how = ""
        if ended is not None and ended < 0:
            how = f" ({signal.Signals(-ended).name})"
        what = f"the reader of STEP files failed on it{how}, while it read {self._doing}"
        return _error(self._path, what, _REMEDY)


def _checked(path: Path, said: StepAnswer) -> StepAnswer:
    """Return what the reading sent, or raise what it said against the file."""
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
        raise _error(path, said.fault, said.remedy or _REMEDY)
    return said


def _model(path: Path, said: StepAnswer) -> StepModel:
    chosen = [one for one in said.surfaces if not one.against]
    if not 0 < len(chosen) <= MOST_FEATURES:
        raise _error(
            path,
            f"it has {len(chosen)} surfaces that can be probed (planes, cylinders, cones, spheres, "
            f"tori), of {len(said.surfaces) + sum(said.others.values())} in all",
            f"Give a model with 1 to {MOST_FEATURES} of them.",
        )
    counts: Counter[str] = Counter()
    features: list[NominalFeature] = []
    left_out: list[LeftOut] = []
    for surface in (*chosen, *(one for one in said.surfaces if one.against)):
        shape = surface.face.shape
        counts[shape] += 1
        feature = _feature(surface, f"{shape.upper()}_{counts[shape]}")
        if surface.against:
            left_out.append(LeftOut(feature, surface.against, surface.numbers))
        else:
            features.append(feature)
    return StepModel(
        tuple(features),
        tuple(left_out),
        dict(said.others),
        tuple(one.numbers for one in chosen),
        tuple(one.held for one in chosen),
        tuple(one.ways for one in chosen),
    )


def _feature(surface: StepSurface, name: str) -> NominalFeature:
    face = surface.face
    shape = Shape(face.shape)
    middle, radius = _middle(face)
    width = 2.0 * face.second if shape.spec.has_size("width") else face.width
    return NominalFeature(
        name=name,
        shape=shape,
        points=shape.spec.usual_points,
        point=_rounded(middle),
        direction=_rounded(np.array(face.direction)),
        across=_rounded(np.array(face.across)),
        diameter=round(2.0 * radius, _DECIMALS),
        length=round(face.high - face.low, _DECIMALS),
        width=round(width, _DECIMALS),
        angle_deg=round(2.0 * float(np.degrees(face.half_angle)), _DECIMALS),
        side="inner" if face.inner else "outer",
        targets=tuple(_rounded(np.array(target)) for target in surface.targets),
    )


def _middle(face: StepFace) -> tuple[np.ndarray[tuple[int], np.dtype[np.float64]], float]:
    """Return the middle of what is touched, (3,), mm, and the radius there."""
    point, direction = np.array(face.point), np.array(face.direction)
    along = 0.5 * (face.low + face.high)
    if face.shape == "Cylinder":
        return point + along * direction, face.radius
    if face.shape == "Cone":
        return point + along * direction, along * float(np.tan(face.half_angle))
    return point, face.radius


def _rounded(
    values: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> tuple[float, float, float]:
    x, y, z = (round(float(value), _DECIMALS) + 0.0 for value in values)
    return (x, y, z)


def _error(path: Path, what: str, remedy: str) -> InputError:
    return InputError("plan.step", f"{path}: {what}.", remedy)

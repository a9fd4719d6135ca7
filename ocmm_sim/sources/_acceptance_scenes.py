"""Scenes and hand of the virtual rig for the touches an acceptance test still requires."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ocmm_core.acceptance import AcceptanceProcedure, AcceptanceView, UsedArtefact
from ocmm_core.composition import Feed, StationRequest, require_scenes, source_of
from ocmm_core.composition.hands import VirtualHand
from ocmm_core.errors import OcmmError
from ocmm_core.geometry import Float, unit
from ocmm_sim.calibration_scenes import Scene, TouchSeats, TouchSphere, TouchWithTip
from ocmm_sim.sources._calibrate_scenes import VirtualSite

_APART_MM, _TURN_RAD = 1.5, 0.15
_CERTIFICATE = 45
_EXTREMES = np.radians(28.0)


def acceptance_hand(
    request: StationRequest, procedure: AcceptanceProcedure, failed: Callable[[OcmmError], None]
) -> VirtualHand:
    """Return the virtual hand of a test, which makes the touches that are missing."""
    site = VirtualSite(request.rig, request.probe, procedure.session.stage.seed, None)

    def make() -> tuple[Feed, int]:
        view = procedure.view
        away = np.array(view.stage.instrument.away)
        scenes = scenes_of_acceptance(site, view.test, view.stage.artefacts, away)
        return acceptance_feed(site, request.source, scenes, request.speed)

    return VirtualHand(make, procedure, failed)


def acceptance_feed(
    site: VirtualSite, source: str, scenes: tuple[Scene, ...], speed: float
) -> tuple[Feed, int]:
    """Return the virtual rig with scenes and frame count; InputError if unsupported."""
    require_scenes(source)
    make = source_of(source).spec.scenes
    script = site.script(scenes)
    if make is None:
        msg = f"{source!r} is no virtual rig"
        raise ValueError(msg)
    return make(script, speed), script.build().n_frames


def scenes_of_acceptance(
    site: VirtualSite, view: AcceptanceView, artefacts: Sequence[UsedArtefact], away: Float
) -> tuple[Scene, ...]:
    """Return the remaining touches; artefacts deviate within their certificates."""
    scenes: list[Scene] = []
    known = {one.role: one for one in artefacts}
    right = unit(np.cross(away, [0.0, 0.0, 1.0]))
    for number, (position, done) in enumerate(zip(view.positions, view.done, strict=True)):
        points = np.array(position.points_world * position.repeats)
        artefact = known.get(position.role)
        error = 0.0
        if artefact is not None:
            draw = np.random.default_rng([site.seed, _CERTIFICATE]).standard_normal()
            error = 0.5 * artefact.expanded * float(draw)
        seed = site.seed + 7 * number + 1000 * done
        left = points[done:]
        if not len(left):
            continue
        if position.role == "cone":
            leans = [1.0 if (done + one) % 2 else -1.0 for one in range(len(left))]
            handles = [
                np.cos(_EXTREMES) * np.array([0.0, 0.0, 1.0]) + lean * np.sin(_EXTREMES) * right
                for lean in leans
            ]
            scenes.append(_rest(left[0], handles, seed))
        elif position.handle is not None:
            scenes += [
                _rest(point, [np.array(position.handle)], seed + one)
                for one, point in enumerate(left)
            ]
        elif position.normals and artefact is not None:
            normals = np.array(position.normals * position.repeats)
            reach = float(np.linalg.norm(points[0] - points[1]))
            reach /= float(np.linalg.norm(normals[0] - normals[1]))
            centre = points[0] - reach * normals[0]
            scenes.append(
                TouchSphere(
                    centre=_vector(centre),
                    diameter=artefact.sizes[0] + error,
                    normals=tuple(_vector(one) for one in normals[done:]),
                    seed=seed,
                )
            )
        else:
            first = points[0]
            scale = 1.0
            if position.role == "bar" and artefact is not None:
                scale += error / (artefact.sizes[-1] - artefact.sizes[0])
            if position.role == "gauge block":
                # The second face is offset from its certified distance.
                half = len(position.points_world) // 2
                wide = points[half] - points[0]
                later = (np.arange(len(points)) // half % 2)[:, None]
                left = (points + error * later * wide / np.linalg.norm(wide))[done:]
                first = left[0]
            scenes.append(
                TouchSeats(
                    tips=tuple(_vector(first + scale * (one - first)) for one in left), seed=seed
                )
            )
    return tuple(scenes)


def _rest(point: Float, handles: Sequence[Float], seed: int) -> TouchWithTip:
    return TouchWithTip(
        centre=(0.0, 0.0, 0.0), diameter=10.0, normals=(), cone=_vector(point),
        handles=tuple(_vector(one) for one in handles), seed=seed,
    )  # fmt: skip


def _vector(values: Float) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z

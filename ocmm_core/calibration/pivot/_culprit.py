"""Which one lied in a sweep: a camera that was nudged, the cone, an LED, or the cameras' record.

The sweep is laid into the bundle of a relocation: one seat in which the ball rests, LEDs and tip
unknown, cameras as uncertain as their calibration says. All is of first order: cameras that are
wrong by less than their uncertainty bend it by less than a spot.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ocmm_core.calibration.bundle import (
    BundleData,
    BundleState,
    CulpritVerdict,
    Names,
    Prior,
    accuse,
    examine,
)
from ocmm_core.calibration.pivot._data import PivotSweep
from ocmm_core.calibration.records import Finding
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float, Int, Points3

LEAST_SLACK_MM = 5e-4
"""No ball rests better in its cone."""

_LEAST_VARIANCE = 1e-10
"""Of the scaled covariance of the cameras; what is known better than this is known exactly."""


def accuse_in_sweep(
    rig: Rig, sweep: PivotSweep, frames: Int, leds: Points3, tip: Float, centre: Float,
    rotations: Float, slack_mm: float, dof: int,
) -> Finding | None:  # fmt: skip
    """Return who lied in the frames of a sweep that agree; None where nobody did.

    Parameters
    ----------
    sweep, frames
        The frames that took part, and their numbers (n,) in the whole sweep.
    leds, tip, centre, rotations
        The result: (L, 3) and (3,), mm, probe; (3,), mm, and (n, 3, 3), world.
    slack_mm
        Of the ball in its cone.
    dof
        Degrees of freedom of the adjustment.
    """
    n = len(rotations)
    data = BundleData(
        uv=np.ascontiguousarray(sweep.uv),
        weights=np.ascontiguousarray(sweep.weights),
        seats=np.zeros(n, dtype=np.int64),
        waved=0,
        seat_sigma=max(slack_mm, LEAST_SLACK_MM),
        bar_uv=np.zeros((0, len(rig.cameras), 2, 2)),
        bar_weights=np.zeros((0, len(rig.cameras), 2)),
        bars=np.zeros(0, dtype=np.int64),
        touched=np.zeros((0, 3), dtype=np.int64),
        touched_sigma=1.0,
    )
    state = BundleState(
        cameras=rig.cameras, leds=leds, tip=tip, seats=centre[None], lengths=np.zeros(0),
        rotations=rotations, origins=centre - rotations @ tip,
        bar_rotations=np.zeros((0, 3, 3)), bar_origins=np.zeros((0, 3)),
    )  # fmt: skip
    verdict = examine(data, _prior(rig, state), state, dof, exactly=False)
    if verdict is None:
        return None
    names = Names(
        cameras=tuple(camera.name for camera in rig.cameras),
        bars=(),
        procedure="the sweep",
        moment=lambda index: _moment(verdict, frames, index),
    )
    return accuse(verdict, names)


def _moment(verdict: CulpritVerdict, frames: Int, index: int) -> str:
    return f"frame {int(frames[verdict.history.blocks[index].frames.start])}"


def _prior(rig: Rig, state: BundleState) -> Prior:
    """Return what is known: the cameras, but not where all of them together stand."""
    columns = state.columns
    cameras = columns.of_cameras
    covariance = rig.parameter_covariance
    scale = np.sqrt(covariance.diagonal())
    free = np.flatnonzero(scale > 0.0)
    information = np.zeros((columns.count, columns.count))
    if len(free):
        own = covariance[np.ix_(free, free)] / np.outer(scale[free], scale[free])
        values, vectors = np.linalg.eigh(own)
        inverse = (vectors / np.maximum(values, _LEAST_VARIANCE)) @ vectors.T
        inverse /= np.outer(scale[free], scale[free])
        motions = state.world_motions()[cameras][free]
        by = inverse @ motions
        # All cameras together may stand anywhere: nothing here would show it.
        inverse -= by @ np.linalg.pinv(motions.T @ by) @ by.T
        information[np.ix_(free, free)] = 0.5 * (inverse + inverse.T)
    sought = np.concatenate([free, np.arange(columns.of_leds.start, columns.of_seats.stop)])
    return replace(Prior(state.values(), information, sought, len(free)), body_floats=True)

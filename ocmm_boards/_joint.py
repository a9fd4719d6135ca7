"""Probe and bars in the bundle of a board's views: one more body, lengths, and who contradicts.

The LEDs of the probe follow the corners of the board, so that one engine adjusts both bodies. If a
length is certified, the size of a body without a certificate is free within a percent: a stated
size must not outvote a certified one. Whether it contradicts is judged by the stated one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ocmm_boards._adjustment import BoardFit, sees
from ocmm_boards._board import Board
from ocmm_core.calibration import bundle
from ocmm_core.calibration.records import ArtefactUse, Finding
from ocmm_core.calibration.relocation import (
    Observations,
    RelocationOptions,
    RelocationProblem,
    build,
)
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

_FREE_SIZE = 0.01
"""Standard uncertainty of the size of a body that no certificate states."""
_RESTORED = 0.3
_SIZE = 3e-3
"""Usual fault of a print."""
_LEAST_PLACEMENTS = 5


@dataclass(frozen=True, slots=True)
class RecordedSpots:
    """Spots of a probe and of bars, taken with the cameras as they were for the board."""

    body: ProbeBody
    observed: Observations
    thermometer_k: float
    """Standard uncertainty of the shared temperature, K."""
    artefacts: tuple[ArtefactUse, ...] = ()
    """Certified bars among them."""


def with_recorded(
    rig: Rig, board: Board, fit: BoardFit, recorded: RecordedSpots, together: float
) -> BoardFit:
    """Return the adjustment of the board's views, probe and bars together.

    ``together``: variance by corners of a picture that err together, over that of independent
    ones; they count less than the spots of LEDs by as much. Errors as `relocation.build`.
    """
    certified = board.traceable or bool(recorded.artefacts)
    problem = _problem(rig, fit, recorded, free_size=certified)
    of_board, start, more = fit.state, problem.start, problem.data
    views, corners = len(fit.views), fit.corners
    shape = (views + len(more.uv), len(rig.cameras), corners + len(start.leds))
    uv, weights = np.full((*shape, 2), np.nan), np.zeros(shape)
    uv[:views, :, :corners], uv[views:, :, corners:] = fit.data.uv, more.uv
    weights[:views, :, :corners] = fit.data.weights / together**0.5
    weights[views:, :, corners:] = more.weights
    state = replace(
        start, cameras=of_board.cameras, leds=np.vstack([of_board.leds, start.leds]),
        rotations=np.concatenate([of_board.rotations, start.rotations]),
        origins=np.concatenate([of_board.origins, start.origins]),
    )  # fmt: skip
    data = replace(
        more, uv=uv, weights=weights, waved=views + more.waved,
        seats=np.concatenate([np.full(views, -1, dtype=np.int64), more.seats]),
    )  # fmt: skip
    free_size = certified and not board.traceable
    prior = _prior(board, fit, problem.prior, state, recorded, free_size=free_size)
    found = bundle.adjust_robustly(data, prior, state, _enough)
    return replace(fit, minimum=found, data=data, prior=prior)


def _problem(
    rig: Rig, fit: BoardFit, recorded: RecordedSpots, *, free_size: bool
) -> RelocationProblem:
    """Return probe and bars alone, with the cameras of the board."""
    body = recorded.body
    if free_size:
        arms = _FREE_SIZE * (np.vstack([body.leds_probe, body.tip_probe]) - body.tip_probe).ravel()
        covariance = body.geometry_covariance + np.outer(arms, arms)
        body = replace(body, geometry_covariance=covariance)
    located = replace(rig, cameras=fit.state.cameras)
    options = RelocationOptions(lens="free", thermometer_k=recorded.thermometer_k)
    return build(located, body, recorded.observed, options, alone=False)


def judge_recorded(rig: Rig, board: Board, fit: BoardFit, recorded: RecordedSpots) -> list[Finding]:
    """Return the findings on the probe and the bars: contradictions, and too few observations."""
    found = _contradicting(rig, board, fit, recorded)
    bars, used = recorded.observed.shown_bars, int(fit.minimum.placements_used.sum())
    if bars and used < _LEAST_PLACEMENTS:
        found.append(
            Finding(
                "boards.few_placements",
                f"The bar '{bars[0].bar.name}' was used in only {used} placements.",
                "Show it in ten placements all over the volume and in all directions.",
                refuses=not used,
            )
        )
    return found


def _enough(good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    enough: NDArray[np.bool_] = sees(good) | bundle.solvable(good)
    return enough


def _prior(
    board: Board, fit: BoardFit, of_probe: bundle.Prior, state: bundle.BundleState,
    recorded: RecordedSpots, *, free_size: bool,
) -> bundle.Prior:  # fmt: skip
    """Return the priors of both bodies and the bars, which share the thermometer."""
    columns, coordinates = state.columns, 3 * fit.corners
    own = np.arange(columns.of_leds.start, columns.of_leds.start + coordinates)
    place = np.arange(len(of_probe.values))
    place[columns.of_leds.start :] += coordinates
    values = state.values()
    values[own] = board.corners.ravel()
    values[place] = of_probe.values
    covariance = board.covariance
    if free_size:
        stretch = _FREE_SIZE * board.corners.ravel()
        covariance = covariance + np.outer(stretch, stretch)
    informed = np.flatnonzero(of_probe.information.diagonal())
    known = np.concatenate([own, place[informed]])
    joint = np.zeros((len(known),) * 2)
    joint[:coordinates, :coordinates] = covariance
    joint[coordinates:, coordinates:] = _inverse(of_probe.information[np.ix_(informed, informed)])
    thermal = None
    if of_probe.thermal is not None:
        thermal = np.zeros(columns.count)
        thermal[place] = of_probe.thermal
        thermal[own] = board.document.expansion * board.corners.ravel()
        shared = recorded.thermometer_k**2 * np.outer(thermal[own], thermal[known[coordinates:]])
        joint[:coordinates, coordinates:], joint[coordinates:, :coordinates] = shared, shared.T
    information = np.zeros((columns.count,) * 2)
    information[np.ix_(known, known)] = _inverse(joint)
    free = np.union1d(fit.prior.free, place[of_probe.free]).astype(np.int64)
    return bundle.Prior(values, information, free, len(known), thermal=thermal)


def _inverse(matrix: Float) -> Float:
    """Return the inverse of a covariance of millimetres and of micrometres."""
    scale = np.sqrt(matrix.diagonal())
    found: Float = np.linalg.inv(matrix / np.outer(scale, scale)) / np.outer(scale, scale)
    return found


def _contradicting(rig: Rig, board: Board, fit: BoardFit, recorded: RecordedSpots) -> list[Finding]:
    """Return the element that contradicts the others, freed one after the other."""
    data, _ = bundle.restored(fit.minimum.data, fit.data, _RESTORED)
    state = fit.state
    stated = _problem(rig, fit, recorded, free_size=False).prior
    prior = _prior(board, fit, stated, state, recorded, free_size=False)
    dof = data.excess + prior.rows + prior.gauge - len(prior.free)
    leds = np.arange(fit.corners, state.columns.leds)

    def trials(history: bundle.BlockHistory) -> Iterator[bundle.FaultTrial]:
        # Corners of a picture err together: what moved between views shows in their scatter.
        first = next(
            max(index, 1)
            for index, block in enumerate(history.blocks)
            if block.frames.stop > len(fit.views) or block.placements.stop
        )
        yield from (replace(one, first=first) for one in bundle.trials_of(history, leds))
        corners = state.columns.of_leds.start + np.arange(3 * fit.corners)
        larger = np.zeros((state.columns.count, 1))
        larger[corners, 0] = board.corners.ravel()
        yield bundle.FaultTrial(bundle.Culprit.BOARD_SIZE, -1, larger, np.array([_SIZE]), "before")

    verdict = bundle.examine(data, prior, state, dof, trials=trials)
    if verdict is None:
        return []
    # An LED that moved before the probe was shown has its present place: no second explanation.
    bent = {one.subject for one in verdict.named if one.cause is bundle.Culprit.LED}
    named = [
        one
        for one in verdict.named
        if one.cause is not bundle.Culprit.LOOSE or one.subject not in bent
    ]
    verdict = replace(verdict, named=tuple(named))
    names = bundle.Names(
        cameras=tuple(camera.name for camera in rig.cameras),
        bars=tuple(bar.name for bar in recorded.observed.bars) or ("",),
        procedure="pictures and recordings",
        moment=lambda index: _moment(fit, verdict.history.blocks[index]),
        board=board.document.name,
    )
    finding = bundle.accuse(verdict, names)
    return [] if finding is None else [finding]


def _moment(fit: BoardFit, block: bundle.Block) -> str:
    if block.placements.stop > block.placements.start:
        return f"placement {block.placements.start + 1} of the bar"
    return f"pose {max(block.frames.start - len(fit.views), 0) + 1} of the probe"

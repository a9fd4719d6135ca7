"""Find the faulty element of a relocation by freeing all uncertain unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.calibration import bundle
from ocmm_core.calibration.records import Finding
from ocmm_core.calibration.relocation._data import KeptByPoints, Observations, RelocationOptions
from ocmm_core.calibration.relocation._problem import RelocationProblem, prior_of
from ocmm_core.camera import Rig
from ocmm_core.geometry import Float
from ocmm_core.tracking import ProbeBody

TOGETHER = 0.3
"""If more of the spots of one element were left out than this, spots are not the cause."""

LEAST_SIGMA_MM = 1e-4
"""Smallest credible uncertainty of an LED."""

_SOFT_MM = 0.1
_WORSE, _LENGTH = 3.0, 2.5e-5
"""Another reference must give the length to this many sigmas of the bar, or to this fraction."""

_AGREES, _CONTRADICTS = 3.0, 5.0
"""Sigmas of the size of the control points."""


@dataclass(frozen=True, slots=True)
class Accusation:
    """Faulty element of a relocation."""

    verdict: bundle.CulpritVerdict
    finding: Finding | None
    """In words; None if nothing is faulty."""


def accuse_in_relocation(
    problem: RelocationProblem,
    found: bundle.RobustMinimum,
    start: Rig,
    body: ProbeBody,
    observed: Observations,
    options: RelocationOptions,
) -> Accusation | None:
    """Return the faulty element; None if the observations cannot determine it.

    All unknowns get the uncertainties of their documents: an unknown probe must not hide that it
    contradicts the bar.
    """
    state = found.minimum.state
    sigma = np.maximum(body.geometry_covariance.diagonal(), LEAST_SIGMA_MM**2)
    covariance = body.geometry_covariance.copy()
    covariance[np.diag_indices_from(covariance)] = sigma
    stated = replace(body, geometry_covariance=covariance)
    lens = "prior" if options.lens == "fixed" else options.lens
    asked = replace(options, lens=lens, geometry="uncertain")
    prior = prior_of(start, stated, observed, asked, problem.start)
    data, _ = bundle.restored(found.data, problem.data, TOGETHER)
    if np.count_nonzero(data.weights) > np.count_nonzero(found.data.weights):
        # The place of a seat that lost all its frames is undefined: start from the beginning,
        # loosely.
        loosely = replace(data, seat_sigma=max(_SOFT_MM, data.seat_sigma), touched_sigma=_SOFT_MM)
        state = bundle.adjust(loosely, prior, problem.start).state
    dof = data.excess + prior.rows + prior.gauge - len(prior.free)
    verdict = bundle.examine(data, prior, state, dof)
    if verdict is None:
        return None
    verdict = _told_by_points(verdict, observed, options)
    names = bundle.Names(
        cameras=tuple(camera.name for camera in start.cameras),
        bars=tuple(bar.name for bar in observed.bars) or ("",),
        procedure="the relocation",
        moment=lambda index: _moment(problem, verdict.history.blocks[index]),
    )
    finding = bundle.accuse(verdict, names)
    if finding is not None and _harmless(verdict, observed, options):
        finding = replace(finding, refuses=False)
    return Accusation(verdict, finding)


def _harmless(
    verdict: bundle.CulpritVerdict, observed: Observations, options: RelocationOptions
) -> bool:
    """Return whether an unknown probe may differ from its document.

    One displaced LED leaves the other distances, which agree with the bar. If all differ, the
    agreement of two bars is needed.
    """
    if options.geometry != "unknown" or not verdict.explained:
        return False
    causes = {one.cause for part in (verdict.named, *verdict.also) for one in part}
    return causes == {bundle.Culprit.LED} or (
        causes <= {bundle.Culprit.PROBE, bundle.Culprit.LED} and len(observed.bars) > 1
    )


def _told_by_points(
    verdict: bundle.CulpritVerdict, observed: Observations, options: RelocationOptions
) -> bundle.CulpritVerdict:
    by_cause = {one.cause: one for one in verdict.named}
    world = options.world
    if set(by_cause) != {bundle.Culprit.BAR, bundle.Culprit.SIZE} or not isinstance(
        world, KeptByPoints
    ):
        return verdict
    off = {cause: _sigmas_off(verdict, one, observed, world) for cause, one in by_cause.items()}
    for cause, other in (
        (bundle.Culprit.BAR, bundle.Culprit.SIZE),
        (bundle.Culprit.SIZE, bundle.Culprit.BAR),
    ):
        if off[cause] < _AGREES and off[other] > _CONTRADICTS:
            return replace(verdict, named=(by_cause[cause],))
    return verdict


def _sigmas_off(
    verdict: bundle.CulpritVerdict,
    suspect: bundle.Suspect,
    observed: Observations,
    world: KeptByPoints,
) -> float:
    """Return the size error of the known points, in sigmas, if this suspect is freed."""
    history = verdict.history
    names = tuple(world.positions_world)
    rows = [observed.seats.index(name) for name in names]
    seats = bundle.fit(history, suspect).state.seats[rows]
    listed = np.array([world.positions_world[name] for name in names])
    ratio, sigma = bundle.scale_between(seats, listed, _sigmas(verdict, rows, world.sigma))
    return abs(ratio - 1.0) / sigma


def _sigmas(verdict: bundle.CulpritVerdict, rows: Sequence[int], sigma: float) -> Float:
    """Return the allowed distance of the seats from the list, mm per axis."""
    columns = verdict.history.state.columns
    variances = verdict.history.covariance.diagonal()[columns.of_seats].reshape(-1, 3)
    sigmas: Float = np.sqrt(variances[rows].mean(axis=1) + sigma**2)
    return sigmas


def lone_bar(
    verdict: bundle.CulpritVerdict, observed: Observations, options: RelocationOptions
) -> str | None:
    """Return the only bar if no other reference would reveal its error, else None.

    Others: a second bar, the probe by its document, or known points that determine the bar's length
    about as well as itself.
    """
    if len(observed.bars) != 1:
        return None
    bar = observed.bars[0]
    columns = verdict.history.state.columns
    variance = verdict.history.covariance.diagonal()[columns.of_lengths][0]
    # Information on its length with the certificate removed.
    known = 1.0 / variance - 1.0 / bar.sigma**2
    world = options.world
    if isinstance(world, KeptByPoints):
        rows = [observed.seats.index(name) for name in world.positions_world]
        seats = verdict.history.state.seats[rows]
        _, ratio = bundle.scale_between(seats, seats, _sigmas(verdict, rows, world.sigma))
        known += (ratio * bar.length) ** -2
    limit = max(_WORSE * bar.sigma, _LENGTH * bar.length)
    return bar.name if known < limit**-2 else None


def accuse_points(
    finding: Finding, verdict: bundle.CulpritVerdict, observed: Observations, world: KeptByPoints
) -> Finding:
    """Return the finding on inconsistent points with its most likely cause."""
    names = tuple(world.positions_world)
    rows = [observed.seats.index(name) for name in names]
    listed = np.array([world.positions_world[name] for name in names])
    ways = bundle.explain_points(
        names, verdict.history.state.seats[rows], listed, _sigmas(verdict, rows, world.sigma)
    )
    if not ways:
        return replace(
            finding,
            what=f"{finding.what} Neither two swapped points nor one moved point explains it.",
        )
    told = ", or ".join(one.what for one in ways)
    doubt = "; they are too few to tell which" if len(ways) > 1 else ""
    return replace(finding, what=f"{finding.what} It fits if {told}{doubt}.")


def _moment(problem: RelocationProblem, block: bundle.Block) -> str:
    if block.placements.stop > block.placements.start:
        return f"placement {block.placements.start + 1} of the bar"
    frame = int(problem.order[block.frames.start])
    if block.frames.start >= problem.data.waved:
        return f"touch {block.frames.start - problem.data.waved + 1}"
    return f"pose {frame + 1}"

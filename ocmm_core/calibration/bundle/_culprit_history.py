"""Normal equations of a session by time block, to detect changes.

Some sixty blocks with poses eliminated, so that testing a change at any moment needs sums over
blocks only. Alternatives are tested to first order at the solution (score test, C. R. Rao, Proc.
Camb. Phil. Soc. 44, 1948), with all free unknowns projected out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from ocmm_core.calibration.bundle._bundle import common_covariance, linearise, residuals
from ocmm_core.calibration.bundle._state import BundleData, BundleState, Prior
from ocmm_core.geometry import Float

BLOCKS = 60
"""Number of blocks of about equal length."""

_PARTS, _LEAST_FRAMES = 20, 10
"""Number of parts searched for jointly excluded spots, and their minimum length."""

_LEAST_BLOCKS, _LEAST_KIND = 20, 5
"""Blocks needed to estimate their scatter, and that of blocks of another kind."""
_UNKNOWN = 20.0
"""That of too few pictures: a common error of half of the noise of each of some 80 corners."""

_LEAST_INFORMATION = 1e-8
"""Fraction of the information of a change left by free unknowns, below which it is unobservable."""


@dataclass(frozen=True, slots=True)
class Block:
    """Observations of one time interval."""

    frames: slice
    placements: slice
    """`frames`, `placements`: Of the bundle's data; one of both is empty."""


@dataclass(frozen=True, slots=True)
class ChangeScore:
    """Evidence of the residuals for one change."""

    score: float
    """Twice the logarithm of the likelihood ratio; chi-square (``dof``) without a change."""
    dof: int
    """Observable dimensions of the change."""
    size: Float
    """(m,): its most likely amount."""
    information: Float
    """(m, m): inverse of the covariance of that."""
    scatter: float = 1.0
    """Factor of chi-square, >= 1, of blocks over noise: neighbours share sensor errors."""


@dataclass(frozen=True, slots=True)
class BlockHistory:
    """The normal equations of a bundle at its minimum, block by block."""

    data: BundleData
    prior: Prior
    state: BundleState
    blocks: tuple[Block, ...]
    """In order of time."""
    normals: Float
    gradients: Float
    """`normals`, `gradients`: (b, k, k) and (b, k): of every block, its poses eliminated."""
    pull: Float
    """(k,): gradient of the prior."""
    covariance: Float
    """(k, k): of the common unknowns."""
    rest: Float
    """(k,): total gradient at the state; zero at an exact minimum."""
    cost: float
    """Chi-square at the minimum, to first order."""

    @classmethod
    def from_data(
        cls, data: BundleData, prior: Prior, state: BundleState, finely: Sequence[int] = ()
    ) -> BlockHistory | None:
        """Return the history, or None if undetermined; each frame in ``finely`` is a block."""
        covariance = common_covariance(data, prior, state)
        if covariance is None:
            return None
        silent = Prior(prior.values, np.zeros_like(prior.information), prior.free, 0)
        no_bars = np.zeros((0, 3), dtype=np.int64)
        normals, gradients = [], []
        blocks = _split(blocks_of(data), finely)
        for block in blocks:
            part = _part(replace(data, touched=no_bars), block)
            normal, gradient = linearise(part, silent, _poses(state, block), 0.0).reduced()
            normals.append(normal)
            gradients.append(gradient)
        everything, pull = linearise(data, prior, state, 0.0), np.zeros(len(prior.values))
        pull[:] = prior.information @ (state.values() - prior.values)
        rest = np.zeros(len(pull))
        rest[prior.free] = everything.reduced()[1][prior.free]
        own = sum(float(np.sum(group.z**2)) for group in everything.groups)
        return cls(
            data, prior, state, blocks, np.stack(normals), np.stack(gradients), pull, covariance,
            rest, everything.cost - own - float(rest @ covariance @ rest),
        )  # fmt: skip

    def of_prior(self, columns: Float) -> ChangeScore:
        """Return the evidence for an error; ``columns`` (k, m): d(common unknowns)/d(error)."""
        information = self.prior.information
        pull = self.pull - information @ (self.covariance @ self.rest)
        slope = information @ columns
        inner = columns.T @ slope - slope.T @ self.covariance @ slope
        pulls, alone = (columns.T @ pull)[None], np.diag(columns.T @ slope)[None]
        return _scores(inner[None], pulls, alone)[0]

    def of_time(self, columns: Float, profiles: Float) -> tuple[ChangeScore, ...]:
        """Return the evidence for a change during the session, for every time profile.

        ``columns`` (k, m): derivatives of the common unknowns by the change; ``profiles`` (p, b):
        fraction of the change effective in each block.
        """
        # Some hundred moments of a dozen suspects: all profiles at once.
        by = self.normals @ columns
        own = np.einsum("km,bkn->bmn", columns, by, optimize=True)
        across = np.tensordot(profiles, by, axes=1)
        alone = np.tensordot(profiles**2, own, axes=1)
        inner = alone - across.swapaxes(1, 2) @ (self.covariance @ across)
        still = self.covariance @ self.rest
        pulls = across.swapaxes(1, 2) @ still - profiles @ (self.gradients @ columns)
        return _scores(inner, pulls, alone.diagonal(axis1=1, axis2=2))

    def scatter(self, columns: Float, profile: Float, size: Float, kinds: int = 0) -> float:
        """Return the scatter of blocks about a change, see `ChangeScore`.

        ``kinds``: number of first blocks that scatter otherwise than the others; the larger counts.
        """
        # Remove the effect of the change on the common unknowns from all blocks.
        across = np.tensordot(profile, self.normals @ columns, axes=1)
        common = -self.covariance @ (self.rest + across @ size)
        moved = common + np.multiply.outer(profile, columns @ size)
        off = (self.gradients + np.einsum("bkl,bl->bk", self.normals, moved)) @ columns
        own = np.einsum("km,bkn->bmn", columns, self.normals @ columns, optimize=True)
        found = _scores(own, off, own.diagonal(axis1=1, axis2=2))
        whole = _usual(found, _LEAST_BLOCKS, 1.0)
        return max(whole, _usual(found[:kinds], _LEAST_KIND, _UNKNOWN)) if kinds else whole

    def steps(self) -> Float:
        """Return the profiles (b - 1, b) of sudden changes at every moment."""
        count = len(self.blocks)
        return np.triu(np.ones((count, count)))[1:]

    def drift(self) -> Float:
        """Return the profile (1, b) of a linear drift, from -1/2 to 1/2."""
        return np.linspace(-0.5, 0.5, len(self.blocks))[None]

    def corrected(self, step: Float, profile: Float) -> BundleData:
        """Return the data corrected for a change (k,) with a profile (b,)."""
        n, m = len(self.state.origins), len(self.state.bar_origins)
        changed = self.state.moved(step, np.zeros((n, 6)), np.zeros((m, 6)))
        frames, bars = np.zeros(n), np.zeros(m)
        for block, share in zip(self.blocks, profile, strict=True):
            frames[block.frames] = share
            bars[block.placements] = share
        was, now = residuals(self.data, self.state), residuals(self.data, changed)
        return replace(
            self.data,
            uv=self.data.uv - frames[:, None, None, None] * _between(was[0], now[0]),
            bar_uv=self.data.bar_uv - bars[:, None, None, None] * _between(was[1], now[1]),
        )


def blocks_of(data: BundleData) -> tuple[Block, ...]:
    """Return blocks in session order: waved, shown bars, seats."""
    n, m = len(data.seats), len(data.bars)
    length = max(1, -(-n // BLOCKS))
    none, waved = slice(0, 0), data.waved
    cuts = [slice(i, min(i + length, waved)) for i in range(0, waved, length)]
    seated = [slice(i, min(i + length, n)) for i in range(waved, n, length)]
    shown = [slice(i, i + 1) for i in range(m)]
    return (
        *(Block(frames, none) for frames in cuts),
        *(Block(none, placements) for placements in shown),
        *(Block(frames, none) for frames in seated),
    )


def _split(blocks: tuple[Block, ...], finely: Sequence[int]) -> tuple[Block, ...]:
    found: list[Block] = []
    for index, block in enumerate(blocks):
        frames = block.frames
        if index in finely and frames.stop > frames.start:
            single = range(frames.start, frames.stop)
            found.extend(Block(slice(i, i + 1), block.placements) for i in single)
        else:
            found.append(block)
    return tuple(found)


def restored(
    data: BundleData, whole: BundleData, share: float
) -> tuple[BundleData, NDArray[np.bool_]]:
    """Return the data with jointly excluded spots restored, and the restored placements.

    Single wrong spots are reflections and stay out. If more than ``share`` (0 to 1) of one LED in
    one camera, of one camera for a while, or of a bar's placements in ``whole`` were excluded,
    spots are not the cause.
    """
    seen, used = whole.weights > 0.0, data.weights > 0.0
    out = seen & ~used
    again = np.zeros_like(out)
    again |= _often(out, seen, 0, share)
    n = len(out)
    length = max(_LEAST_FRAMES, n // _PARTS)
    for part in (slice(first, first + length) for first in range(0, n, length)):
        if n - part.start >= _LEAST_FRAMES:
            again[part] |= _often(out[part], seen[part], (0, 1, 2), share)
            again[part] |= _often(out[part], seen[part], (0, 2), share)
    weights = np.where(again | used, whole.weights, 0.0)
    # A frame with a restored spot is restored whole.
    weights = np.where((again & out).any(axis=(1, 2), keepdims=True), whole.weights, weights)
    placed, shown = data.active[1], whole.active[1]
    bars = data.bar_weights.copy()
    back = np.zeros(len(placed), dtype=np.bool_)
    for bar in np.unique(whole.bars):
        mine = shown & (whole.bars == bar)
        if np.count_nonzero(mine & ~placed) > share * np.count_nonzero(mine):
            back |= mine & ~placed
    bars[back] = whole.bar_weights[back]
    return replace(data, weights=weights, bar_weights=bars), back


def _often(
    out: NDArray[np.bool_], seen: NDArray[np.bool_], axis: int | tuple[int, ...], share: float
) -> NDArray[np.bool_]:
    counts = out.sum(axis=axis, keepdims=True), seen.sum(axis=axis, keepdims=True)
    often: NDArray[np.bool_] = counts[0] > share * counts[1]
    return often


def _between(was: Float, now: Float) -> Float:
    """Return the difference of misses; zero for frames behind a camera."""
    finite = np.isfinite(was) & np.isfinite(now)
    return np.where(finite, now, 0.0) - np.where(finite, was, 0.0)


def _part(data: BundleData, block: Block) -> BundleData:
    frames, placements = block.frames, block.placements
    seats = data.seats[frames]
    return replace(
        data, uv=data.uv[frames], weights=data.weights[frames], seats=seats,
        waved=int(np.count_nonzero(seats < 0)), bar_uv=data.bar_uv[placements],
        bar_weights=data.bar_weights[placements], bars=data.bars[placements],
    )  # fmt: skip


def _poses(state: BundleState, block: Block) -> BundleState:
    frames, placements = block.frames, block.placements
    return replace(
        state, rotations=state.rotations[frames], origins=state.origins[frames],
        bar_rotations=state.bar_rotations[placements], bar_origins=state.bar_origins[placements],
    )  # fmt: skip


def _usual(found: Sequence[ChangeScore], least: int, unknown: float) -> float:
    squares = [one.score for one in found if one.dof]
    dofs = [one.dof for one in found if one.dof]
    if len(squares) < least:
        return unknown
    usual = float(np.median(scipy.special.chdtri(np.array(dofs, dtype=np.float64), 0.5)))
    # Median, so that the affected block does not mask itself.
    return max(1.0, float(np.median(squares)) / usual)


def _scores(inner: Float, pulls: Float, alone: Float) -> tuple[ChangeScore, ...]:
    """Return scores of pulls (p, m) by ``inner`` (p, m, m); ``alone``: its unprojected diagonal."""
    scale = np.sqrt(np.maximum(alone, 0.0))
    scale[scale == 0.0] = 1.0
    values, vectors = np.linalg.eigh(inner / (scale[:, :, None] * scale[:, None, :]))
    kept = values > _LEAST_INFORMATION
    along = np.where(kept, np.einsum("pji,pj->pi", vectors, pulls / scale), 0.0)
    weighed = along / np.where(kept, values, 1.0)
    sizes = np.einsum("pji,pi->pj", vectors, weighed) / scale
    rows = zip((along * weighed).sum(axis=1), kept.sum(axis=1), sizes, inner, strict=True)
    return tuple(ChangeScore(float(score), int(dof), size, by) for score, dof, size, by in rows)

"""Find the faulty element behind contradictory observations.

An adjustment spreads a misfit over all uncertain unknowns. Each suspect is therefore tested alone:
bar length, displaced LED, scaled probe, changed lens, shifted or drifted camera. Its worth is the
likelihood ratio against "nothing is wrong", less the chance gain of its free size and of the search
over moments (evidence of a normal prior of usual size; D. J. C. MacKay, Neural Computation 4,
1992). The best are then fitted fully. Suspects of similar worth are reported together: the
observations cannot separate them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from math import log
from typing import TypeAlias

import numpy as np
import scipy

from ocmm_core.calibration.bundle._bundle import BundleMinimum, adjust
from ocmm_core.calibration.bundle._culprit_history import BlockHistory, ChangeScore
from ocmm_core.calibration.bundle._state import LENS, BundleData, BundleState, Prior
from ocmm_core.calibration.monitor import N_MOTIONS, camera_changes
from ocmm_core.geometry import Float, Int

FALSE_ALARM = 1e-3
"""Probability of any accusation in a fault-free session, over all suspects and moments."""
DECISIVE = 12.0
"""Twice the logarithm of a likelihood ratio of 400: less likely alternatives are excluded."""

LEAST_PX = 0.005
"""RMS effect on spots below which nothing is refused; less than sensor drift over an hour."""

_TRIED, _PAIRED, _TRIED_IN_PAIR, _MOST = 6, 5, 3, 4
"""Suspects that are fitted fully, firsts of pairs, fully fitted seconds, and most faults named."""
_TURN, _SHIFT_MM, _LED_MM, _SIZE, _BAR_MM = 2e-4, 0.1, 0.5, 3e-4, 0.2
"""Usual sizes of faults: shifts (rad, mm), bent LEDs, wrong temperatures and lengths."""
_FOCAL_MM, _POINT_PX, _KELVIN = 0.1, 5.0, 3.0


class Culprit(Enum):
    """Kind of faulty element."""

    BAR = "bar"
    LED = "LED"
    SIZE = "size of the probe"
    TEMPERATURE = "temperature"
    PROBE = "probe"
    LENS = "lens"
    RIG = "rig"
    CAMERA = "camera"
    LOOSE = "loose LED"
    WARMING = "size of the probe during the session"
    CONE = "cone"
    PLACE = "place of a camera"
    BOARD_SIZE = "size of the board"


@dataclass(frozen=True, slots=True)
class Suspect:
    """A possible fault."""

    cause: Culprit
    subject: int
    """Index of the bar, LED or camera; -1 if there is only one."""
    score: ChangeScore
    columns: Float
    """(k, m): derivatives of the common unknowns by the fault."""
    profile: Float | None
    """(b,): fraction of the fault effective in each block; None if present from the start."""
    moment: int | None
    """First block after a sudden change; None for all others."""
    tried: int
    """Number of moments searched."""
    worth: float
    """Score over the remaining misfit, less the chance gain of freedom and search."""

    @property
    def step(self) -> Float:
        """Return its most likely amount in the common unknowns, (k,)."""
        return self.columns @ self.score.size


@dataclass(frozen=True, slots=True)
class CulpritVerdict:
    """Result of the search for faults."""

    history: BlockHistory
    named: tuple[Suspect, ...]
    """Possible faults, the likeliest first; empty if nothing is wrong."""
    misfit: float
    """Chi-square per degree of freedom left by the best explanation, at least one."""
    explained: bool
    """The best explanation leaves only noise."""
    effect_px: float
    """RMS effect of the best on the spots."""
    also: tuple[tuple[Suspect, ...], ...] = ()
    """Further faults, likeliest first, if the first one named is granted, with alternatives."""


@dataclass(frozen=True, slots=True)
class FaultTrial:
    """A hypothesis: derivatives of the common unknowns by the fault, and its usual sizes."""

    cause: Culprit
    subject: int
    columns: Float
    sizes: Float
    when: str
    """``before`` the session, or a ``step`` or ``drift`` during it."""
    first: int = 1
    """First block that may follow a step; those before it are of one kind."""


def examine(
    data: BundleData, prior: Prior, start: BundleState, dof: int, *, exactly: bool = True,
    trials: Callable[[BlockHistory], Iterator[FaultTrial]] | None = None,
) -> CulpritVerdict | None:  # fmt: skip
    """Return the verdict; None if the observations cannot determine a fault.

    The bundle is near its minimum with all uncertain unknowns free; ``dof`` is that of its
    chi-square. ``exactly`` adjusts and fits the best suspects fully; otherwise first order at
    ``start``. ``trials``: the faults to test, default `trials_of`.
    """
    trials = trials or trials_of
    state = adjust(data, prior, start).state if exactly else start
    history = BlockHistory.from_data(data, prior, state)
    if history is None or dof < 1:
        return None
    found = _round(history, dof, _TRIED if exactly else 0, trials)
    if not found.verdict.named or not exactly:
        return found.verdict
    return _with_others(found, dof)


_Tests: TypeAlias = Callable[[BlockHistory], Iterator[FaultTrial]]
_WHOLE = {Culprit.LED: Culprit.PROBE, Culprit.SIZE: Culprit.PROBE, Culprit.LENS: Culprit.RIG}
"""Faults that contain another one: both together are no pair."""


@dataclass(frozen=True, slots=True)
class _Round:
    verdict: CulpritVerdict
    tests: _Tests
    trials: Sequence[FaultTrial]
    ranked: Sequence[Suspect]


def _round(history: BlockHistory, dof: int, tried: int, tests: _Tests) -> _Round:
    cost = history.cost
    trials, suspects = _suspects(history, tests)
    misfit = _misfit(suspects, cost, dof)
    if not any(chance(one, misfit) * len(suspects) < FALSE_ALARM for one in suspects):
        verdict = CulpritVerdict(history, (), misfit, explained=True, effect_px=0.0)
        return _Round(verdict, tests, trials, ())
    sudden = [one for one in suspects if one.moment is not None]
    if sudden:
        # A change occurs at one frame within its block; frames on its wrong side fit nothing.
        moment = max(sudden, key=lambda one: one.score.score).moment
        assert moment is not None  # noqa: S101 - as just chosen
        at = moment - 1, moment
        history = BlockHistory.from_data(history.data, history.prior, history.state, at) or history
        trials, suspects = _suspects(history, tests)
        misfit = _misfit(suspects, cost, dof)
    ranked = sorted((_weighed(one, trials, misfit) for one in suspects), key=lambda one: -one.worth)
    proven = [_granted(history, one) if tried else one for one in ranked[: tried or _TRIED]]
    left = cost - max(one.score.score for one in proven)
    misfit = max(1.0, left / dof)
    proven = [_weighed(one, trials, misfit) for one in proven]
    proven.sort(key=lambda one: -one.worth)
    best = proven[0]
    near = [one for one in proven if one.worth > best.worth - DECISIVE]
    explained = misfit < 1.0 + 4.0 * float(np.sqrt(2.0 / dof)) + 0.02 * (cost - left) / dof
    effect = effect_of(history, best)
    verdict = CulpritVerdict(history, _one_of_each(near), misfit, explained, effect)
    return _Round(verdict, tests, trials, proven)


def _with_others(found: _Round, dof: int) -> CulpritVerdict:
    """Return the verdict with further faults; pairs compete with the best single one."""
    first, history = found.verdict, found.verdict.history
    pairs: list[tuple[Suspect, _Round]] = []
    for one in _one_of_each(found.ranked)[:_PAIRED]:
        after = _after(history, one)
        if after is None:
            continue
        rest = _round(after, dof - one.score.dof, _TRIED_IN_PAIR, found.tests)
        if not rest.verdict.named or rest.verdict.named[0].cause is not _WHOLE.get(one.cause):
            pairs.append((one, rest))
    if not pairs:
        return first
    misfit = min(rest.verdict.misfit for _, rest in pairs)

    def worth(pair: tuple[Suspect, _Round]) -> float:
        one, rest = pair
        total = _weighed(one, found.trials, misfit).worth
        return total + sum(
            _weighed(other, rest.trials, misfit).worth for other in rest.verdict.named[:1]
        )

    one, rest = max(pairs, key=lambda each: worth(each) + DECISIVE * (not each[1].verdict.named))
    if not rest.verdict.named:
        # Alternatives remain as they were, unless this one is better than what they named.
        return first if _keys((one,)) & _keys(first.named) else replace(first, named=(one,))
    beside, rest_of_pair = _keys(rest.verdict.named), rest
    alike = [
        other
        for other, its in sorted(pairs, key=worth, reverse=True)
        if worth((other, its)) > worth((one, rest)) - DECISIVE
        and not _keys((other,)) & beside
        and _keys(its.verdict.named) & beside
    ]
    also, freedom = [rest.verdict.named], one.score.dof
    while rest.verdict.named and len(also) < _MOST:
        freedom += rest.verdict.named[0].score.dof
        after = _after(rest.verdict.history, rest.verdict.named[0])
        if after is None:
            break
        rest = _round(after, dof - freedom, _TRIED_IN_PAIR, found.tests)
        also += [rest.verdict.named] * bool(rest.verdict.named)
    # Few LEDs leave so few distances that two of them explain as much as all.
    least = worth((one, rest_of_pair)) - 3 * DECISIVE
    if all(part[0].cause is one.cause for part in also):
        for whole in found.ranked:
            is_whole = whole.cause is _WHOLE.get(one.cause)
            if is_whole and _weighed(whole, found.trials, misfit).worth > least:
                return replace(first, named=(whole,), also=((one,), *(part[:1] for part in also)))
    return replace(
        first, named=tuple(alike), also=tuple(also), misfit=rest.verdict.misfit,
        explained=rest.verdict.explained, effect_px=max(first.effect_px, rest.verdict.effect_px),
    )  # fmt: skip


def _after(history: BlockHistory, suspect: Suspect) -> BlockHistory | None:
    """Return the history once a suspect is granted; None if it leaves something undetermined."""
    data, prior = _granting(history, suspect)
    return BlockHistory.from_data(data, prior, adjust(data, prior, history.state).state)


def _suspects(history: BlockHistory, tests: _Tests) -> tuple[list[FaultTrial], list[Suspect]]:
    trials = list(tests(history))
    found = (_tried(history, trial) for trial in trials)
    return trials, [one for one in found if one is not None]


def _misfit(suspects: Sequence[Suspect], cost: float, dof: int) -> float:
    """Return the misfit left by the best suspect, a common scale of all sigmas."""
    greatest = max((one.score.score for one in suspects), default=0.0)
    return max(1.0, (cost - greatest) / dof)


def chance(suspect: Suspect, misfit: float) -> float:
    """Return the probability of such a score at any moment if nothing is wrong."""
    dof, excess = suspect.score.dof, suspect.score.score / (misfit * suspect.score.scatter)
    return suspect.tried * float(scipy.special.chdtrc(dof, excess))


def fit(history: BlockHistory, suspect: Suspect) -> BundleMinimum:
    """Return the minimum with a suspect's error removed or of free size."""
    return adjust(*_granting(history, suspect), history.state)


def _granting(history: BlockHistory, suspect: Suspect) -> tuple[BundleData, Prior]:
    if suspect.profile is not None:
        return history.corrected(suspect.step, suspect.profile), history.prior
    # An error of prior knowledge, of free size, removes that much information.
    prior = history.prior
    slope = prior.information @ suspect.columns
    inner = suspect.columns.T @ slope
    less = prior.information - slope @ np.linalg.pinv(inner, hermitian=True) @ slope.T
    floats = prior.body_floats or suspect.cause is Culprit.PROBE
    freed = replace(prior, information=0.5 * (less + less.T), body_floats=floats)
    return history.data, freed


def _granted(history: BlockHistory, suspect: Suspect) -> Suspect:
    found, score = fit(history, suspect), suspect.score
    size: Float = score.size
    if suspect.profile is None and suspect.cause is not Culprit.PROBE:
        slope = history.prior.information @ suspect.columns
        off = found.state.values() - history.prior.values
        size = np.linalg.pinv(suspect.columns.T @ slope, hermitian=True) @ slope.T @ off
    gained = history.cost - found.cost
    return replace(suspect, score=replace(score, score=gained, size=size))


def effect_of(history: BlockHistory, suspect: Suspect) -> float:
    """Return the RMS effect of the error on the affected spots, px."""
    data = history.data
    profile = np.ones(len(history.blocks)) if suspect.profile is None else suspect.profile
    changed = history.corrected(suspect.step, profile)
    moved = np.concatenate([
        (changed.uv - data.uv)[data.weights > 0.0], (changed.bar_uv - data.bar_uv)[
            data.bar_weights > 0.0]
    ])  # fmt: skip
    concerned = moved[np.abs(moved).max(axis=1) > 0.0]
    return float(np.sqrt(np.mean(concerned**2))) if len(concerned) else 0.0


def trials_of(history: BlockHistory, probe: Int | None = None) -> Iterator[FaultTrial]:
    """Yield the faults of bars, cameras and probe; ``probe``: its LEDs, by default all."""
    state, columns = history.state, history.state.columns
    information = history.prior.information.diagonal()

    def unit(places: Sequence[int]) -> Float:
        found = np.zeros((columns.count, len(places)))
        found[list(places), range(len(places))] = 1.0
        return found

    own = np.arange(columns.leds) if probe is None else probe
    led_places = (columns.of_leds.start + 3 * own[:, None] + np.arange(3)).tolist()
    leds = [place for places in led_places for place in places]
    larger = np.zeros((columns.count, 1))
    larger[leds, 0] = (state.leds[own] - state.leds[own].mean(axis=0)).ravel()
    thermal = history.prior.thermal
    if thermal is not None:
        yield FaultTrial(Culprit.TEMPERATURE, -1, thermal[:, None], np.array([_KELVIN]), "before")
    for bar in range(columns.bars):
        place = columns.of_lengths.start + bar
        yield FaultTrial(Culprit.BAR, bar, unit([place]), np.array([_BAR_MM]), "before")
    if information[leds].any():
        for led, places in enumerate(led_places):
            yield FaultTrial(Culprit.LED, led, unit(places), np.full(3, _LED_MM), "before")
        yield FaultTrial(Culprit.SIZE, -1, larger, np.array([_SIZE]), "before")
        yield FaultTrial(Culprit.PROBE, -1, unit(leds), np.full(len(leds), _LED_MM), "before")
    for led, places in enumerate(led_places):
        yield FaultTrial(Culprit.LOOSE, led, unit(places), np.full(3, _LED_MM), "step")
    yield FaultTrial(Culprit.WARMING, -1, larger, np.array([_SIZE]), "drift")
    if columns.seats == 1:
        seat = range(columns.of_seats.start, columns.of_seats.stop)
        for when in ("step", "drift"):
            yield FaultTrial(Culprit.CONE, -1, unit(seat), np.full(3, _LED_MM), when)
    lenses = [
        columns.camera(index).start + place
        for index in range(columns.cameras)
        for place in (LENS.start, LENS.start + 2, LENS.start + 3)
    ]
    usual = np.array([_FOCAL_MM, _POINT_PX, _POINT_PX])
    if columns.cameras > 1 and information[lenses].all():
        yield FaultTrial(Culprit.RIG, -1, unit(lenses), np.tile(usual, columns.cameras), "before")
    turn, shift = np.full(3, _TURN), np.full(3, _SHIFT_MM)
    for index, camera in enumerate(state.cameras):
        place = columns.camera(index)
        lens = range(place.start + LENS.start, place.stop)
        if information[lens.start]:
            seen = lenses[3 * index : 3 * index + 3]
            yield FaultTrial(Culprit.LENS, index, unit(seen), usual, "before")
        motion = np.zeros((columns.count, N_MOTIONS))
        motion[place] = camera_changes(camera)[:, :N_MOTIONS]
        if information[place.start]:
            both = np.concatenate([turn, shift])
            yield FaultTrial(Culprit.PLACE, index, motion, both, "before")
        for when in ("step", "drift"):
            yield FaultTrial(Culprit.CAMERA, index, motion[:, :3], turn, when)
            yield FaultTrial(Culprit.CAMERA, index, motion, np.concatenate([turn, shift]), when)


def _tried(history: BlockHistory, trial: FaultTrial) -> Suspect | None:
    """Return the trial at its best moment; None if unobservable."""
    profile, moment, tried = None, None, 1
    if trial.when == "before":
        score = history.of_prior(trial.columns)
    else:
        steps = trial.when == "step"
        profiles = history.steps()[trial.first - 1 :] if steps else history.drift()
        if not len(profiles):
            return None
        scores = history.of_time(trial.columns, profiles)
        best = int(np.argmax([one.score for one in scores]))
        score, profile, tried = scores[best], profiles[best], len(profiles)
        scatter = history.scatter(trial.columns, profile, score.size, trial.first - 1)
        score = replace(score, scatter=scatter)
        moment = best + trial.first if steps else None
    if not score.dof:
        return None
    return Suspect(trial.cause, trial.subject, score, trial.columns, profile, moment, tried, 0.0)


def _weighed(suspect: Suspect, trials: Sequence[FaultTrial], misfit: float) -> Suspect:
    score = suspect.score
    m = len(score.size)
    sizes = next(one.sizes for one in trials if one.cause is suspect.cause and len(one.sizes) == m)
    misfit *= score.scatter
    known = sizes[:, None] * score.information * sizes / misfit
    freedom = float(np.linalg.slogdet(np.eye(m) + known)[1])
    worth = score.score / misfit - freedom - 2.0 * log(suspect.tried)
    return replace(suspect, worth=worth)


def _keys(suspects: Sequence[Suspect]) -> set[tuple[Culprit, int]]:
    return {(one.cause, one.subject) for one in suspects}


def _one_of_each(suspects: Sequence[Suspect]) -> tuple[Suspect, ...]:
    found: dict[tuple[Culprit, int], Suspect] = {}
    for one in suspects:
        found.setdefault((one.cause, one.subject), one)
    return tuple(found.values())

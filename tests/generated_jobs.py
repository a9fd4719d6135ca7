"""Random jobs in all states, for screens and reports.

Values, limits, bonus and uncertainty are drawn and pass through the product's own decision;
finished, skipped, open and active features are drawn as well, with their consequences.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from ocmm_core.features.shapes import NominalFeature, Shape, element
from ocmm_core.inspection.evaluation import FeatureState, FeatureView, JobView
from ocmm_core.measuring import Rows
from ocmm_core.tolerances.decisions import (
    WORST_FIRST,
    CharacteristicResult,
    Rule,
    Verdict,
    make_result,
    not_measured,
    not_proven,
    provisional,
)
from ocmm_core.tolerances.uncertainty import Normal, Spreads
from ocmm_core.tolerances.zones import Characteristic, Evaluation
from tests.core.export.sample_report import feature, point, sample_view

RULES: tuple[Rule, ...] = ("iso14253-1", "ilac-g8", "simple")
STATES = (
    FeatureState.DONE, FeatureState.DONE, FeatureState.DONE, FeatureState.SKIPPED,
    FeatureState.PENDING,
)  # fmt: skip
ROUND = element([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], 10.0)


def is_greener(verdict: Verdict, than: Verdict) -> bool:
    """Return whether a verdict promises more than another one."""
    return WORST_FIRST.index(verdict) > WORST_FIRST.index(than)


@cache
def generated_job(seed: int) -> tuple[JobView, list[NominalFeature]]:
    """Return a job of 1 to 5 features with 0 to 4 characteristics each, and its nominals."""
    rng = np.random.default_rng(seed)
    names = [f"F{index}" for index in range(1, int(rng.integers(1, 6)) + 1)]
    all_done = bool(rng.random() < 0.5)
    features = [_feature(rng, name, all_done=all_done) for name in names]
    open_ = [i for i, item in enumerate(features) if item.state is FeatureState.PENDING]
    active = ""
    if open_:
        features[open_[0]] = replace(features[open_[0]], state=FeatureState.ACTIVE)
        active = features[open_[0]].name
    unproven = "The cameras were never calibrated." if rng.random() < 0.1 else ""
    results = []
    for item in features:
        for index in range(int(rng.integers(0, 5))):
            other = str(rng.choice(names))
            about = [item.name] if rng.random() < 0.7 or other == item.name else [item.name, other]
            results.append(_result(rng, f"{item.name} c{index}", about, features, unproven))
    looked_at = str(rng.choice([*names, "", "", ""])) if not active else ""
    view = replace(
        sample_view(),
        features=tuple(features),
        active=active,
        characteristics=tuple(results),
        complete=not active,
        unproven=unproven,
        paused=bool(rng.random() < 0.2),
        looked_at=looked_at,
        simulated=bool(rng.random() < 0.3),
    )
    nominals = [
        NominalFeature(
            name=name, shape=Shape.CIRCLE, points=4, point=(0.0, 0.0, 0.0), diameter=20.0,
            direction=(0.0, 0.0, 1.0), side="inner",
        )
        for name in names
    ]  # fmt: skip
    return view, nominals


def _feature(rng: np.random.Generator, name: str, *, all_done: bool) -> FeatureView:
    state = FeatureState.DONE if all_done else STATES[int(rng.integers(len(STATES)))]
    count = 4 if state is FeatureState.DONE else int(rng.integers(0, 4))
    turns = 0.5 * np.pi * np.arange(count)
    first = 10 * int(name[1:])
    points = [
        point(first + i, name, (8.5 * float(np.cos(t)), 8.5 * float(np.sin(t)), 0.0),
              (-float(np.cos(t)), -float(np.sin(t)), 0.0))
        for i, t in enumerate(turns)
    ]  # fmt: skip
    fit = ROUND if state is FeatureState.DONE and rng.random() < 0.9 else None
    made = feature(name, Shape.CIRCLE, points, fit, [0.001] * count)
    return replace(made, state=state, needed=4, note="" if fit is not None else "It has no fit.")


def _result(
    rng: np.random.Generator, name: str, about: list[str], features: list[FeatureView],
    unproven: str,
) -> CharacteristicResult:  # fmt: skip
    upper = 10.0 ** rng.uniform(-2.5, -0.5)
    zone = bool(rng.random() < 0.4)
    item = Characteristic(
        name=name, kind="position" if zone else "diameter", features=about,
        nominal=0.0 if zone else 20.0, lower=0.0 if zone else -upper, upper=upper,
    )  # fmt: skip
    known = {one.name: one for one in features}
    below = [known[one] for one in about]
    sigma = upper * 10.0 ** rng.uniform(-2.0, 0.3)
    bonus = upper * float(rng.integers(0, 2)) * rng.uniform(0.1, 10.0) if zone else 0.0
    value = item.nominal + (abs if zone else float)(upper * float(rng.normal(0.0, 0.8)))
    spread = Normal(value, sigma, one_sided=zone)
    judged = Normal(value - bonus, sigma, one_sided=zone)
    made = make_result(
        item,
        Evaluation(value, Rows.nothing(), bonus=bonus),
        Spreads(spread, judged if bonus else spread),
        RULES[int(rng.integers(3))],
    )
    if any(one.state is FeatureState.SKIPPED or (
        one.state is FeatureState.DONE and one.fit is None
    ) for one in below):  # fmt: skip
        return not_measured(item, "A feature was skipped, or has no fit.")
    if any(one.state is not FeatureState.DONE for one in below):
        if not any(one.points for one in below):
            return not_measured(item, "Waits for a feature.")
        return provisional(made, "Provisional: a feature is incomplete.")
    if unproven:
        return not_proven(made, unproven)
    if rng.random() < 0.1:
        return not_proven(made, "1 point of the datum held back.")
    return made

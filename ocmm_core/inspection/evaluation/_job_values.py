"""Records of features and values of a job, recomputed when their inputs change."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ocmm_core.alignment import BoundAlignment, doubt_of
from ocmm_core.camera import Rig
from ocmm_core.errors import FitError
from ocmm_core.features.measured import ActualFeature, measured_of
from ocmm_core.geometry import Float
from ocmm_core.inspection.evaluation._job_graph import FeatureGraph, Found, PointsByFeature
from ocmm_core.measuring import PointFactors, joined_factors, joint_factors, root_of
from ocmm_core.tolerances.decisions import CharacteristicResult, evaluate_one
from ocmm_core.tolerances.uncertainty import FormSample, form_samples
from ocmm_core.tolerances.zones import Characteristic, Frames, HeldFrame
from ocmm_core.tracking import ProbeBody, TipSensitivity


@dataclass(frozen=True, slots=True)
class Record:
    feature: ActualFeature | FitError
    factors: PointFactors | None
    """Uncertainty of its own points; None without any."""
    sample: FormSample | None
    """Evidence of its form; None if none."""


class ValueGraph:
    """Values of a job. `rig`, `body`: Cameras and probe of the points."""

    def __init__(self, graph: FeatureGraph, rig: Rig, body: ProbeBody) -> None:
        self._graph, self._rig, self._body = graph, rig, body
        self._cache = graph.cache
        self._roots: dict[tuple[tuple[int, ...], bytes], Float] = {}

    def results(
        self,
        touched: PointsByFeature,
        sensitivities: Mapping[str, Sequence[TipSensitivity]],
        actual: Found,
    ) -> Mapping[str, CharacteristicResult]:
        """Return a result for every characteristic of the plan, by name.

        `touched`, `actual`: points and features by `FeatureGraph`. `sensitivities`: of each
        feature's points, in order.
        """
        graph, table = self._graph, self._cache.table
        plan, facts, alignment = graph.plan, graph.facts, graph.alignment(actual)
        same = (self._rig, self._body, graph.options, facts.bound)
        blocks = table(
            "factors", same, (sensitivities, touched.points),
            lambda name: self._factors(name, touched, sensitivities[name]),
        )  # fmt: skip
        records = table(
            "record", (plan,), (actual, blocks),
            lambda name: self._record(name, actual[name], blocks),
            reads=facts.planes, below=(blocks,),
        )  # fmt: skip
        asked = graph.below.asked
        return self._cache.watched_table(
            "value", (plan, alignment), records,
            lambda name, watch: self._value(asked[name], alignment, watch, touched.owners),
            graph.below.names,
        )  # fmt: skip

    def _factors(
        self, name: str, touched: PointsByFeature, sensitivities: Sequence[TipSensitivity]
    ) -> PointFactors:
        points, options, bound = touched.points[name], self._graph.options, self._graph.facts.bound
        numbers = touched.places[name]

        def made(first: int) -> PointFactors:
            found = joint_factors(
                points[first:], sensitivities[first:], self._rig, self._body, options.contact,
                options.climate.part, doubt_of(bound), self._root,
            )  # fmt: skip
            places = np.array(numbers[first:], dtype=np.int64)
            order = np.argsort(places)
            return replace(found.kept(order), places=places[order])

        return self._cache.appended(
            ("factors", name), (self._rig, self._body, options, bound), (points, sensitivities),
            made, lambda *parts: joined_factors(parts),
        )  # fmt: skip

    def _root(self, covariance: Float) -> Float:
        key = covariance.shape, covariance.tobytes()
        if key not in self._roots:
            self._roots[key] = root_of(covariance)
        return self._roots[key]

    def _record(
        self, name: str, feature: ActualFeature | FitError, blocks: Mapping[str, PointFactors]
    ) -> Record:
        facts = self._graph.facts
        plane = facts.by_name[name].projection if name in facts.by_name else ""
        found = [blocks[other] for other in (name, plane) if other in blocks]
        own = blocks.get(name)

        sample = None
        if own is not None and not isinstance(feature, FitError):
            sample = next(iter(form_samples({name: feature}, joined_factors(found))), None)
        return Record(feature, own, sample)

    def _value(
        self,
        item: Characteristic,
        alignment: BoundAlignment | None,
        records: Mapping[str, Record],
        owners: Mapping[int, str],
    ) -> CharacteristicResult:
        def kept(
            datums: tuple[str, ...],
            actual: Mapping[str, ActualFeature],
            make: Callable[[Mapping[str, ActualFeature]], HeldFrame],
        ) -> HeldFrame:
            return self._cache.watched(("datums", datums), (alignment,), actual, make)

        known = _Known(records, owners)
        frames = Frames(measured_of(known.actual), alignment, kept)
        return evaluate_one(item, alignment, known, frames, self._graph.plan.rule)


class _Known:
    """Records in the form that evaluations need."""

    def __init__(self, records: Mapping[str, Record], owners: Mapping[int, str]) -> None:
        self._records, self._owners = records, owners
        self.actual = _Features(records)

    def touching(self, places: Sequence[int]) -> set[str]:
        return {self._owners[place] for place in places}

    def factors(self, names: Collection[str]) -> PointFactors:
        found = [self._records[name].factors for name in names]
        return joined_factors([factors for factors in found if factors is not None])

    def sample(self, name: str) -> FormSample | None:
        return self._records[name].sample


class _Features(Mapping[str, ActualFeature | FitError]):
    def __init__(self, records: Mapping[str, Record]) -> None:
        self._records = records

    def __getitem__(self, name: str) -> ActualFeature | FitError:
        return self._records[name].feature

    def __iter__(self) -> Iterator[str]:
        return iter(self._records)

    def __len__(self) -> int:
        return len(self._records)

"""The whole job as JSON with its raw observations and exact numbers.

Shortest form that reads back equal; an unseen spot is null; fields never change their meaning.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import msgspec
import numpy as np

from ocmm_core.errors import InputError
from ocmm_core.export.report import _json_schema as json_schema
from ocmm_core.export.report import _tables as tables
from ocmm_core.export.report._exporter import Exporter, Profile
from ocmm_core.export.report._names import check_name, clean_text
from ocmm_core.export.report._paper_facts import paper_facts
from ocmm_core.export.report._report_data import (
    Element,
    ReportData,
    ReportedFeature,
    ReportedResult,
)
from ocmm_core.geometry import Float, triple
from ocmm_core.inspection.causes import Explanation
from ocmm_core.measuring import MeasuredPoint
from ocmm_core.tolerances.decisions import PartVerdict, VerdictSummary

_NO_NUMBERS = (None, None, None)
"""Value, deviation and uncertainty if not measured."""


def _contents(jobs: Sequence[ReportData], profile: Profile) -> dict[str, bytes]:
    (data,) = jobs
    content = msgspec.json.encode(_file(data))
    return {_name(data): msgspec.json.format(content, indent=1) + b"\n"}


def _differences(
    jobs: Sequence[ReportData], profile: Profile, files: Mapping[str, bytes]
) -> list[str]:
    (data,) = jobs
    name = _name(data)
    try:
        found = json_schema.read_report(files[name])
    except InputError as error:
        return [f"{name}: {error.what}"]
    different = []
    if len(found.observations) != len(data.observations):
        different.append(f"{name}: there are {len(found.observations)} observations.")
    for told, point in zip(found.observations, data.observations, strict=False):
        if not _is_same(told, point):
            different.append(f"{name}: point {point.number} is not the one that was measured.")
    for told_result, reported in zip(found.results, data.reported, strict=False):
        result = reported.result
        numbers = (told_result.measured, told_result.deviation, told_result.uncertainty)
        if numbers != (result.stated or _NO_NUMBERS) or (told_result.name, told_result.verdict) != (
            result.name,
            result.verdict.value,
        ):
            different.append(f"{name}: {result.name} is not the result of the job.")
    part = found.part_verdict
    if part is None or (part.word, part.missing) != (data.part.headline, data.part.missing):
        different.append(f"{name}: it has another verdict on the part.")
    if (found.state, found.simulated) != (data.states, data.view.simulated):
        different.append(f"{name}: it does not say that the job is {data.state_words}.")
    if found != _file(data):
        different.append(f"{name}: it is not what was to be written.")
    return different


def _name(data: ReportData) -> str:
    return f"{data.stem}.json"


def _file(data: ReportData) -> json_schema.ReportFile:
    view, head = data.view, data.head
    return json_schema.ReportFile(
        schema=json_schema.SCHEMA,
        unit="mm",
        part_verdict=_part(data.part),
        state=data.states,
        seal=_seal(data),
        simulated=view.simulated,
        job=json_schema.JobPart(
            name=data.job,
            uuid=head.job_uuid,
            part=clean_text(view.part),
            serial=clean_text(head.serial),
            operator=clean_text(head.operator),
            order=clean_text(view.header.order),
            batch=clean_text(view.header.batch),
            created_utc=head.created_utc,
            plan=data.plan.name,
            plan_sha256=head.plan_identity,
            plan_release=clean_text(data.release.summary),
            rig_sha256=head.rig_identity,
            probe_sha256=head.probe_identity,
            measured_with=head.software_version,
            written_with=data.written_by,
            complete=data.part.complete,
            unproven=view.unproven,
            points_held_back=tuple(view.held),
            points_taken_back=tuple(data.annulled),
            doubts=data.notes,
            camera_doubts=view.camera_doubts,
            noise=view.noise,
        ),
        decision_rule=data.plan.rule,
        temperature=view.temperature,
        reported_at_20_c=view.at_20_c,
        cameras=json_schema.InstrumentPart(
            label=data.calibration.label, note=data.calibration.note
        ),
        probe=json_schema.InstrumentPart(label=data.probe.label, note=data.probe.note),
        reference=json_schema.InstrumentPart(label=data.reference.label, note=data.reference.note),
        frame=json_schema.FramePart(
            name=data.system,
            rotation_from_world=_matrix(data.frame.rotation),
            translation_from_world=triple(data.frame.translation),
        ),
        features=tuple(_feature(item, view.verdict_of(item.name)) for item in data.features),
        results=tuple(_result(item, data.explanation(item.result.name)) for item in data.reported),
        observations=tuple(
            _observation(point, data.taken_utc.get(point.number, "")) for point in data.observations
        ),
        taken_back=tuple(
            json_schema.TakenBackPart(
                observation=_observation(point, data.taken_utc.get(point.number, "")),
                reason=clean_text(reason),
            )
            for point, reason in data.taken_back
        ),
        head=tuple(
            msgspec.convert(fact, json_schema.PaperFactPart, from_attributes=True)
            for fact in paper_facts(data)
        ),
    )


def _part(part: PartVerdict) -> json_schema.PartVerdictPart:
    return json_schema.PartVerdictPart(
        word=part.headline,
        verdict=None if part.verdict is None else part.verdict.value,
        complete=part.complete,
        not_conform=part.failing,
        not_proven=part.unproven,
        missing=part.missing,
        counts={verdict.value: count for verdict, count in part.summary.counts},
        requirements=part.requirement_words,
    )


def _feature(feature: ReportedFeature, summary: VerdictSummary) -> json_schema.FeaturePart:
    fit = feature.seen.fit
    return json_schema.FeaturePart(
        name=check_name("feature", feature.name),
        shape=feature.shape.value,
        verdict=None if summary.verdict is None else summary.verdict.value,
        deciding=summary.deciding,
        points=tuple(point.number for point in feature.seen.points),
        outliers=feature.seen.outliers,
        nominal=_element(feature.nominal_element),
        actual=_element(feature.actual_element),
        form=None if fit is None else _finite(feature.name, fit.form),
        rms=None if fit is None else _finite(feature.name, fit.rms),
        criterion="" if fit is None else fit.criterion.name.lower().replace("_", " "),
        note=tables.note_of(feature.seen),
    )


def _result(reported: ReportedResult, explained: Explanation | None) -> json_schema.ResultPart:
    result = reported.result
    name = check_name("characteristic", result.name)
    # Provisional values are for screens: programs read numbers without the verdict.
    measured, deviation, uncertainty = result.stated or _NO_NUMBERS
    return json_schema.ResultPart(
        name=name,
        kind=result.kind,
        features=result.features,
        datums=reported.datums,
        association=reported.association,
        frame=result.frame,
        rule=result.rule,
        unit=reported.unit,
        nominal=result.nominal,
        lower=result.lower,
        upper=result.upper,
        measured=_finite(name, measured),
        deviation=_finite(name, deviation),
        uncertainty=_finite(name, uncertainty),
        interval=None if measured is None else result.interval,
        bonus=result.bonus,
        floor=_finite(name, result.floor),
        verdict=result.verdict.value,
        note=result.note,
        explanation=None if explained is None else _explanation(explained),
    )


def _explanation(explained: Explanation) -> json_schema.ExplanationPart:
    finding = explained.finding
    return json_schema.ExplanationPart(
        cause=finding.cause.value,
        beyond=_finite(explained.characteristic, explained.beyond),
        why=explained.why,
        suggestion=finding.suggestion,
        evidence=finding.evidence,
        features=finding.features,
        points=finding.points,
    )


def _seal(data: ReportData) -> json_schema.SealPart | None:
    seal = data.seal
    if seal is None:
        return None
    return json_schema.SealPart(
        steps=seal.steps, head=seal.head, key=seal.state.fingerprint, line=seal.line
    )


def _finite(name: str, value: float | None) -> float | None:
    """Return a number that JSON can hold; StorageError as every table raises it."""
    if value is not None:
        tables.Units().length(name, value)
    return value


def _element(element: Element | None) -> json_schema.ElementPart | None:
    if element is None:
        return None
    return json_schema.ElementPart(
        point=triple(element.point),
        direction=None if element.direction is None else triple(element.direction),
        across=None if element.across is None else triple(element.across),
        diameter=element.diameter, length=element.length, width=element.width,
        angle_deg=element.angle_deg,
    )  # fmt: skip


def _observation(point: MeasuredPoint, taken_utc: str) -> json_schema.ObservationPart:
    reference = point.reference_spots
    return json_schema.ObservationPart(
        number=point.number, feature=point.feature, taken_utc=taken_utc, time_s=point.time_s,
        first_frame=point.first_frame, last_frame=point.last_frame, n_frames=point.n_frames,
        tip_world=triple(point.tip_world), random_covariance=_matrix(point.random_covariance),
        direction_world=triple(point.direction), tip_radius=point.tip_radius,
        rotation_world_from_probe=_matrix(point.rotation_world_from_probe),
        spots=_spots(point.spots), chi2_per_dof=point.chi2_per_dof, approach=point.approach,
        reference_spots=None if reference is None else _spots(reference),
    )  # fmt: skip


def _is_same(told: json_schema.ObservationPart, point: MeasuredPoint) -> bool:
    """Return whether every number of a point was read back bit for bit."""
    pairs = [
        (np.array(told.tip_world), point.tip_world),
        (np.array(told.random_covariance), point.random_covariance),
        (np.array(told.direction_world), point.direction),
        (np.array(told.rotation_world_from_probe), point.rotation_world_from_probe),
        (np.array(told.spots, dtype=np.float64), point.spots),
    ]
    if point.reference_spots is not None:
        pairs.append((np.array(told.reference_spots, dtype=np.float64), point.reference_spots))
    return told.number == point.number and all(
        np.array_equal(found, wanted, equal_nan=True) for found, wanted in pairs
    )


def _matrix(array: Float) -> json_schema.Matrix:
    a, b, c = (triple(row) for row in array)
    return (a, b, c)


def _spots(spots: Float) -> json_schema.Spots:
    return tuple(tuple((_seen(u), _seen(v)) for u, v in camera) for camera in spots.tolist())


def _seen(value: float) -> float | None:
    return value if math.isfinite(value) else None


JSON = Exporter(
    name="json",
    title="JSON with raw observations",
    purpose="your own programs; everything, with raw observations",
    suffixes=(".json",),
    profile="", contents=_contents, differences=_differences, preview=tables.exact_preview,
)  # fmt: skip

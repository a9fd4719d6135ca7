"""A job put together by hand, as exporters get it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ocmm_core.export import write_report
from ocmm_core.export.report import Instrument, Profile, ReportData, reported_features
from ocmm_core.features.shapes import NominalFeature, Shape, element, make_fit
from ocmm_core.geometry import Float, RigidTransform
from ocmm_core.inspection.evaluation import FeatureState, FeatureView, JobView
from ocmm_core.inspection.plan import Plan
from ocmm_core.measuring import Climate, MeasuredPoint
from ocmm_core.storage import JobHead
from ocmm_core.tolerances.decisions import CharacteristicResult, Verdict
from ocmm_core.tolerances.zones import Characteristic

# A quarter turn about z and a shift: part x is world y, part y is minus world x.
PART_FROM_WORLD = RigidTransform(
    np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([0.0, 0.0, -1000.0])
)
STATE = "VALID 0123456789ab"
TIP = "VALID standard/6 mm 0123456789ab due 2027-01-01"
PLATE = "plate 0123456789ab"
COLD = "No temperature compensation (no temperatures given)."

HEAD = JobHead(
    job_uuid="0d2b2d3c-55b5-4f2c-9b5e-0c8f6c0d1a11",
    created_utc="2026-03-02T07:08:09.123456+00:00",
    software_version="0.1.0",
    operator="Zoë Müller",
    part="Block",
    serial="=4711",
    plan_text='schema = "ocmm.plan/1"\r\n',
    rig_text='schema = "ocmm.rig/1"\n',
    probe_text='schema = "ocmm.probe/1"\n',
)


def point(
    number: int, feature: str, tip: tuple[float, ...], direction: tuple[float, ...]
) -> MeasuredPoint:
    rng = np.random.default_rng(number)
    spots = rng.normal(500.0, 100.0, (2, 4, 2))
    spots[0, 1] = np.nan
    return MeasuredPoint(
        number=number,
        feature=feature,
        time_s=0.1 * number,
        first_frame=0,
        last_frame=9,
        n_frames=10,
        tip_world=np.array(tip),
        random_covariance=np.eye(3) * 1e-6,
        direction=np.array(direction),
        tip_radius=1.5,
        rotation_world_from_probe=np.eye(3),
        spots=spots,
        chi2_per_dof=1.0,
        approach="trail",
    )


def feature(
    name: str, shape: Shape, points: list[MeasuredPoint], geometry: Float | None,
    residuals: list[float],
) -> FeatureView:  # fmt: skip
    fit = None
    if geometry is not None:
        fit = make_fit(shape, geometry, np.zeros((12, 3 * len(points))), np.array(residuals))
    state = FeatureState.DONE if fit else FeatureState.PENDING
    return FeatureView(name, shape, len(points), state, tuple(points), fit, "")


def result(
    name: str, measured: float | None, verdict: Verdict, *, kind: str = "diameter",
    nominal: float = 20.0, features: tuple[str, ...] = ("BORE 1",),
) -> CharacteristicResult:  # fmt: skip
    return CharacteristicResult(
        name=name,
        kind=kind,
        features=features,
        nominal=nominal,
        lower=-0.01,
        upper=0.02,
        measured=measured,
        deviation=None if measured is None else measured - nominal,
        uncertainty=None if measured is None else 0.00384,
        verdict=verdict,
    )


NOMINALS = [
    NominalFeature(
        name="BORE 1", shape=Shape.CIRCLE, points=4, point=(1.25, 0.0, 0.0), diameter=20.0,
        direction=(0.0, 0.0, 2.0), side="inner",
    ),
    NominalFeature(name="FACE", shape=Shape.PLANE, points=3, point=(7.0, -40.0, 0.0)),
    NominalFeature(
        name="BALL", shape=Shape.SPHERE, points=5, point=(100.0, -0.00001, 50.0), diameter=19.989
    ),
]  # fmt: skip

RESULTS = (
    result("Bore diameter", 20.00246, Verdict.CONFORM),
    result("Bore too big", 20.0312, Verdict.NOT_CONFORM),
    result("Bore too small", 19.9812, Verdict.NOT_CONFORM),
    result("Bore in doubt", 20.0195, Verdict.NOT_PROVEN),
    result("Ball diameter", None, Verdict.NOT_MEASURED, features=("BALL",)),
)


def sample_view() -> JobView:
    bore = [
        point(1, "BORE 1", (8.5, 0.0, 1000.0), (-1.0, 0.0, 0.0)),
        point(2, "BORE 1", (-8.5, 0.0, 1000.0), (1.0, 0.0, 0.0)),
        point(3, "BORE 1", (0.0, 8.5, 1000.0), (0.0, -1.0, 0.0)),
        point(4, "BORE 1", (-0.00001, -8.5, 999.99999), (0.0, 1.0, -1e-9)),
    ]
    face = [point(5 + i, "FACE", (40.0 * i, 7.0, 1001.5), (0.0, 0.0, 1.0)) for i in range(3)]
    round_bore = element([-0.00001, 1.25, 1000.0], [0.0, 0.0, 1.0], 10.00123)
    flat_face = element([40.0, 7.0, 1000.0], [0.0, 0.0, 1.0])
    return JobView(
        job="Block_07",
        part="Block",
        operator=HEAD.operator,
        features=(
            feature("BORE 1", Shape.CIRCLE, bore, round_bore, [0.002, -0.001, 0.002, -0.001]),
            feature("FACE", Shape.PLANE, face, flat_face, [0.0] * 3),
            feature("BALL", Shape.SPHERE, [], None, []),
        ),
        active="BALL",
        characteristics=RESULTS,
        refusal=None,
        complete=False,
        requirements=None,
        temperature=COLD,
    )


def plan_of(view: JobView, nominals: list[NominalFeature]) -> Plan:
    return Plan(
        schema="ocmm.plan/1",
        unit="mm",
        name="BLOCK",
        part="Block",
        features=nominals,
        characteristics=[asked(item) for item in view.characteristics],
    )


def asked(item: CharacteristicResult) -> Characteristic:
    return Characteristic(
        name=item.name, kind=item.kind, features=list(item.features), nominal=item.nominal,
        lower=item.lower, upper=item.upper,
    )  # fmt: skip


def sample_report(
    view: JobView | None = None,
    *,
    frame: RigidTransform | None = PART_FROM_WORLD,
    nominals: list[NominalFeature] | None = None,
    head: JobHead = HEAD,
) -> ReportData:
    view = view if view is not None else sample_view()
    points = tuple(point for item in view.features for point in item.points)
    plan = plan_of(view, NOMINALS if nominals is None else nominals)
    return ReportData(
        view,
        head,
        plan,
        frame,
        reported_features(view, plan, frame),
        calibration=Instrument(STATE, f"{STATE}{'0' * 52}"),
        probe=Instrument(TIP),
        reference=Instrument(PLATE),
        climate=Climate(),
        observations=points,
        taken_utc={
            p.number: f"2026-03-02T07:{10 + p.number // 60}:{p.number % 60:02d}.000000+00:00"
            for p in points
        },
    )


def with_name(data: ReportData, where: str, name: str) -> ReportData:
    """Return the report with a name somewhere in it."""
    view = data.view
    if where == "job":
        return replace(data, view=replace(view, job=name))
    if where == "feature":
        bad = replace(data.features[1], seen=replace(data.features[1].seen, name=name))
        return replace(data, features=(data.features[0], bad, *data.features[2:]))
    if where == "characteristic":
        items = list(view.characteristics)
        items[2] = replace(items[2], name=name)
        return replace(data, view=replace(view, characteristics=tuple(items)))
    if where == "operator":
        return replace(data, head=replace(data.head, operator=name))
    return replace(data, head=replace(data.head, serial=name))


def write_incomplete(
    data: ReportData | Sequence[ReportData],
    formats: Sequence[str],
    folder: Path,
    profile: Profile | None = None,
) -> tuple[Path, ...]:
    """Write reports as `write_report`, of the sample job with a missing value."""
    return write_report(data, formats, folder, profile, incomplete=True)

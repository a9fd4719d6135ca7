"""Points, features and report as CSV files for PolyWorks|Inspector.

Pure ASCII, CR LF, decimal point in every locale, millimetres with four decimals, unit vectors with
six. Names are checked, never quoted or escaped: a name that would need it is refused. The files are
our own proposal; no public description of PolyWorks' text import was found (see the decisions).

Points are compensated surface points; their vector leaves the material, so that the ball centre is
``xyz + radius * ijk``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ocmm_core.errors import StorageError
from ocmm_core.export.files import write_together
from ocmm_core.features.nominal import NominalFeature
from ocmm_core.features.shapes import MINIMUM_POINTS, Fit, Shape
from ocmm_core.geometry import Float, RigidTransform, unit
from ocmm_core.inspection.plan import NAME_PATTERN
from ocmm_core.inspection.view import FeatureView, JobView
from ocmm_core.tolerances.result import CharacteristicResult, Verdict

FEATURES_HEADER = (
    "Name,Type,Component,X,Y,Z,I,J,K,Diameter,Length,Angle,Form,RMS,NbPoints,CoordinateSystem,Unit"
)
REPORT_HEADER = (
    "Name,Control,Nominal,Measured,Deviation,TolLower,TolUpper,Test,OutTol,Uncertainty,Unit,"
    "Calibration,Temperature,Probe,Reference"
)

_NO_VECTOR = ["", "", ""]


def export_polyworks(
    job: JobView,
    nominals: Sequence[NominalFeature],
    directory: Path | str,
    *,
    T_part_from_world: RigidTransform | None,
    calibration: str,
    temperature: str = "",
    probe: str = "",
    reference: str = "",
) -> tuple[Path, Path, Path]:
    """Write ``<job>_points.csv``, ``<job>_features.csv`` and ``<job>_report.csv``.

    The files of a job that proves nothing begin with ``<job>_UNCALIBRATED``.

    Parameters
    ----------
    job
        The job as it stands; features without a fit have no measured row, characteristics
        without a value have empty cells and the test ``Fail``.
    nominals
        The features of the plan, in the part frame.
    directory
        Where to write; made if it is missing. Files of the same name are replaced.
    T_part_from_world
        The alignment. Without it points and measured features stay in the world frame, and the
        column ``CoordinateSystem`` says so.
    calibration
        State and hash of the calibration of the cameras, ASCII, for the report.
    temperature
        Temperatures and switches of their compensation, ASCII without commas, for the report.
    probe
        State, names, hash and due date of probe and tip, likewise.
    reference
        Name and hash of the reference body, likewise; empty without one.

    Returns
    -------
    tuple
        The three paths: points, features, report.

    Raises
    ------
    StorageError
        A name or a number cannot go into the files, a feature has no nominal, or the folder
        cannot be written; then none of the three files is written.
    """
    _check_name("job", job.job)
    frame = RigidTransform.identity() if T_part_from_world is None else T_part_from_world
    system = "World" if T_part_from_world is None else "Part"
    by_name = {nominal.name: nominal for nominal in nominals}
    points: list[list[str]] = []
    features = [FEATURES_HEADER.split(",")]
    for feature in job.features:
        _check_name("feature", feature.name)
        if feature.name not in by_name:
            raise StorageError(
                "export.nominal",
                f"Feature {feature.name!r} of the job is not in the plan.",
                "Export with the plan that the job was measured with.",
            )
        points += _point_rows(feature, frame)
        features.append(_nominal_row(by_name[feature.name]))
        if feature.fit is not None:
            features.append(_measured_row(feature, feature.fit, frame, system))
    report = [REPORT_HEADER.split(",")]
    for result in job.characteristics:
        _check_name("characteristic", result.name)
        report.append([*_report_row(result), calibration, temperature, probe, reference])
    folder = Path(directory)
    stem = f"{job.job}_UNCALIBRATED" if job.unproven else job.job
    paths = (
        folder / f"{stem}_points.csv",
        folder / f"{stem}_features.csv",
        folder / f"{stem}_report.csv",
    )
    tables = (points, features, report)
    write_together({path: _csv(table) for path, table in zip(paths, tables, strict=True)})
    return paths


def _point_rows(feature: FeatureView, frame: RigidTransform) -> list[list[str]]:
    return [
        [
            f"{feature.name}.{index:03d}",
            *_numbers(feature.name, frame.apply(point.surface_world), 4),
            *_numbers(feature.name, frame.rotation @ point.direction, 6),
        ]
        for index, point in enumerate(feature.points, start=1)
    ]


def _nominal_row(nominal: NominalFeature) -> list[str]:
    # A sphere has no direction, whatever the plan's default says.
    directed = nominal.shape is not Shape.SPHERE
    return [
        nominal.name, nominal.shape.value, "Nominal",
        *(_number(nominal.name, value, 4) for value in nominal.point),
        *(_vector(nominal.name, nominal.direction) if directed else _NO_VECTOR),
        _number(nominal.name, nominal.diameter, 4) if nominal.diameter else "",
        "", "", "", "", "", "Part", "mm",
    ]  # fmt: skip


def _measured_row(feature: FeatureView, fit: Fit, frame: RigidTransform, system: str) -> list[str]:
    name, count = feature.name, len(feature.points)
    # As few points as the shape needs lie on it whatever they are: that is no measure of form.
    has_form = count > MINIMUM_POINTS[fit.shape]
    return [
        name, fit.shape.value, "Measured",
        *_numbers(name, frame.apply(fit.point), 4),
        *(_vector(name, frame.rotation @ fit.direction) if fit.direction.any() else _NO_VECTOR),
        _number(name, 2.0 * fit.radius, 4) if fit.radius else "",
        "", "",
        _number(name, fit.form, 4) if has_form else "",
        _number(name, fit.rms, 4) if has_form else "",
        str(count), system, "mm",
    ]  # fmt: skip


def _report_row(result: CharacteristicResult) -> list[str]:
    name = result.name
    measured, deviation, uncertainty = result.measured, result.deviation, result.uncertainty
    cells = ["", "", "Fail", "", ""]
    if (
        result.verdict is not Verdict.NOT_MEASURED
        and measured is not None
        and deviation is not None
        and uncertainty is not None
    ):
        cells = [
            _number(name, measured, 4),
            _number(name, deviation, 4),
            "Pass" if result.verdict is Verdict.CONFORM else "Fail",
            _number(name, max(deviation - result.upper, result.lower - deviation, 0.0), 4),
            _number(name, uncertainty, 4),
        ]
    return [
        name, result.kind.capitalize(), _number(name, result.nominal, 4), *cells[:2],
        _number(name, result.lower, 4), _number(name, result.upper, 4), *cells[2:], "mm",
    ]  # fmt: skip


def _vector(name: str, direction: Float | Sequence[float]) -> list[str]:
    return _numbers(name, unit(np.asarray(direction, dtype=np.float64)), 6)


def _numbers(name: str, values: Float, decimals: int) -> list[str]:
    return [_number(name, float(value), decimals) for value in values]


def _number(name: str, value: float, decimals: int) -> str:
    if not math.isfinite(value):
        raise StorageError(
            "export.not_finite",
            f"A value of {name!r} is {value}, which is not a number that can be reported.",
            "Measure that feature again.",
        )
    # Python's format knows no locale; adding zero to what is rounded takes the sign from -0.0.
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def _check_name(kind: str, name: str) -> None:
    if not NAME_PATTERN.fullmatch(name):
        raise StorageError(
            "export.name",
            f"The {kind} name {name!r} cannot go into a PolyWorks file.",
            "Use 1 to 60 letters, digits, spaces, '_', '.' or '-', beginning with a letter, a "
            "digit or '_'.",
        )


def _csv(rows: Sequence[Sequence[str]]) -> bytes:
    return "".join(",".join(row) + "\r\n" for row in rows).encode("ascii")

"""Accepted points of a job for CAD programs: XYZ, ASC and PLY; with covariance JSON and Parquet.

Places are compensated surface points with the unit vector from the material to the probe, in the
frame of the report. A point without that vector is a ball centre: marked, and not in XYZ. Features
have neither deleted nor refused points; held ones, outliers and points that command a fit are left
out and counted in the head of each file.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ocmm_core.export import report
from ocmm_core.geometry import Float, Int
from ocmm_core.measuring import COVERAGE_FACTOR
from ocmm_core.names import ascii_name, ascii_text

SCHEMA = "ocmm.points/1"
_PLACE = ("X", "Y", "Z", "I", "J", "K")
_COVARIANCE = {
    "Cxx": (0, 0), "Cxy": (0, 1), "Cxz": (0, 2), "Cyy": (1, 1), "Cyz": (1, 2), "Czz": (2, 2),
}  # fmt: skip
_VERTEX = np.dtype([
    ("place", "<f8", 3), ("normal", "<f4", 3), ("u", "<f4"), ("number", "<i4"), ("feature", "<i4"),
])  # fmt: skip
_PROPERTIES = (
    "double x", "double y", "double z", "float nx", "float ny", "float nz", "float u",
    "int number", "int feature",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class DensePoints:
    """N accepted points in the frame of the report, by feature, each in the order of probing."""

    features: tuple[str, ...]
    numbers: Int
    """`features`, `numbers`: (N,), of each point."""
    places: Float
    """(N, 3), mm: compensated surface points; ball centres without a normal."""
    normals: Float
    """(N, 3), unit, from the material to the probe; zero if unknown."""
    covariances: Float
    """(N, 3, 3), mm^2; NaN if unknown."""
    taken_utc: tuple[str, ...]
    """(N,): empty if unknown."""

    @property
    def are_centres(self) -> NDArray[np.bool_]:
        """Return which points, (N,), are ball centres."""
        return np.asarray(~self.normals.any(axis=1))

    def chosen(self, rows: Int) -> DensePoints:
        """Return the points of these rows."""
        return DensePoints(
            tuple(self.features[row] for row in rows.tolist()), self.numbers[rows],
            self.places[rows], self.normals[rows], self.covariances[rows],
            tuple(self.taken_utc[row] for row in rows.tolist()),
        )  # fmt: skip

    @property
    def uncertainties(self) -> Float:
        """Return U (k = 2), mm, (N,), NaN if unknown: along the normal; centres: worst axis."""
        found = np.einsum("ni,nij,nj->n", self.normals, self.covariances, self.normals)
        for row in np.flatnonzero(self.are_centres & np.isfinite(found)):
            found[row] = np.linalg.eigvalsh(self.covariances[row])[-1]
        return np.asarray(COVERAGE_FACTOR * np.sqrt(np.maximum(found, 0.0)))


def accepted_points(data: report.ReportData) -> DensePoints:
    """Return the accepted points of a job; StorageError if a feature has an invalid name."""
    refused = set().union(*_left_out(data).values())
    found = [
        (report.check_name("feature", feature.name), point)
        for feature in data.features
        for point in feature.seen.points
        if point.number not in refused
    ]
    unknown, R = np.full((3, 3), np.nan), data.frame.rotation
    covariances = [data.covariances.get(point.number, unknown) for _, point in found]
    return DensePoints(
        tuple(name for name, _ in found),
        np.array([point.number for _, point in found], dtype=np.int64),
        data.frame.apply(np.array([point.surface_world for _, point in found]).reshape(-1, 3)),
        np.array([point.direction for _, point in found]).reshape(-1, 3) @ R.T,
        R @ np.array(covariances).reshape(-1, 3, 3) @ R.T,
        tuple(data.taken_utc.get(point.number, "") for _, point in found),
    )


def _left_out(data: report.ReportData) -> dict[str, set[int]]:
    """Return the numbers of points that do not go out, by reason."""
    held = set(data.view.held)
    suspect = {
        number
        for one in (feature.seen for feature in data.features)
        for number in (*one.outliers, *(one.commanding.numbers if one.commanding else ()))
    }
    return {"held back": held, "suspect": suspect - held, "taken back": set(data.annulled)}


def head_lines(data: report.ReportData, units: report.Units) -> list[str]:
    """Return the head of a file, from the verdict on the part to the points left out; ASCII."""
    left = ", ".join(f"{len(numbers)} {why}" for why, numbers in _left_out(data).items())
    return [
        f"part verdict: {ascii_text(data.part.headline)}",
        f"job: {ascii_text(data.job)}",
        f"state: {data.state_words or 'no restriction'}",
        f"unit: {units.lengths}",
        f"frame: {data.system}",
        f"points left out: {left}",
    ]


def _table(data: report.ReportData, points: DensePoints, units: report.Units) -> report.ReportTable:
    table, accepted = report.points_table(data, units), set(points.numbers.tolist())
    at = table.columns.index("Number")
    return replace(table, rows=tuple(row for row in table.rows if row[at] in accepted))


def _preview(
    jobs: Sequence[report.ReportData], profile: report.Profile
) -> tuple[report.ReportTable, ...]:
    return tuple(
        table
        for one in jobs
        for table in (report.head_table(one), _table(one, accepted_points(one), profile.units))
    )


def _heads(
    data: report.ReportData, points: DensePoints, units: report.Units, kind: str
) -> list[str]:
    centres = np.count_nonzero(points.are_centres)
    return [
        *head_lines(data, units),
        f"ball centres: {centres} {'left out' if kind == 'xyz' else 'with the vector 0 0 0'}",
        "vector: from the material to the probe, ball centre = place + radius * vector",
        "x y z" if kind == "xyz" else "x y z i j k",
    ]


def _cloud(jobs: Sequence[report.ReportData], profile: report.Profile) -> dict[str, bytes]:
    (data,) = jobs
    points, units = accepted_points(data), profile.units
    files = {f"{data.stem}_points.ply": _ply(data, points, units)}
    every = [
        [cell for cell in row if isinstance(cell, report.Number)]
        for row in _table(data, points, units).chosen(_PLACE).rows
    ]
    surface = [row[:3] for row in every if any(cell.value for cell in row[3:])]
    for kind, rows in (("xyz", surface), ("asc", every)):
        lines = [f"# {line}" for line in _heads(data, points, units, kind)]
        lines += [" ".join(one.text() for one in row) for row in rows]
        files[f"{data.stem}_points.{kind}"] = "\r\n".join([*lines, ""]).encode("ascii")
    return files


def _ply(data: report.ReportData, points: DensePoints, units: report.Units) -> bytes:
    factor = units.scaled(1.0)
    names = {name: index for index, name in enumerate(dict.fromkeys(points.features))}
    vertices = np.zeros(len(points.features), dtype=_VERTEX)
    vertices["place"], vertices["normal"] = points.places * factor, points.normals
    vertices["u"], vertices["number"] = points.uncertainties * factor, points.numbers
    vertices["feature"] = [names[name] for name in points.features]
    lines = [
        "ply", "format binary_little_endian 1.0",
        *(f"comment {line}" for line in _heads(data, points, units, "ply")[:-1]),
        "comment u: expanded uncertainty (k = 2) along the vector, nan if unknown",
        *(f"comment feature {index}: {ascii_name(name)}" for name, index in names.items()),
        f"element vertex {len(vertices)}",
        *(f"property {one}" for one in _PROPERTIES), "end_header",
    ]  # fmt: skip
    return "".join(f"{line}\n" for line in lines).encode("ascii") + vertices.tobytes()


def _is_cloud(points: DensePoints, units: report.Units, content: bytes) -> bool:
    """Return whether a cloud, read back, has the points of the job."""
    wanted = np.hstack([points.places * units.scaled(1.0), points.normals])
    if content.startswith(b"ply"):
        vertices = np.frombuffer(content.partition(b"end_header\n")[2], dtype=_VERTEX)
        read = np.hstack([vertices["place"], vertices["normal"]])
        return read.shape == wanted.shape and np.allclose(read, wanted, rtol=0.0, atol=1e-6)
    lines = [line.split() for line in content.decode("ascii").splitlines() if line[0] != "#"]
    if b"# x y z\r" in content:
        wanted = wanted[~points.are_centres, :3]
    most = 0.501 * 10.0 ** -np.array([units.length_decimals] * 3 + [units.vector_decimals] * 3)
    read = np.array(lines, dtype=np.float64).reshape(-1, wanted.shape[1])
    return len(read) == len(wanted) and bool(np.all(abs(read - wanted) <= most[: len(read.T)]))


def _checked(
    contents: Callable[[Sequence[report.ReportData], report.Profile], dict[str, bytes]],
    is_same: Callable[[DensePoints, report.Units, bytes], bool],
) -> Callable[[Sequence[report.ReportData], report.Profile, Mapping[str, bytes]], list[str]]:
    """Return the check of a format: files are as written, and their reader finds the points."""

    def differences(
        jobs: Sequence[report.ReportData], profile: report.Profile, files: Mapping[str, bytes]
    ) -> list[str]:
        points = accepted_points(*jobs)
        return [
            f"{name}: its points are not those of the job."
            for name, wanted in contents(jobs, profile).items()
            if files[name] != wanted or not is_same(points, profile.units, files[name])
        ]

    return differences


def _records(points: DensePoints, units: report.Units) -> list[dict[str, Any]]:
    """Return the points with covariance; None for unknown numbers."""
    factor = units.scaled(1.0)
    numbers = {
        **dict(zip("XYZ", (points.places * factor).T, strict=True)),
        **dict(zip("IJK", np.where(points.are_centres, np.nan, points.normals.T), strict=True)),
        **{name: points.covariances[:, *at] * factor**2 for name, at in _COVARIANCE.items()},
        "U": points.uncertainties * factor,
    }
    return [
        {
            "Number": number, "Feature": name, "Kind": "ball centre" if is_centre else "surface",
            "TakenUtc": taken_utc,
            **{key: None if np.isnan(one) else one for key, one in zip(numbers, row, strict=True)},
        }
        for number, name, is_centre, taken_utc, row in zip(
            points.numbers.tolist(), points.features, points.are_centres.tolist(),
            points.taken_utc, np.array(list(numbers.values())).T.tolist(), strict=True,
        )
    ]  # fmt: skip


def _covariances(jobs: Sequence[report.ReportData], profile: report.Profile) -> dict[str, bytes]:
    (data,) = jobs
    records = _records(accepted_points(data), profile.units)
    head = dict(line.split(": ", 1) for line in head_lines(data, profile.units))
    content = msgspec.json.encode({"schema": SCHEMA, **head, "points": records})
    files = {f"{data.stem}_points.json": msgspec.json.format(content, indent=1) + b"\n"}
    if importlib.util.find_spec("pyarrow") is not None:
        import pyarrow
        import pyarrow.parquet

        texts = [(name, pyarrow.string()) for name in ("Feature", "Kind", "TakenUtc")]
        floats = [(name, pyarrow.float64()) for name in (*_PLACE, *_COVARIANCE, "U")]
        schema = pyarrow.schema([("Number", pyarrow.int64()), *texts, *floats], metadata=head)
        sink = pyarrow.BufferOutputStream()
        pyarrow.parquet.write_table(pyarrow.Table.from_pylist(records, schema), sink)
        files[f"{data.stem}_points.parquet"] = bytes(sink.getvalue())
    return files


def _are_records(points: DensePoints, units: report.Units, content: bytes) -> bool:
    """Return whether JSON or Parquet, read back, has the points of the job."""
    if content.startswith(b"{"):
        read = msgspec.json.decode(content)["points"]
    else:
        import pyarrow
        import pyarrow.parquet

        read = pyarrow.parquet.read_table(pyarrow.BufferReader(content)).to_pylist()
    return bool(read == _records(points, units))


CLOUD = report.Exporter(
    name="cloud",
    title="Point cloud (XYZ, ASC, PLY)",
    purpose="CAD and mesh programs: accepted points with vector, U in PLY",
    suffixes=("_points.xyz", "_points.asc", "_points.ply"),
    profile="unit and digits",
    contents=_cloud, differences=_checked(_cloud, _is_cloud), preview=_preview, batch=False,
)  # fmt: skip
COVARIANCES = report.Exporter(
    name="points",
    title="Points with U (JSON, Parquet)",
    purpose="own programs: accepted points with covariance and U; Parquet with the extra `shop`",
    suffixes=("_points.json", "_points.parquet"),
    profile="unit", contents=_covariances, differences=_checked(_covariances, _are_records),
    preview=_preview, batch=False,
)  # fmt: skip

"""Vertices of meshes and clouds: by their formats, with an account, or refused."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.geometry import Float
from ocmm_core.tables import read_points_file

POINTS = np.array([[1.5, -2.0, 30.0], [4.0, 5.0, 6.0], [7.25, 8.0, 9.125], [0.5, 0.25, -1.0]])
FACES = [(0, 1, 2), (0, 2, 3)]


def _rows(points: Float, start: str = "", end: str = "") -> str:
    return "".join(f"{start}{x} {y} {z}{end}\n" for x, y, z in points.tolist())


def _ply(form: str) -> bytes:
    head = (
        f"ply\nformat {form} 1.0\ncomment unit mm\nelement vertex 4\nproperty uchar red\n"
        "property double z\nproperty double y\nproperty double x\nelement face 2\n"
        "property list uchar int vertex_indices\nend_header\n"
    ).encode()
    if form == "ascii":
        rows = "".join(f"7 {z} {y} {x}\n" for x, y, z in POINTS.tolist())
        return head + (rows + "3 0 1 2\n3 0 2 3\n").encode()
    order = "<" if form == "binary_little_endian" else ">"
    body = b"".join(struct.pack(f"{order}B3d", 7, z, y, x) for x, y, z in POINTS.tolist())
    return head + body + b"".join(struct.pack(f"{order}B3i", 3, *face) for face in FACES)


def _stl() -> bytes:
    body = b"".join(
        struct.pack("<3f9fH", 0, 0, 1, *POINTS[list(face)].ravel(), 0) for face in FACES
    )
    return b"solid made".ljust(80) + struct.pack("<I", 2) + body


def _stl_text() -> bytes:
    facets = "".join(
        "facet normal 0 0 1\nouter loop\n"
        + _rows(POINTS[list(face)], "vertex ")
        + "endloop\nendfacet\n"
        for face in FACES
    )
    return f"solid a\n{facets}endsolid a\n".encode()


def _pcd(kind: str) -> bytes:
    head = (
        "# .PCD v.7\nVERSION .7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n"
        "COUNT 1 1 1 1\nWIDTH 5\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\n"
        f"POINTS 5\nDATA {kind}\n"
    ).encode()
    if kind == "ascii":
        return head + (_rows(POINTS, end=" 9") + "nan nan nan 9\n").encode()
    rows = np.column_stack([np.vstack([POINTS, [np.nan] * 3]), np.full(5, 9.0)])
    return head + rows.astype("<f4").tobytes()


FILES = {
    "a.ply": _ply("ascii"),
    "l.ply": _ply("binary_little_endian"),
    "b.ply": _ply("binary_big_endian"),
    "a.obj": (
        "# made\no part\n" + _rows(POINTS, "v ") + "vn 0 0 1\nf 1 2 3\nf 1//1 3//1 4//1\n"
    ).encode(),
    "renamed.txt": (_rows(POINTS, "v ", " 0.1 0.2 0.3") + "f 1 2 3\n").encode(),
    "a.off": ("OFF\n4 2 0\n" + _rows(POINTS) + "3 0 1 2\n3 0 2 3\n").encode(),
    "c.off": ("COFF 4 2 0\n" + _rows(POINTS, end=" 9 9 9 9") + "3 0 1 2\n3 0 2 3\n").encode(),
    "b.stl": _stl(),
    "a.stl": _stl_text(),
    "a.pcd": _pcd("ascii"),
    "b.pcd": _pcd("binary"),
}


@pytest.mark.parametrize("name", FILES)
def test_vertices_alone_are_points(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    file.write_bytes(FILES[name])
    found = read_points_file(file)
    assert found.points == pytest.approx(POINTS)
    # Each has faces, shared corners or points without coordinates.
    assert found.account.skipped
    assert " read" in found.account.sentences()[0]


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.ply", FILES["a.ply"].replace(b"vertex 4", b"vertex 9")),
        ("l.ply", FILES["l.ply"][:-60]),
        ("x.ply", b"1 2 3\n"),
        ("a.off", b"OFF\n9 2 0\n1 2 3\n"),
        ("n.off", b"OFF\n2 0 0\n1 2 3 4\n1 2 3 4\n"),
        ("b.stl", FILES["b.stl"][:-10]),
        ("a.pcd", FILES["a.pcd"].replace(b"POINTS 5", b"POINTS 7")),
        ("c.pcd", FILES["b.pcd"].replace(b"DATA binary", b"DATA binary_compressed")),
        ("w.obj", b"v 1 2 3 0.5\nf 1 1 1\n"),
        ("t.obj", b"v 1 2\nf 1 1 1\n"),
        ("u.obj", b"# units: furlongs\nv 1 2 3\nf 1 1 1\n"),
        ("n.obj", b"v 1 2 x\nf 1 1 1\n"),
    ],
)
def test_damaged_meshes_are_refused(tmp_path: Path, name: str, content: bytes) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_points_file(file)
    assert name in caught.value.what


def test_cut_meshes_never_give_other_points(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    for name, content in FILES.items():
        for _ in range(25):
            cut = bytearray(content[: int(rng.integers(len(content)))])
            for place in rng.integers(0, max(len(cut), 1), 2).tolist():
                cut[place : place + 1] = bytes([int(rng.integers(256))])
            (tmp_path / name).write_bytes(bytes(cut))
            try:
                found = read_points_file(tmp_path / name).points
            except InputError:
                continue
            assert np.isfinite(found).all()

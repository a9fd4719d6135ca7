"""A part as bytes: read back unchanged, and every false file is refused with a sentence."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.part_model import (
    LARGEST_MODEL,
    PartModel,
    model_from_bytes,
    model_to_bytes,
    read_model_file,
    write_model_file,
)
from tests.part_models import block_part

FRONT = struct.Struct("<8sII32s")


def same(one: PartModel, other: PartModel) -> None:
    for field in ("vertices", "triangles", "triangle_faces", "edge_points", "edge_starts"):
        np.testing.assert_array_equal(getattr(one, field), getattr(other, field))
    # Normals are kept with four bytes each: 6e-8, and the length is made 1 again.
    np.testing.assert_allclose(one.normals, other.normals, atol=1e-6)
    np.testing.assert_array_equal(one.edge_faces, other.edge_faces)
    assert (one.source_name, one.source_sha256) == (other.source_name, other.source_sha256)
    for a, b in zip(one.faces, other.faces, strict=True):
        words = ("number", "kind", "name", "layer", "colour", "outward", "feature")
        assert [getattr(a, word) for word in words] == [getattr(b, word) for word in words]
        assert a.spline is not None
        assert b.spline is not None
        for part in ("poles", "weights", "knots_u", "knots_v"):
            np.testing.assert_array_equal(getattr(a.spline, part), getattr(b.spline, part))
        for loop, kept in zip(a.loops, b.loops, strict=True):
            np.testing.assert_array_equal(loop, kept)


def test_a_part_comes_back_as_it_was(tmp_path: Path) -> None:
    part = block_part(cells=4)
    words = replace(part.faces[0], name="A", layer="7", colour="#a0b0c0", feature="TOP")
    part = replace(part, faces=(words, *part.faces[1:]))
    write_model_file(tmp_path / "a.part", part)
    back = read_model_file(tmp_path / "a.part")
    same(part, back)
    assert model_to_bytes(back) == model_to_bytes(part)
    assert back.vertices.dtype == np.float64
    assert back.triangles.dtype == np.int32


def test_any_bit_that_flipped_is_seen() -> None:
    content = model_to_bytes(block_part())
    rng = np.random.default_rng(3)
    for at in rng.integers(0, len(content), 200):
        damaged = bytearray(content)
        damaged[at] ^= 1 << int(rng.integers(8))
        with pytest.raises(InputError):
            model_from_bytes(bytes(damaged), "a file")


@pytest.mark.parametrize("length", [0, 7, 47, 48, 300, -1])
def test_a_part_that_ends_too_early_is_refused(length: int) -> None:
    with pytest.raises(InputError, match="a file: the part in it cannot be used"):
        model_from_bytes(model_to_bytes(block_part())[:length], "a file")


def forged(change: Callable[[dict[str, Any]], None], more: bytes = b"") -> bytes:
    """Return a part with a head that was changed, and with the hash that belongs to it."""
    content = model_to_bytes(block_part())
    mark, version, length, _ = FRONT.unpack_from(content)
    head = msgspec.json.decode(content[FRONT.size : FRONT.size + length])
    change(head)
    said = msgspec.json.encode(head)
    body = said + content[FRONT.size + length :] + more
    return FRONT.pack(mark, version, len(said), hashlib.sha256(body).digest()) + body


@pytest.mark.parametrize(
    "change",
    [
        lambda head: head.update(vertices=10**12),
        lambda head: head.update(vertices=-1),
        lambda head: head.update(vertices=3_999_999),
        lambda head: head.update(triangles=0),
        lambda head: head.update(edges=-1),
        lambda head: head.update(deflection_mm=0.0),
        lambda head: head.update(source_name="../../a.step"),
        lambda head: head.update(source_sha256="x"),
        lambda head: head.update(faces=[]),
        lambda head: head.update(more=1),
        lambda head: head["faces"][0].update(colour="red"),
        lambda head: head["faces"][0].update(name="n" * 300),
        lambda head: head["faces"][0].update(loops=[10**9] * 50),
        lambda head: head["faces"][0].update(spline=[10**6, 10**6, 1, 1]),
        lambda head: head["faces"][0].update(spline=[2, 2, 0, 2]),
        lambda head: head["faces"][0].update(spline=None),
    ],
)
def test_a_head_that_lies_is_refused(change: Callable[[dict[str, Any]], None]) -> None:
    with pytest.raises(InputError, match=r"part_model|cannot be used"):
        model_from_bytes(forged(change), "a file")


def test_what_follows_the_end_is_refused() -> None:
    with pytest.raises(InputError, match="goes on after its end"):
        model_from_bytes(forged(lambda _: None, b"\0"), "a file")


def test_a_later_version_is_told_as_one() -> None:
    content = bytearray(model_to_bytes(block_part()))
    content[8:12] = struct.pack("<I", 2)
    with pytest.raises(InputError, match="version 2"):
        model_from_bytes(bytes(content), "a file")


def test_more_than_a_job_can_carry_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="32 MB"):
        model_from_bytes(b"OCMMPART" + bytes(LARGEST_MODEL), "a file")
    path = tmp_path / "a.part"
    path.write_bytes(bytes(LARGEST_MODEL + 1))
    with pytest.raises(InputError, match="bytes"):
        read_model_file(path)


def changed(name: str, at: int, value: float) -> PartModel:
    part = block_part()
    array = getattr(part, name).copy()
    array.reshape(-1)[at] = value
    return replace(part, **{name: array})


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (changed("vertices", 4, np.nan), "vertex lies nowhere"),
        (changed("vertices", 4, 1e9), "vertex lies nowhere"),
        (changed("normals", 0, 0.7), "normal has no direction"),
        (changed("triangles", 5, 24), "no such vertex"),
        (changed("triangles", 5, -1), "no such vertex"),
        (changed("triangle_faces", 1, 6), "no such face"),
        (changed("edge_starts", 1, 30), "begin and end|no two points"),
        (changed("edge_faces", 0, 9), "no such face"),
        (changed("edge_points", 0, np.inf), "edge lies nowhere"),
    ],
)
def test_a_part_that_does_not_hold_together_is_neither_written_nor_read(
    part: PartModel, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        model_to_bytes(part)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"weights": np.array([[1.0, 1.0], [0.0, 1.0]])}, "weight"),
        ({"knots_u": np.array([0.0, 1.0, 0.5, 1.0])}, "knots"),
        ({"knots_u": np.array([0.0, 0.0, 0.0, 0.0])}, "knots"),
        ({"degree_u": 3}, "degree"),
        ({"poles": np.full((2, 2, 3), np.nan)}, "lies nowhere"),
        ({"knots_v": np.array([0.0, 0.0, 1e-3, 1e-3])}, "outline leaves"),
    ],
)
def test_a_surface_that_is_none_is_refused(changes: dict[str, Any], words: str) -> None:
    part = block_part()
    spline = part.faces[0].spline
    assert spline is not None
    face = replace(part.faces[0], spline=replace(spline, **changes))
    with pytest.raises(InputError, match=words):
        model_to_bytes(replace(part, faces=(face, *part.faces[1:])))

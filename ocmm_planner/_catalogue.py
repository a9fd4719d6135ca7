"""Catalogue of cameras and lenses, and of files that extend it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import msgspec

from ocmm_core.documents import Document, load_document, resource
from ocmm_core.errors import InputError

SCHEMA = "ocmm.rig_catalogue/1"

Pixels = Annotated[int, msgspec.Meta(ge=16, le=65536)]
Positive = Annotated[float, msgspec.Meta(gt=0.0, le=1e9)]
NotNegative = Annotated[float, msgspec.Meta(ge=0.0, le=1e9)]
Share = Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
Noise = Annotated[float, msgspec.Meta(ge=0.0, le=10.0)]


class CameraType(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One camera that can be bought; lengths in mm, electrons of a pixel.

    ``white_px``: random error of a spot in one exposure apart from photon and read noise;
    ``pattern_px``: the part that stays at its place on the sensor. ``frame_bytes`` are sent for
    each exposure over a link of ``link_bytes_s``, which all cameras use if ``shared_link``.
    """

    id: str
    name: str
    width_px: Pixels
    height_px: Pixels
    pitch: Annotated[float, msgspec.Meta(gt=1e-4, le=0.1)]
    saturation_e: Positive
    read_noise_e: NotNegative
    quantum_efficiency: Share
    rate_hz: Positive
    white_px: Noise
    pattern_px: Noise
    frame_bytes: Positive
    link_bytes_s: Positive
    shared_link: bool
    source: str


class LensType(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One lens that can be bought; mm, ``k1`` and ``k2`` as in a rig document."""

    id: str
    name: str
    focal: Annotated[float, msgspec.Meta(gt=0.5, le=1000.0)]
    stop_min: Positive
    stop_max: Positive
    image_circle: Positive
    k1: float
    k2: float
    source: str


class CatalogueDocument(Document, frozen=True, kw_only=True):
    """Document of cameras and lenses."""

    cameras: tuple[CameraType, ...] = ()
    lenses: tuple[LensType, ...] = ()


def load_catalogue(more: Sequence[Path] = ()) -> tuple[dict[str, CameraType], dict[str, LensType]]:
    """Return cameras and lenses by id: the shipped ones and those of more files.

    InputError if a file is malformed, or an id is given twice.
    """
    cameras: dict[str, CameraType] = {}
    lenses: dict[str, LensType] = {}
    for path in (*sorted(resource("catalogue").glob("*.toml")), *more):
        document = load_document(path, CatalogueDocument, SCHEMA)
        for ids, known in ((document.cameras, cameras), (document.lenses, lenses)):
            twice = [one.id for one in ids if one.id in known]
            if twice or len({one.id for one in ids}) < len(ids):
                raise InputError(
                    "catalogue.duplicate",
                    f"{path}: an id is given twice: {', '.join(twice) or 'in this file'}.",
                    "Give it another id.",
                )
        cameras |= {one.id: one for one in document.cameras}
        lenses |= {one.id: one for one in document.lenses}
    return cameras, lenses

"""Class colours of deviations on the part near touched points (`value_field`), else grey."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QColor

from ocmm_core.geometry import Float
from ocmm_core.part_model import PartModel, PlacedPart
from ocmm_core.rendering import (
    Colours,
    RenderMesh,
    RenderMode,
    RenderStyle,
    ValueField,
    face_colours,
    mesh_of,
    value_field,
)
from ocmm_core.tolerances.decisions import DeviationClass, DeviationPicture
from ocmm_gui.kit import Theme
from ocmm_gui.scene import PartScene, edge_colour, part_colour
from ocmm_gui.views._deviations import limit_colour, surface_colour


@dataclass(frozen=True, slots=True, eq=False)
class FieldRequest:
    """Input of a field: places on the model (k, 3), mm, shares of limits, accepted."""

    points: Float
    shares: Float
    good: NDArray[np.bool_]

    def is_like(self, other: FieldRequest | None) -> bool:
        return (
            other is not None
            and np.array_equal(self.points, other.points)
            and np.array_equal(self.shares, other.shares)
            and np.array_equal(self.good, other.good)
        )


def field_request(picture: DeviationPicture, placed: PlacedPart | None) -> FieldRequest | None:
    """Return the request of a picture; None without a part or its pose."""
    whiskers = [item for item in picture.whiskers if item.kind is not DeviationClass.HELD]
    if placed is None or placed.is_rough or not whiskers:
        return None
    place = placed.T_world_from_model
    bases = np.stack([item.base_world for item in whiskers])
    return FieldRequest(
        (bases - place.translation) @ place.rotation,
        np.array([item.share for item in whiskers]),
        np.array([item.kind is DeviationClass.WITHIN for item in whiskers]),
    )


def make_field(mesh: RenderMesh, model: PartModel, wanted: FieldRequest) -> ValueField | None:
    """Return the field on a whole mesh of a model; None if no place lies on it."""
    return value_field(mesh, wanted.points, wanted.shares, wanted.good.tolist(), owners_of(model))


def owners_of(model: PartModel) -> Sequence[str]:
    """Return the feature of each face; empty for none."""
    return [face.feature for face in model.faces]


def field_colours(field: ValueField, colours: Colours, theme: Theme) -> Colours:
    """Return the vertex colours (n, 3) of a field; ``colours`` are those of the mesh."""
    found = colours[field.parents].copy()
    rows = np.flatnonzero(np.isfinite(field.values))
    shares, good = field.values[rows, None], field.good[rows, None]
    more, less = DeviationClass.MORE, DeviationClass.LESS
    size = np.abs(shares)
    mixed = np.zeros((len(rows), 3))
    for accepted, kind in ((True, DeviationClass.WITHIN), (False, DeviationClass.WITHIN_ONLY)):
        middle = _channels(surface_colour(theme, kind))
        ends = np.where(
            shares > 0.0,
            _channels(limit_colour(theme, kind, more)),
            _channels(limit_colour(theme, kind, less)),
        )
        mixed = np.where(good == accepted, middle + np.minimum(size, 1.0) * (ends - middle), mixed)
    # Beyond the limit the colour jumps: a place outside never looks nearly good.
    outside = np.where(
        shares > 0.0, _channels(surface_colour(theme, more)), _channels(surface_colour(theme, less))
    )
    found[rows] = np.round(np.where(size > 1.0, outside, mixed))
    return found


def deviation_part(
    picture: DeviationPicture, placed: PlacedPart | None, theme: Theme, mode: RenderMode
) -> tuple[PartScene | None, float | None]:
    """Return a placed part with its deviations, and the colour reach of a point, mm.

    For reports: at once. None without a located part, and for the reach if uncoloured.
    """
    if placed is None or placed.is_rough or not len(placed.model.triangles):
        return None, None
    mesh, field = _made(_Made(placed.model, field_request(picture, placed)))
    colours = face_colours(placed.model, part_colour(theme))
    if field is not None:
        mesh, colours = field.mesh, field_colours(field, colours, theme)
    style = RenderStyle(mode, edge_colour(theme), theme.panel, ground=theme.panel)
    scene = PartScene(mesh, colours, style, placed.T_world_from_model, moving=False, slack_mm=1.0)
    return scene, None if field is None else field.reach_mm


@dataclass(frozen=True, slots=True)
class _Made:
    """A model and a request; equal for equal requests on the same model."""

    model: PartModel
    wanted: FieldRequest | None

    def __eq__(self, other: object) -> bool:
        """Return whether the field would be the same."""
        if not isinstance(other, _Made) or self.model is not other.model:
            return False
        return self.wanted is other.wanted or (
            self.wanted is not None and self.wanted.is_like(other.wanted)
        )

    def __hash__(self) -> int:
        """Return a hash common to all requests of one model."""
        return id(self.model)


@lru_cache(maxsize=1)
def _made(made: _Made) -> tuple[RenderMesh, ValueField | None]:
    """Make a field; cached, because pages are laid out repeatedly for one job."""
    mesh = mesh_of(made.model)
    return mesh, None if made.wanted is None else make_field(mesh, made.model, made.wanted)


def _channels(colour: str) -> Float:
    read = QColor(colour)
    return np.array([read.red(), read.green(), read.blue()], dtype=np.float64)

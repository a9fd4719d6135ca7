"""Registry of all kinds, extended by a file with entries and a line here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from ocmm_core.errors import InputError, InternalError
from ocmm_core.features.shapes import Shape
from ocmm_core.tolerances.kinds import _angle, _distance, _form, _location, _related, _size
from ocmm_core.tolerances.kinds._spec import KindSpec, Symbol


def registered(entries: Iterable[KindSpec]) -> Mapping[str, KindSpec]:
    """Return entries by name, in order; InternalError for duplicate names, or a missing kind."""
    found: dict[str, KindSpec] = {}
    for entry in entries:
        if entry.name in found:
            raise InternalError(
                "kind.twice", f"Two kinds are named {entry.name!r}.", "Rename one of them."
            )
        found[entry.name] = entry
    for entry in found.values():
        for other in entry.stands_for.values():
            if other not in found or found[other].stands_for:
                raise InternalError(
                    "kind.stands_for",
                    f"Kind {entry.name!r} stands for {other!r}, which has no entry of its own.",
                    "Name a kind that stands for no other.",
                )
    return MappingProxyType(found)


KINDS = registered(
    (
        *_size.KINDS,
        *_distance.KINDS,
        *_angle.KINDS,
        *_form.KINDS,
        *_related.ORIENTATIONS,
        *_location.KINDS,
        *_related.PROFILES,
        *_related.RUNOUTS,
    )
)
"""All kinds by name, in the order of the plan editor."""


def spec_of(kind: str) -> KindSpec:
    """Return the entry of a kind; raise InputError if unknown."""
    found = KINDS.get(kind)
    if found is None:
        raise InputError(
            "characteristic.kind",
            f"Unknown kind of characteristic {kind!r}.",
            f"Use one of: {', '.join(KINDS)}.",
        )
    return found


def spec_for(kind: str, shape: Shape | None) -> KindSpec:
    """Return the equivalent entry for a first shape (None: unknown); InputError: unknown kind."""
    entry = spec_of(kind)
    if shape is None or shape not in entry.stands_for:
        return entry
    return spec_of(entry.stands_for[shape])


def symbol_of(kind: str, shape: Shape | None) -> Symbol | None:
    """Return the symbol of a kind for a first feature's shape, or None."""
    entry = spec_for(kind, shape)
    return entry.symbol if shape is None else entry.symbol_of_shape.get(shape, entry.symbol)

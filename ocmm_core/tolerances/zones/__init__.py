"""What characteristics are made of: surface points, derived elements, zones, local sizes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.tolerances.zones._associated import associated
    from ocmm_core.tolerances.zones._characteristic import (
        COAXIAL,
        FORMS,
        ORIENTATIONS,
        PROFILES,
        RUNOUTS,
        SIZES,
        TWO_POINT,
        ZONES,
        Association,
        Characteristic,
        Kind,
    )
    from ocmm_core.tolerances.zones._derived import (
        AXES,
        CENTRES,
        Section,
        axis_sections,
        derived_points,
        few_in_a_section,
        median_line,
        section_circle,
        sections,
    )
    from ocmm_core.tolerances.zones._evaluation import Evaluation, FormNoise, Ranked
    from ocmm_core.tolerances.zones._points import points_note
    from ocmm_core.tolerances.zones._surface import (
        SurfacePoints,
        kept_offset,
        least_squares,
        own_fit,
        surface_points,
    )
    from ocmm_core.tolerances.zones._two_point import across_slot, around, between_faces
    from ocmm_core.tolerances.zones._zone_frame import (
        BEST_FIT,
        Frames,
        ZoneFrame,
        free_frame,
        moved_geometry,
    )
    from ocmm_core.tolerances.zones._zones import (
        DerivedPoint,
        Surface,
        derived_zone,
        form_noise,
        surface_zone,
        vector_evaluation,
    )
else:
    __getattr__ = door(
        __name__,
        _associated="associated",
        _characteristic=(
            "Association COAXIAL Characteristic FORMS Kind ORIENTATIONS PROFILES RUNOUTS SIZES "
            "TWO_POINT ZONES"
        ),
        _derived=(
            "AXES CENTRES Section axis_sections derived_points few_in_a_section median_line "
            "section_circle sections"
        ),
        _evaluation="Evaluation FormNoise Ranked",
        _points="points_note",
        _surface="SurfacePoints kept_offset least_squares own_fit surface_points",
        _two_point="across_slot around between_faces",
        _zone_frame="BEST_FIT Frames ZoneFrame free_frame moved_geometry",
        _zones="DerivedPoint Surface derived_zone form_noise surface_zone vector_evaluation",
    )

__all__ = [
    "AXES",
    "BEST_FIT",
    "CENTRES",
    "COAXIAL",
    "FORMS",
    "ORIENTATIONS",
    "PROFILES",
    "RUNOUTS",
    "SIZES",
    "TWO_POINT",
    "ZONES",
    "Association",
    "Characteristic",
    "DerivedPoint",
    "Evaluation",
    "FormNoise",
    "Frames",
    "Kind",
    "Ranked",
    "Section",
    "Surface",
    "SurfacePoints",
    "ZoneFrame",
    "across_slot",
    "around",
    "associated",
    "axis_sections",
    "between_faces",
    "derived_points",
    "derived_zone",
    "few_in_a_section",
    "form_noise",
    "free_frame",
    "kept_offset",
    "least_squares",
    "median_line",
    "moved_geometry",
    "own_fit",
    "points_note",
    "section_circle",
    "sections",
    "surface_points",
    "surface_zone",
    "vector_evaluation",
]

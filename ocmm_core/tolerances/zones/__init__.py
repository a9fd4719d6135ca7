"""Elements of characteristics: surface points, derived elements, zones, local sizes.

In: measured features and the frame.
Out: widths of zones, axes and centres, local sizes, each with its gradient by the points.

Read `_characteristic` (entry of a plan, and its value), then `_surface` (points under the ball,
also against faces of the model), `_frames` (centres, axes, caches), `_zone_frame` (pose, smallest
zone), `_zones` and `_two_point` (local sizes). It is the first package of tolerances and
independent of specific kinds.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.tolerances.zones._characteristic import (
        TWO_POINT, Association, Characteristic, Evaluation, FormNoise, Ranked, Seen, points_note,
    )  # fmt: skip
    from ocmm_core.tolerances.zones._frames import (
        AXES, CENTRES, Frames, HeldFrame, Keep, Section, associated, axis_sections, derived_points,
        few_in_a_section, median_line, no_part_frame, section_circle, sections,
    )  # fmt: skip
    from ocmm_core.tolerances.zones._surface import (
        ModelSurface, SurfacePoints, kept_offset, least_squares, near_cut, own_fit, surface_points,
    )  # fmt: skip
    from ocmm_core.tolerances.zones._two_point import (
        across_slot, around, between_faces, gaps_between, slot_envelope,
    )  # fmt: skip
    from ocmm_core.tolerances.zones._zone_frame import (
        BEST_FIT, ZoneFrame, free_frame, moved_geometry,
    )  # fmt: skip
    from ocmm_core.tolerances.zones._zones import (
        DerivedPoint, Surface, SurfaceTouches, derived_zone, form_noise, surface_zone,
        vector_evaluation,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "AXES", "BEST_FIT", "CENTRES", "TWO_POINT", "Association", "Characteristic", "DerivedPoint",
    "Evaluation", "FormNoise", "Frames", "HeldFrame", "Keep", "ModelSurface", "Ranked", "Section",
    "Seen", "Surface", "SurfacePoints", "SurfaceTouches", "ZoneFrame", "across_slot", "around",
    "associated", "axis_sections", "between_faces", "derived_points", "derived_zone",
    "few_in_a_section", "form_noise", "free_frame", "gaps_between", "kept_offset", "least_squares",
    "median_line", "moved_geometry", "near_cut", "no_part_frame", "own_fit", "points_note",
    "section_circle", "sections", "slot_envelope", "surface_points", "surface_zone",
    "vector_evaluation",
]  # fmt: skip

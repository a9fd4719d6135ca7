"""Views of the machine at work: camera images and 3-D view.

In: labelled spots, poses, points, features. Out: painted widgets; no graphics card is needed.

Start with `_shapes` (wire shapes in mm, world frame, and sides of the rig), `_contents` (items of a
job), `_deviations` (whiskers of touched places, their scale, and colours on the part), `_placed`
(pose of the part), `_following` (view control, axes, overview); then `_point_view` (3-D view),
`_part_picture` (part only, picture of a step), `_camera_view` (spots of each camera). The 3-D scene
itself is the package `scene`.
It must not import the station or the bridge: it receives its data.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.views import _shapes as shapes
    from ocmm_gui.views._camera_view import CameraViews
    from ocmm_gui.views._contents import job_items
    from ocmm_gui.views._deviations import (
        SCALE_PX, deviation_colour, deviation_items, deviation_part, deviations_of, paint_scale,
        scale_words,
    )  # fmt: skip
    from ocmm_gui.views._part_picture import PartPicture, StepPicture, read_picture
    from ocmm_gui.views._placed import PartPlacement
    from ocmm_gui.views._point_view import PointView
    from ocmm_gui.views._section_view import is_section, paint_section
    from ocmm_gui.views._shapes import seen_from, upright
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "SCALE_PX", "CameraViews", "PartPicture", "PartPlacement", "PointView", "StepPicture",
    "deviation_colour", "deviation_items", "deviation_part", "deviations_of", "is_section",
    "job_items", "paint_scale", "paint_section", "read_picture", "scale_words", "seen_from",
    "shapes", "upright",
]  # fmt: skip

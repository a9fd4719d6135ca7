"""Views of the machine at work: camera images and 3-D view.

In: labelled spots, poses, points, features. Out: painted widgets; no graphics card is needed.

Start with `_shapes` (wire shapes in mm, world frame) and `_contents` (items of a job) with
`_nominal_items`, `_deviations` (whiskers of touched places, and their scale), `_deviation_surface`
(their colours on the part), `_placed` (pose of the part), `_following` (view control),
`_rig_sides`, `_view_dress` (axes and overview); `_part_picture` (part only), `_point_view` (3-D
view), `_camera_view` (spots of each camera), `_step_picture` (picture of a step). The 3-D scene
itself is the package `scene`.
It must not import the station or the bridge: it receives its data.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_gui.views import _shapes as shapes
    from ocmm_gui.views._camera_view import CameraViews
    from ocmm_gui.views._contents import job_items
    from ocmm_gui.views._deviation_surface import deviation_part
    from ocmm_gui.views._deviations import (
        SCALE_PX,
        deviation_colour,
        deviation_items,
        deviations_of,
        paint_scale,
        reach_words,
        scale_words,
    )
    from ocmm_gui.views._part_picture import PartPicture
    from ocmm_gui.views._placed import PlacedScene
    from ocmm_gui.views._point_view import PointView
    from ocmm_gui.views._rig_sides import seen_from, upright
    from ocmm_gui.views._step_picture import StepPicture, read_picture
else:
    __getattr__ = door(
        __name__,
        _camera_view="CameraViews",
        _contents="job_items",
        _deviation_surface="deviation_part",
        _deviations=(
            "SCALE_PX deviation_colour deviation_items deviations_of paint_scale reach_words "
            "scale_words"
        ),
        _part_picture="PartPicture",
        _placed="PlacedScene",
        _point_view="PointView",
        _rig_sides="seen_from upright",
        _shapes="shapes",
        _step_picture="StepPicture read_picture",
    )

__all__ = [
    "SCALE_PX", "CameraViews", "PartPicture", "PlacedScene", "PointView", "StepPicture",
    "deviation_colour", "deviation_items", "deviation_part", "deviations_of", "job_items",
    "paint_scale", "reach_words", "read_picture", "scale_words", "seen_from", "shapes", "upright",
]  # fmt: skip

"""Pictures of the machine at work: the camera images and the 3-D view.

In: spots with their labels, poses, points, features. Out: painted widgets; no graphics card is
needed.

Read `_shapes` (wire shapes in mm, world frame), `_contents` (what is shown of a job) with
`_nominal_items`, `_deviations` (whiskers of touched places, and their scale), `_deviation_surface`
(their colours on the part), `_placed` (where the part is), `_following` (where the eye has to be),
`_rig_sides`, `_view_dress` (what stands round a scene); `_part_picture` (the part by itself),
`_point_view` (the 3-D view), `_camera_view` (spots of each camera), `_step_picture` (the picture of
a step). The 3-D scene itself is the room `scene`.
It must not know the station or the bridge: it is given what it draws.
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
    "SCALE_PX",
    "CameraViews",
    "PartPicture",
    "PlacedScene",
    "PointView",
    "StepPicture",
    "deviation_colour",
    "deviation_items",
    "deviation_part",
    "deviations_of",
    "job_items",
    "paint_scale",
    "reach_words",
    "read_picture",
    "scale_words",
    "seen_from",
    "shapes",
    "upright",
]

"""The camera model and the rig: world to pixel and back.

In: the document of a rig; points in the world or pixels; images. Out: pixels of points, rays of
pixels, and spots with their position, px.

Read `_model` (projection with four distortion terms and its exact inverse), `_rig` (the cameras and
the covariance of their parameters) and `_tracker` (cameras that stand for a tracker), then spot
detection: `_finder` (also options and results), `_windows`, `_search` and `_centroid`, all compiled
through `_compiled`. Lengths are mm in the world frame, sensor positions px. The package is
independent of the bus, LED names and probes.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.camera import _centroid as centroid
    from ocmm_core.camera import _search as search
    from ocmm_core.camera import _windows as windows
    from ocmm_core.camera._centroid import N_READING
    from ocmm_core.camera._compiled import compiled
    from ocmm_core.camera._finder import (
        NO_BLACK, FinderState, SpotBlock, SpotFinder, SpotOptions, SpotStatus, Window,
    )  # fmt: skip
    from ocmm_core.camera._model import (
        N_PARAMETERS, PARAMETERS, CameraModel, Vector3, distort, distortion_jacobian, from_pixels,
        ideal_from_pixels, on_sensor, project, projection_jacobians, to_pixels,
    )  # fmt: skip
    from ocmm_core.camera._rig import (
        MAX_CAMERAS, MAX_LEDS, MAX_SLOTS, USUAL_SLOTS, CalibrationDesign, CameraEntry, Rig,
        SpotNoise, ThermalShare, camera_of, known_points_covariance, load_rig, read_rig,
        tracker_rig,
    )  # fmt: skip
    from ocmm_core.camera._tracker import (
        REACH_MM, MarkerModel, TrackerDocument, TrackerNoise, independent_share, load_tracker,
        locate_markers, noise_pairs, place_shape, sights_of, slopes_of_places,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "MAX_CAMERAS", "MAX_LEDS", "MAX_SLOTS", "NO_BLACK", "N_PARAMETERS", "N_READING", "PARAMETERS",
    "REACH_MM", "USUAL_SLOTS", "CalibrationDesign", "CameraEntry", "CameraModel", "FinderState",
    "MarkerModel", "Rig", "SpotBlock", "SpotFinder", "SpotNoise", "SpotOptions", "SpotStatus",
    "ThermalShare", "TrackerDocument", "TrackerNoise", "Vector3", "Window", "camera_of", "centroid",
    "compiled", "distort", "distortion_jacobian", "from_pixels", "ideal_from_pixels",
    "independent_share", "known_points_covariance", "load_rig", "load_tracker", "locate_markers",
    "noise_pairs", "on_sensor", "place_shape", "project", "projection_jacobians", "read_rig",
    "search", "sights_of", "slopes_of_places", "to_pixels", "tracker_rig", "windows",
]  # fmt: skip

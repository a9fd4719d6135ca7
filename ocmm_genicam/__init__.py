"""Cameras that can be bought (GigE Vision, GenICam) as a source of frames.

In: images of cameras with one clock (PTP), by Aravis or Harvesters. Out: spots of all cameras per
exposure, in the ring of a station.

Read `_client` (what a camera must do, pixel formats), `_aravis` (that by the library Aravis),
`_harvesters` (that by GenTL producers), `_set_up` (by documents of the makes), `_link` (regions and
network cards), `_black` (dark signal and hot pixels), `_timing` (proof of a common clock),
`_grabber` (one camera), `_source` (all of them, also without a common clock), `_viewfinder`
(pictures and exposure of all of them, for setting up), `_process` (both in a process of their own),
`_feed`, `_specs` (the entry of `ocmm.sources`). It must not import virtual cameras.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_genicam._aravis import AravisCameras
    from ocmm_genicam._black import black_path
    from ocmm_genicam._client import unpack
    from ocmm_genicam._feed import expected_cameras, named_cameras, slots_for
    from ocmm_genicam._harvesters import camera_library
    from ocmm_genicam._link import volume_window
    from ocmm_genicam._process import (
        GenicamConfig, ViewfinderProcess, genicam_command, genicam_description,
    )  # fmt: skip
    from ocmm_genicam._set_up import Expected, lost_by, sensor_size, settings_of
    from ocmm_genicam._source import GenicamSource
    from ocmm_genicam._specs import CAMERAS
    from ocmm_genicam._viewfinder import WANTED, Brightness, CameraLook, Viewfinder
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CAMERAS", "WANTED", "AravisCameras", "Brightness", "CameraLook", "Expected", "GenicamConfig",
    "GenicamSource", "Viewfinder", "ViewfinderProcess", "black_path", "camera_library",
    "expected_cameras", "genicam_command", "genicam_description", "lost_by", "named_cameras",
    "sensor_size", "settings_of", "slots_for", "unpack", "volume_window",
]  # fmt: skip

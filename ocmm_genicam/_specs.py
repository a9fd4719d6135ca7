"""The source `genicam:`: an entry point of the group `ocmm.sources`."""

from __future__ import annotations

from ocmm_core.composition import Origin, SourceSpec, late

CAMERAS = SourceSpec(
    prefix="genicam:",
    forms=(
        (
            "genicam:SERIAL,SERIAL",
            "GigE Vision cameras with a common clock (PTP), by their serial numbers in the order "
            "of the rig; needs the library Aravis",
        ),
        (
            "genicam:untimed,SERIAL,SERIAL",
            "the same without a common clock: the skew of the exposures is measured from the "
            "moving probe and is in U, and a moving probe gives no point",
        ),
        (
            "genicam:gentl,SERIAL,SERIAL",
            "cameras by the GenTL producers of their makers (CoaXPress, USB3 Vision and others), "
            "also with untimed; needs the package Harvesters",
        ),
        (
            "genicam:region,SERIAL,SERIAL",
            "images of the part of each sensor that shows the probe in the volume of the rig, also "
            "with untimed or gentl: less to send, so that a higher rate fits",
        ),
    ),
    takes_value=True,
    origin=Origin.CAMERAS,
    live=True,
    recorded_as="GenICam",
    make=late("ocmm_genicam._feed", "genicam_feed"),
)

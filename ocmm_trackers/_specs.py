"""The source `igtl:`: an entry point of the group `ocmm.sources`."""

from __future__ import annotations

from ocmm_core.composition import Origin, SourceSpec, late

IGTL = SourceSpec(
    prefix="igtl:",
    forms=(
        (
            "igtl:HOST:PORT",
            "an optical tracker that sends its markers by OpenIGTLink; its document (ocmm.tracker) "
            "takes the place of the rig",
        ),
    ),
    takes_value=True,
    origin=Origin.CAMERAS,
    live=True,
    on_bus=False,
    recorded_as="OpenIGTLink",
    make=late("ocmm_trackers._feed", "tracker_feed"),
    rig="tracker.toml",
)

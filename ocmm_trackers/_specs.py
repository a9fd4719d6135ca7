"""Trackers as sources: entry points of the group `ocmm.sources`."""

from __future__ import annotations

from ocmm_core.composition import Origin, SourceSpec, late


def _tracker(
    protocol: str, recorded_as: str, words: str, rig: str, *more: tuple[str, str]
) -> SourceSpec:
    return SourceSpec(
        prefix=f"{protocol}:",
        forms=((f"{protocol}:HOST:PORT", words), *more),
        takes_value=True,
        origin=Origin.CAMERAS,
        live=True,
        on_bus=False,
        recorded_as=recorded_as,
        make=late("ocmm_trackers._feed", "tracker_feed"),
        rig=rig,
    )


IGTL = _tracker(
    "igtl", "OpenIGTLink",
    "an optical tracker that sends its markers by OpenIGTLink; its document (ocmm.tracker) takes "
    "the place of the rig",
    "tracker.toml",
)  # fmt: skip

NATNET = _tracker(
    "natnet", "NatNet",
    "an OptiTrack system: the labelled markers of Motive by NatNet 3.0 to 4.x; with a document of "
    "the tracker",
    "tracker_natnet.toml",
)  # fmt: skip

NDI = _tracker(
    "ndi", "NDI",
    "an NDI Polaris or Vega on the network: its stray markers, and those of its tools; with a "
    "document of the tracker",
    "tracker_ndi.toml",
    ("ndi:LINE", "the same on a serial line, such as /dev/ttyUSB0"),
)  # fmt: skip

QTM = _tracker(
    "qtm", "QTM",
    "a Qualisys system: the labelled markers of Qualisys Track Manager in real time; with a "
    "document of the tracker",
    "tracker_qtm.toml",
)  # fmt: skip

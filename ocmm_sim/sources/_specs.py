"""The virtual rig as frame sources: entry points of the group `ocmm.sources`."""

from __future__ import annotations

from ocmm_core.composition import IN_PROCESS, VIRTUAL_WIRE, Origin, SourceSpec, late

_MAKERS = "ocmm_sim.sources._feed_makers"
_HANDS = "ocmm_sim.sources._calibrate_scenes"

SIMULATED = SourceSpec(
    prefix="simulated",
    forms=(("simulated", "the virtual rig in this process"),),
    origin=Origin.VIRTUAL,
    live=False,
    recorded_as=IN_PROCESS,
    make=late(_MAKERS, "virtual_rig_feed"),
    scenes=late(_MAKERS, "scenes_feed"),
    hand=late(_HANDS, "acceptance_hand"),
    practice=late("ocmm_sim.practice", "Practice"),
)

WIRE = SourceSpec(
    prefix="ethercat:virtual",
    forms=(
        (
            "ethercat:virtual",
            "the virtual rig over the whole wire: software cameras, a pair of virtual "
            "interfaces and the bus process, in a private network namespace, without root",
        ),
    ),
    origin=Origin.VIRTUAL,
    live=True,
    on_bus=True,
    recorded_as=VIRTUAL_WIRE,
    make=late(_MAKERS, "wire_feed"),
    segment=late(_MAKERS, "segment_of"),
    scenes=late(_MAKERS, "scenes_wire_feed"),
    hand=late(_HANDS, "acceptance_hand"),
    practice=late("ocmm_sim.practice", "Practice"),
)

PIXELS = SourceSpec(
    prefix="ethercat:pixels",
    forms=(
        (
            "ethercat:pixels",
            "the same, with cameras that render images pixel by pixel and find the spots in "
            "them; 1 kHz",
        ),
    ),
    origin=Origin.VIRTUAL,
    live=True,
    on_bus=True,
    recorded_as=VIRTUAL_WIRE,
    make=late(_MAKERS, "pixel_feed"),
    segment=late(_MAKERS, "pixel_segment_of"),
)

GENICAM = SourceSpec(
    prefix="genicam:virtual",
    forms=(
        (
            "genicam:virtual",
            "the virtual rig by GigE Vision cameras: rendered images over a private network, read "
            "by the library Aravis as those of real cameras; 100 Hz",
        ),
    ),
    origin=Origin.VIRTUAL,
    live=True,
    recorded_as="virtual GenICam",
    make=late(_MAKERS, "genicam_feed"),
)


def _virtual_tracker(protocol: str, recorded_as: str, words: str, rig: str) -> SourceSpec:
    name = f"{protocol}:virtual"
    return SourceSpec(
        prefix=name,
        forms=((name, words),),
        origin=Origin.VIRTUAL,
        live=True,
        recorded_as=recorded_as,
        make=late(_MAKERS, "tracker_feed"),
        scenes=late(_MAKERS, "tracker_scenes_feed", protocol, recorded_as),
        rig=rig,
    )


TRACKER = _virtual_tracker(
    "igtl", "virtual OpenIGTLink",
    "the virtual rig by an optical tracker: markers with its noise, by OpenIGTLink over a "
    "private network; 100 Hz",
    "tracker.toml",
)  # fmt: skip

NATNET = _virtual_tracker(
    "natnet", "virtual NatNet",
    "the virtual rig by an optical tracker that sends NatNet 4.1, in metres; 100 Hz",
    "tracker_natnet.toml",
)  # fmt: skip

NDI = _virtual_tracker(
    "ndi", "virtual NDI", "the virtual rig by the stray markers of an NDI device; 60 Hz",
    "tracker_ndi.toml",
)  # fmt: skip

QTM = _virtual_tracker(
    "qtm", "virtual QTM", "the virtual rig by the protocol of Qualisys Track Manager; 100 Hz",
    "tracker_qtm.toml",
)  # fmt: skip

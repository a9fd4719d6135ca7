"""What is asked for in names and numbers, and what comes of it: a source of frames made ready."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import platformdirs

from ocmm_core.acquisition.bus_process import Acquisition
from ocmm_core.acquisition.frames import (
    AcquisitionStatus,
    FrameRing,
    SourceDescription,
    read_status,
)
from ocmm_core.calibration.records import default_folder, default_probe_folder
from ocmm_core.composition._climate import ClimateRequest
from ocmm_core.composition._defaults import (
    DEFAULT_SEED,
    DEFAULT_SOURCE,
    DEMO_PART,
    RECOMMENDED_RIG,
    STANDARD_PROBE,
)
from ocmm_core.failure import log_folder
from ocmm_core.inspection.evaluation import Probing
from ocmm_core.seals import KeyFolder, memory_folder
from ocmm_core.simulation.scene import SimulatedSource, VirtualRig, WorldOptions
from ocmm_core.station.stream import StreamOptions
from ocmm_core.surroundings import TypedRoom
from ocmm_core.tracking import Method


@dataclass(frozen=True, slots=True)
class StationRequest:
    """What to measure, with what, from where and to where.

    Attributes
    ----------
    plan, rig, probe, part
        Documents; the part is only for virtual rigs.
    """

    plan: Path
    out: Path
    """Folder of the job file; made if it does not exist."""
    rig: Path = RECOMMENDED_RIG
    probe: Path = STANDARD_PROBE
    part: Path = DEMO_PART
    source: str = DEFAULT_SOURCE
    """One of `SOURCES`, with what comes behind its prefix."""
    seed: int = DEFAULT_SEED
    speed: float = 0.0
    world: WorldOptions = field(default_factory=WorldOptions)
    frame_rate_hz: int = 0
    """`seed`, `speed`, `world`, `frame_rate_hz`: Of the virtual rig; a speed of zero is as fast as
    possible, a rate of zero the rig's own."""
    stay: bool = False
    rest_speed: float = 1.0
    """`stay`, `rest_speed`: At the end of the script the operator stays and goes on touching what
    is missing. While nothing is, a virtual rig without a speed has this one, and zero is as fast as
    possible."""
    operator: str = "demo"
    serial: str = "1"
    order: str = ""
    batch: str = ""
    """`operator`, `serial`, `order`, `batch`: Names for the job; order and batch may be empty."""
    resume: Path | None = None
    """Job file that is gone on with, by its own plan; None for a new job."""
    probing: Probing = "plan"
    """In the order of the plan, or in any."""
    record: Path | None = None
    """File that takes all raw frames, or None."""
    force: bool = False
    """Use a network interface although the computer needs it itself."""
    bus_processor: int | None = None
    """Number of the processor that the bus process stays on; None lets it choose."""
    method: Method = "gauss-newton"
    """How poses are computed."""
    control: str = ""
    """Socket over which faults can be made to the cameras of a virtual wire; empty: none."""
    calibrations: Path | None = None
    """Folder of calibrations; None is that of this user for real cameras, and the rig document
    itself for virtual ones and replays."""
    uncalibrated: bool = False
    """Take points whatever is the matter with calibration and tip; they prove nothing."""
    probes: Path | None = None
    tip: str | None = None
    """`probes`, `tip`: Folder of records of probes, as ``calibrations``; name of the tip that is on
    the probe, or None for the one that the records say."""
    check_after_h: float = 8.0
    """After so many hours without a point or a check the tip must be checked."""
    climate: ClimateRequest = field(default_factory=ClimateRequest)
    """Temperatures of probe and part, and what is to be compensated for them."""
    reference: Path | None = None
    """Document of the reference body to which everything is given; None without one."""
    released_only: bool = False
    """Refuse plans that are not released, also if no settings of this computer say so."""
    stream: StreamOptions | None = None
    """How points and poses are given to other programs; None where they are not."""
    room: TypedRoom = field(default_factory=TypedRoom)
    """What was read off in the room before the first point; kept in the job."""


_STOP_S = 3.0
"""How long an acquisition may take to end."""


@dataclass(frozen=True, slots=True)
class Feed:
    """A source of frames made ready."""

    acquisition: Acquisition
    ring: FrameRing
    """`acquisition`, `ring`: Not started; whoever takes the feed calls `end`, which stops the one
    and closes the other."""
    description: SourceDescription
    """What the source says about itself."""
    live: bool
    """Frames come by themselves."""
    virtual: VirtualRig | None = None
    """The virtual rig whose script is played, None for anything else."""
    simulated: SimulatedSource | None = None
    """The source itself, where it is the virtual rig of this process."""
    recorded: str = ""
    """Name of the source that was recorded; empty where nothing is replayed."""

    def end(self) -> AcquisitionStatus:
        """Stop the acquisition, close the ring, and return what became of it."""
        self.acquisition.request_stop()
        self.acquisition.join(_STOP_S)
        status = read_status(self.ring)
        self.ring.close()
        return status

    @property
    def script_frames(self) -> int | None:
        """Return after how many frames the script is over; None where there is none."""
        return self.virtual.n_frames if self.virtual is not None else None


def written_folders(request: StationRequest) -> set[Path]:
    """Return the folders that this program writes files into, as far as they are there."""
    records = [request.calibrations or default_folder(), request.probes or default_probe_folder()]
    within = {path for folder in records for path in folder.rglob("*") if path.is_dir()}
    files = [path.parent for path in (request.record, request.resume) if path is not None]
    state = platformdirs.user_state_path("ocmm")
    kept = (memory_folder(), KeyFolder().folder, log_folder())
    return {*records, *within, *files, request.out, state, *kept}

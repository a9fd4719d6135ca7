"""Station requests, also from the settings of the window, and the prepared frame source."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import platformdirs

from ocmm_core.acquisition import frames
from ocmm_core.acquisition.bus_process import Acquisition
from ocmm_core.ambient import TypedRoom
from ocmm_core.calibration.records import default_folder, default_probe_folder
from ocmm_core.composition import _defaults as defaults
from ocmm_core.composition._climate import ClimateRequest
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.failure import log_folder
from ocmm_core.host import HOST
from ocmm_core.inspection.evaluation import Probing
from ocmm_core.options import DEFAULT_OPERATOR, DEFAULT_SEED, DEFAULT_SERIAL, DEMO_PART
from ocmm_core.seals import KeyFolder, memory_folder
from ocmm_core.settings import Settings
from ocmm_core.station.stream import StreamOptions, check_stream, tls_context
from ocmm_core.tracking import Method


@dataclass(frozen=True, slots=True)
class StationRequest:
    """Request for a station; the part is for virtual rigs only."""

    plan: Path
    out: Path
    """Folder of the job file; created if missing."""
    rig: Path = defaults.RECOMMENDED_RIG
    probe: Path = defaults.STANDARD_PROBE
    part: Path = defaults.DEMO_PART
    source: str = defaults.DEFAULT_SOURCE
    """One of `sources`, with the value after its prefix."""
    seed: int = defaults.DEFAULT_SEED
    speed: float = 0.0
    world: object = None
    frame_rate_hz: int = 0
    """`seed`, `speed`, `world`, `frame_rate_hz`: virtual rig; speed 0 unlimited, rate 0 its own;
    `world`: `ocmm_sim.scene.WorldOptions`, None for the usual ones."""
    stay: bool = False
    rest_speed: float = 1.0
    """`stay`, `rest_speed`: after the script, the operator stays and touches missing points. While
    idle, a rig with unlimited speed runs at `rest_speed`; 0 is unlimited."""
    idle: bool = False
    """The operator of a virtual rig makes no touch of the plan, only those that are requested."""
    operator: str = DEFAULT_OPERATOR
    serial: str = DEFAULT_SERIAL
    order: str = ""
    batch: str = ""
    """`operator`, `serial`, `order`, `batch`: job header; order and batch may be empty."""
    resume: Path | None = None
    """Job file to resume with its own plan; None for a new job."""
    probing: Probing = "plan"
    record: Path | None = None
    force: bool = False
    """Use a network interface even if the computer needs it."""
    bus_processor: int | None = None
    """CPU of the bus process; None: automatic."""
    method: Method = "gauss-newton"
    calibrations: Path | None = None
    """Calibration store; None: this user's, or the rig document for virtual rigs and replays."""
    uncalibrated: bool = False
    """Accept points whatever the state of calibration and tip; they prove nothing."""
    probes: Path | None = None
    tip: str | None = None
    """`probes`, `tip`: probe records as ``calibrations``; mounted tip, None: by the records."""
    check_after_h: float = 8.0
    """Hours without a point or check after which the tip must be checked."""
    climate: ClimateRequest = field(default_factory=ClimateRequest)
    reference: Path | None = None
    released_only: bool = False
    """Refuse unreleased plans, even if the settings allow them."""
    stream: StreamOptions | None = None
    room: TypedRoom = field(default_factory=TypedRoom)
    thermometers: str = ""
    """Ids of registered thermometers that are logged in each job, with commas."""


_STOP_S = 3.0
"""Time limit for stopping an acquisition."""


class ScriptedRig(Protocol):
    """Virtual rig whose operator follows a script."""

    @property
    def n_frames(self) -> int: ...
    @property
    def frame_period_ns(self) -> int: ...
    @property
    def part(self) -> Any:
        """Return the part as it is (`ocmm_sim.scene.Part`)."""

    @property
    def truth(self) -> Any:
        """Return the true touches."""


Remaining = tuple[Sequence[tuple[str, int]], Mapping[str, Sequence[Sequence[float]]]]
"""Missing touches by feature, and the measured balls of each, mm, world."""


class ScriptedOperator(Protocol):
    """Operator of a virtual rig, who repeats refused touches as a person would."""

    @property
    def features(self) -> frozenset[str]:
        """Return the features that the part has."""

    def intent(self, frame: int) -> str | None:
        """Return the feature that is touched at an exposure."""

    def follow(self, ask: Callable[[], Remaining], *, stay: bool) -> Callable[[int], None] | None:
        """Touch again what `ask` returns; a result is to be called with each frame counter."""

    def hand(self) -> Any:
        """Return the probe for a user who holds it (`ocmm_sim.hand.HandAtRig`), or None."""


@dataclass(frozen=True, slots=True)
class Feed:
    """A prepared frame source."""

    acquisition: Acquisition
    ring: frames.FrameRing
    """`acquisition`, `ring`: not started; the owner calls `end`, which stops and closes them."""
    description: frames.SourceDescription
    live: bool
    virtual: ScriptedRig | None = None
    """Virtual rig of the script; None for other sources."""
    operator: ScriptedOperator | None = None
    """Touches of that script; None for other sources."""
    recorded: str = ""
    """Source name in the recording; empty without replay."""

    def end(self) -> frames.AcquisitionStatus:
        """Stop the acquisition, close the ring, and return the final status."""
        self.acquisition.request_stop()
        self.acquisition.join(_STOP_S)
        status = frames.read_status(self.ring)
        self.ring.close()
        return status

    @property
    def script_frames(self) -> int | None:
        """Return the number of frames in the script; None without a script."""
        return self.virtual.n_frames if self.virtual is not None else None


def written_folders(request: StationRequest) -> set[Path]:
    """Return the existing folders that this program writes to."""
    records = [request.calibrations or default_folder(), request.probes or default_probe_folder()]
    within = {path for folder in records for path in folder.rglob("*") if path.is_dir()}
    files = [path.parent for path in (request.record, request.resume) if path is not None]
    state = platformdirs.user_state_path("ocmm")
    kept = (memory_folder(), KeyFolder().folder, log_folder())
    return {*records, *within, *files, request.out, state, *kept}


def stream_options(
    port: int | None,
    host: str,
    token_file: Path | None,
    certificate: Path | None = None,
    private_key: Path | None = None,
    allow: tuple[str, ...] | None = None,
) -> StreamOptions | None:
    """Return the stream options, or None if it is off.

    `allow`: addresses of clients that cannot send a token. InputError: the token or key file is
    unreadable or readable by others, the stream would be open to others, or the TLS files are
    invalid.
    """
    if port is None:
        return None
    token = ""
    if token_file is not None:
        token = _first_line(token_file)
        _require_private(token_file, 0o077, "the token", "a new token")
    options = StreamOptions(
        host=host, port=port, token=token, certificate=certificate, private_key=private_key,
        allow=allow or (),
    )  # fmt: skip
    check_stream(options, by_address=allow is not None)
    tls_context(options)
    if private_key is not None:
        # A group with access to certificate keys is usual (ssl-cert).
        _require_private(private_key, 0o007, "the key of the certificate", "the key of a new one")
    return options


def _require_private(path: Path, others: int, what: str, renewed: str) -> None:
    """Refuse a secret that other users can read, on systems with file permissions."""
    if HOST.is_open_to(path.stat(), others):
        raise InputError(
            "stream.token_open" if others & 0o070 else "stream.key_open",
            f"{path}: other users of this computer can read {what}.",
            f"Type chmod 600 {path}, and put {renewed} into it.",
        )


_LONGEST_TOKEN_FILE = 65_536


def _first_line(path: Path) -> str:
    try:
        lines = read_bytes(path, _LONGEST_TOKEN_FILE).decode("ascii").splitlines()
    except UnicodeDecodeError as error:
        raise InputError(
            "stream.token_file",
            f"{path}: the token has non-ASCII characters.",
            "Use letters and digits.",
        ) from error
    return lines[0].strip() if lines else ""


@dataclass(frozen=True, slots=True)
class Errand:
    """What to measure now and how the virtual rig plays it; not stored in settings."""

    plan: Path
    part: Path = DEMO_PART
    seed: int = DEFAULT_SEED
    speed: float = 1.0
    stay: bool = True
    """`plan`, `part`, `seed`, `speed`, `stay`: see `StationRequest`."""
    serial: str = DEFAULT_SERIAL
    resume: Path | None = None
    force: bool = False
    uncalibrated: bool = False
    """`force`, `uncalibrated`: see `StationRequest`; never stored, so they cannot remain set."""


def request_of_settings(settings: Settings, errand: Errand) -> StationRequest:
    """Return the station request; InputError as `stream_options`."""
    return StationRequest(
        plan=errand.plan,
        # The report of a resumed job stays in the folder of the job.
        out=settings.job_folder if errand.resume is None else errand.resume.absolute().parent,
        rig=settings.instrument_rig,
        probe=settings.instrument_probe,
        reference=settings.instrument_reference,
        part=errand.part,
        source=settings.instrument_source,
        seed=errand.seed,
        speed=errand.speed,
        stay=errand.stay,
        operator=settings.job_operator or DEFAULT_OPERATOR,
        serial=errand.serial,
        resume=errand.resume,
        force=errand.force,
        bus_processor=settings.instrument_bus_processor,
        calibrations=settings.instrument_calibrations,
        uncalibrated=errand.uncalibrated,
        climate=ClimateRequest(
            probe_design=settings.temperature_probe_design,
            probe_c=settings.temperature_probe_c,
            part_c=settings.temperature_part_c,
            sigma_k=settings.temperature_sigma_k,
            part_expansion_ppm=settings.temperature_part_expansion_ppm,
            compensate_probe=settings.temperature_compensate_probe,
            compensate_part=settings.temperature_compensate_part,
            stated_u=settings.temperature_thermometer,
        ),
        probes=settings.instrument_probes,
        tip=settings.instrument_tip,
        check_after_h=settings.instrument_check_after_h,
        stream=stream_options(
            settings.stream_port,
            settings.stream_host,
            settings.stream_token,
            settings.stream_certificate,
            settings.stream_key,
        ),
    )

"""Station requests, and options of the live stream, from the settings of the window."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ocmm_core.composition._climate import ClimateRequest
from ocmm_core.composition._feeds import StationRequest
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError
from ocmm_core.host import HOST
from ocmm_core.options import DEFAULT_OPERATOR, DEFAULT_SEED, DEFAULT_SERIAL, DEMO_PART
from ocmm_core.settings import Settings
from ocmm_core.station.stream import StreamOptions, check_stream, tls_context


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

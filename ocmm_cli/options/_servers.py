"""Options of a station: its computer, settings, servers and measuring.

A group of options is one parameter of a command.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ocmm_core.options import DEFAULT_OPERATOR, OF_SERVER, Option, argument

if TYPE_CHECKING:
    from ocmm_core.composition import StationRequest


_DME = {one.name: one for one in OF_SERVER}
_POINTS = (
    Option("unit", "mm", "Unit of positions and radius in the lines."),
    Option("point", "ball", "ball: centre of the probe ball, the program compensates its radius; "
           "surface: compensated along the direction of the touch."),
    Option("decimal", "point", "Decimal sign."),
    Option("plan", None, "Plan that the touches belong to. Default: a list of points; for a "
           "virtual source the demonstration."),
    Option("speed", 1.0, ""),
)  # fmt: skip
"""Of both faces that send points as text."""

TABLE = {
    "station doctor": (
        Option("interface", "", "Network adapter of the cameras. Default: that of the service "
               "(/etc/ocmm/bus.env)."),
        Option("jobs", None, "Folder of the jobs. Default: the present one."),
        Option("seconds", 60.0, "How long wake-up jitter is measured, and a bus on a virtual cable "
               "(10 s at most); 0 leaves both out.", "seconds-of-a-doctor"),
        Option("as_json", False, "Print JSON instead (docs/doctor.schema.json).", flags="--json"),
        Option("fix", False, "Mend faults without risk; lists them and asks before. "
               "Needs root."),
        Option("yes", False, "With --fix: do not ask."),
        Option("take_back", False, "Take back all that --fix changed. Needs root.", flags="--undo"),
    ),
    "settings show": (
        argument("key", "", "One setting; default: all."),
        Option("json", False, "As JSON."),
    ),
    "settings set": (
        argument("key", ..., "Setting, e.g. instrument.rig."),
        argument("value", ..., "As in the window; empty: the default."),
    ),
    "settings": (
        Option("station", False, "For everybody at this computer; default: as it belongs."),
    ),
    "settings confirm": (
        Option("who", ..., "Name of the person who answers for them.", flags="--by"),
    ),
    "support whatsnew": (
        Option("since", "", "Version used before, e.g. 0.1.0; default: the last one."),
    ),
    "support bundle": (
        argument("file", ..., "Archive to write, .zip."),
        Option("without", None, "Leave a part out; may be given several times: versions, settings, "
               "doctor, logs, records, recording."),
        Option("mask_names", False, "Take names of people out."),
        Option("list_only", False, "Show what would be inside, and write nothing.", flags="--list"),
        Option("yes", False, "Write it without asking."),
    ),
    "serve": (
        Option("operator", DEFAULT_OPERATOR, ""),
        Option("out", Path("ocmm-out"), ""),
        _DME["host"],
        _DME["allow"],
        Option("certificate", None, "Certificate (PEM): the server speaks TLS.", flags="--cert"),
        Option("private_key", None, "Private key of the certificate (PEM).", flags="--key"),
    ),
    "serve ippdme": (
        _DME["port"],
        _DME["dialect"],
        _DME["shift_sign"],
        _DME["point"],
        Option("any_place", False, "Accept touches away from the nominal, such as before the part "
               "is aligned."),
        Option("patience", 600.0, "Longest wait for a touch, s.", "seconds"),
        Option("tries", 3, "Refused touches before the program gets an error.", "touches"),
    ),
    "serve lines": (
        *_POINTS,
        Option("template", "{x:.4f},{y:.4f},{z:.4f}", "Format of a line: {x} {y} {z} position, "
               "{i} {j} {k} direction, {r} radius of the ball, {n} number of the point; digits as "
               "in {x:.4f}; \\t is a tabulator."),
        Option("end", "crlf", "End of a line.", choices=("crlf", "lf", "cr")),
        Option("port", None, "TCP port; 0: any free port. Default: 1390.", "port"),
        Option("device", "", "Serial line in place of TCP, such as /dev/ttyUSB0."),
        Option("baud", 9600, "Speed of the serial line.", "baud"),
    ),
    "serve opcua, serve mqtt": (
        Option("out", Path("ocmm-out"), "Folder of the jobs of the station."),
        Option("stream", None, "Port of the live stream of the station on this computer "
               "(ocmm measure --stream). Default: its state is not published.", "port"),
        Option("probes", None, "Probe record folder. Default: that of this user."),
        Option("calibrations", None, "Calibration folder. Default: that of this user."),
        Option("corrections", None, "Document of a machine tool (ocmm correct), whose offsets are "
               "published."),
        Option("records", None, "Folder of the registers; default: that of this user."),
    ),
    "serve opcua": (
        Option("port", None, "TCP port; 0: any free port. Default: 4840.", "port"),
        Option("trusted", None, "Folder with the certificates (PEM, DER) of permitted clients."),
        Option("anonymous", False, "Let clients without a certificate read."),
        Option("machine", "OCMM", "Name of the machine."),
        Option("machine_serial", "", "Its serial number."),
    ),
    "serve mqtt": (
        Option("broker", ..., "Broker: HOST or HOST:PORT."),
        Option("topic", "ocmm", "Beginning of all topics."),
        Option("login", None, "File with user:password."),
        Option("ca", None, "PEM file: who signed the certificate of the broker. Default: no TLS."),
    ),
    "serve keyboard": (
        *_POINTS,
        Option("template", "{x:.4f}\\t{y:.4f}\\t{z:.4f}", "As of ocmm serve lines; \\t presses "
               "Tab."),
        Option("end", "enter", "Key behind a line.", choices=("enter", "tab", "none")),
        Option("window", "", "Type only if the title of the active window contains these words "
               "(X11)."),
    ),
    "serve screen": (
        Option("plan", None, "Plan to measure. Default: as of ocmm serve lines."),
        Option("speed", 1.0, ""),
        Option("port", None, "TCP port; 0: any free port. Default: 1391.", "port"),
        Option("token", None, "File with the secret of the addresses (chmod 600). Default: new."),
        Option("control", False, "Also print an address whose page has the buttons Take, Undo and "
               "Next. Beyond this computer it needs --cert."),
    ),
}  # fmt: skip
"""By the commands that take them."""


@dataclass(frozen=True, slots=True)
class StationChoice:
    """The station that a command measures with, or whose points it serves."""

    out: Path | None
    source: str
    rig: Path
    probe: Path
    reference: Path | None
    seed: int
    speed: float
    operator: str
    serial: str
    calibrations: Path | None
    uncalibrated: bool
    probes: Path | None
    tip: str | None
    check_after: float
    """Hours."""
    force: bool
    bus_processor: int | None
    part_temperature: float | None
    temperature_sigma: float | None

    def request(self, plan: Path, **more: Any) -> StationRequest:
        """Return the request of the station for a plan; ``more``: other fields of it."""
        from ocmm_core.composition import ClimateRequest, StationRequest

        named = asdict(self)
        named["climate"] = ClimateRequest(
            part_c=named.pop("part_temperature"), sigma_k=named.pop("temperature_sigma")
        )
        named["check_after_h"] = named.pop("check_after")
        return StationRequest(plan=plan, **{**named, **more})


@dataclass(frozen=True, slots=True)
class ClimateOptions:
    """Temperatures of the probe, and compensation."""

    probe_design: Path | None
    probe_temperature: float | None
    compensate_probe: bool
    part_expansion: float | None
    compensate_part: bool
    temperature_u: str
    thermometer: str


@dataclass(frozen=True, slots=True)
class StreamChoice:
    """Address of the live stream; off without a port."""

    stream: int | None
    stream_host: str
    stream_token: Path | None
    stream_cert: Path | None
    stream_key: Path | None


@dataclass(frozen=True, slots=True)
class JobOptions:
    """What a job is about, and how it is probed and recorded."""

    part: Path
    order_number: str
    batch: str
    order: str
    record: Path | None
    thesis: bool

"""Options that commands and the window share, each described once, and environment variables.

An option of a setting has the default and the number of its entry in `ocmm_core.settings`. The
options of single commands are in `ocmm_cli.options`, with these as one table.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ocmm_core.documents import resource
from ocmm_core.settings import Kind, SettingSpec, spec_of
from ocmm_core.typed_numbers import NumberField, number_field

DEFAULT_SEED = 3
DEMO_PLAN = resource("plans", "demo.toml")
DEMO_PART = resource("parts", "demo.toml")
DEFAULT_OPERATOR = "unnamed"
DEFAULT_SERIAL = "-"
"""An unknown serial number."""


@dataclass(frozen=True, slots=True)
class Option:
    """One option or argument of commands."""

    name: str
    """Name of the parameter of the command."""
    default: Any
    """``...`` if required."""
    text: str
    number: str = ""
    """Name of the field that reads a number (`typed_numbers`)."""
    flags: str = ""
    """As typed, separated by blanks; empty: the name with two hyphens."""
    metavar: str | None = None
    choices: tuple[str, ...] = ()
    is_argument: bool = False
    setting: str = ""
    """Key of the setting that it overrides."""

    @property
    def typed(self) -> tuple[str, ...]:
        """Return the forms that are typed, such as ``--output`` and ``-o``."""
        return tuple(self.flags.split()) or ("--" + self.name.replace("_", "-"),)

    @property
    def field(self) -> NumberField | None:
        """Return what reads its number; KeyError if the field is not listed."""
        return number_field(self.number) if self.number else None

    @property
    def spec(self) -> SettingSpec:
        """Return the setting that it overrides; InputError without one."""
        return spec_of(self.setting)


def argument(name: str, default: Any, text: str, number: str = "", metavar: str = "") -> Option:
    """Return an argument, which has no flag."""
    return Option(name, default, text, number, metavar=metavar or None, is_argument=True)


def _opt(key: str, name: str, text: str, **more: Any) -> Option:
    """Return the option of a setting; the choices of a text are suggestions only."""
    spec = spec_of(key)
    choices = spec.choices if spec.kind is Kind.CHOICE else ()
    made = Option(name, spec.default, text, spec.number, choices=choices, setting=key)
    return replace(made, **more)


OF_SETTINGS = (
    _opt("instrument.source", "source", "Source of frames, see ocmm measure --help."),
    _opt("instrument.rig", "rig", "Rig document: the cameras."),
    _opt("instrument.probe", "probe", "Probe document: LEDs and tip."),
    _opt("instrument.tip", "tip", "Name of the mounted tip. A name other than before records a tip "
         "change; the tip must then be checked."),
    _opt("instrument.reference", "reference", "Reference body document (TOML): LEDs fixed on the "
         "part or its table. All results are relative to it, so a nudged camera frame or a moved "
         "table does not matter."),
    _opt("instrument.calibrations", "calibrations", "Calibration folder. Default: that of this "
         "user for real cameras; virtual ones use the rig document itself."),
    _opt("instrument.probes", "probes", "Probe record folder. Default: that of this user for real "
         "cameras; virtual ones use the probe document itself."),
    _opt("instrument.check_after_h", "check_after",
         "Hours without a point or check after which the tip must be checked."),
    _opt("instrument.bus_processor", "bus_processor", "Processor that the camera bus stays on, "
         "0 first. Default: the last of four or more."),
    _opt("job.folder", "out", "Folder for the job file and the report."),
    _opt("job.operator", "operator", "Operator name."),
    _opt("temperature.probe_design", "probe_design", "Probe design document: growth and bending "
         "enter U, and the probe can be temperature-compensated."),
    _opt("temperature.probe_c", "probe_temperature", "Of the probe now, °C."),
    _opt("temperature.compensate_probe", "compensate_probe",
         "Compensate the probe geometry for its temperature."),
    _opt("temperature.part_c", "part_temperature", "Of the part now, °C."),
    _opt("temperature.part_expansion_ppm", "part_expansion",
         "Expansion of the part, 1e-6/K; default: the plan's material."),
    _opt("temperature.compensate_part", "compensate_part", "Report coordinates at 20 °C."),
    _opt("temperature.sigma_k", "temperature_sigma",
         "Standard uncertainty of each temperature, K."),
    _opt("temperature.thermometer", "temperature_u", "Its U (k = 2), K, or the id of the "
         "thermometer in the register (ocmm artefact)."),
    _opt("stream.port", "stream", "Stream points, button and poses to other programs, as JSON "
         "lines on this TCP port (0: any free port). Default: off.", number="port", metavar="PORT"),
    _opt("stream.host", "stream_host", "Address of the stream. Non-local addresses need a token."),
    _opt("stream.token", "stream_token", "File whose first line is the token required from stream "
         "clients; readable by you alone (chmod 600)."),
    _opt("stream.certificate", "stream_cert", "Certificate (PEM): the stream speaks TLS."),
    _opt("stream.key", "stream_key", "Private key of that certificate (PEM, no password)."),
    _opt("window.theme", "theme", "Colours of the window; T changes them."),
    _opt("window.far", "far", "Start in the far view; F11 changes it."),
    _opt("window.sounds", "sound", "No sounds.", flags="--silent"),
)  # fmt: skip
"""Arguments of the window that override settings; commands take them without settings."""

OF_SERVER = (
    _opt("serve.dialect", "dialect", "Edition that the measuring program speaks."),
    _opt("serve.host", "host", "Address to listen on; others than local need --allow."),
    _opt("serve.port", "port", "TCP port; 0: any free port.", number="port"),
    _opt("serve.allow", "allow", "Address or network of a client; can be repeated."),
    _opt("serve.shift_sign", "shift_sign", "Meaning of X0, Y0, Z0 in SetCsyTransformation: origin "
         "of the part in the machine, or offset added after the rotation."),
    _opt("serve.point", "point", "ball: centre of the probe ball; surface: compensated along the "
         "nominal direction of the program, else along that of the touch, with radius 0."),
)  # fmt: skip
"""Options of the server for measuring programs, which the window takes from its settings."""

SHARED = (
    Option("plan", DEMO_PLAN, "Plan document (TOML): what to measure."),
    Option("part", DEMO_PART, "Part document of the virtual rig: the true part."),
    Option("seed", DEFAULT_SEED, "Seed of the virtual rig: its noise, its errors.", "seed"),
    Option("serial", DEFAULT_SERIAL, "Serial number of the part."),
    Option("force", False, "Use a network interface although the computer itself uses it."),
    Option("uncalibrated", False, "Measure although the calibration or tip records are missing or "
           "not valid: every verdict is NOT PROVEN, also in the report."),
)  # fmt: skip
"""Options of a job, never stored."""

SPEED = Option(
    "speed", 0.0, "Speed of virtual rig and replay: 1 is real time, 0 full speed.", "speed"
)
WINDOW = (
    *OF_SETTINGS,
    *SHARED,
    replace(SPEED, default=1.0),
    argument("job", None, "Job file to open, read-only."),
    Option("start", False, "Without a job: open the Start page instead of measuring at once."),
    Option("size", None, "Of the window, e.g. 1280x720; default: maximised."),
    Option("quit_after", 0.0, "Close automatically after this time.", "seconds-of-a-doctor",
           metavar="SECONDS"),
    Option("screenshot", (), "Save pictures of the window when it closes automatically.",
           metavar="FILE"),
)  # fmt: skip
"""Arguments of ``ocmm window``."""

VARIABLES = (
    Option("OCMM_LANGUAGE", "", "Language of all texts, en or de; --language sets it."),
    Option("OCMM_INTERFACE", "", "Network adapter of the cameras, for the service of their bus."),
    Option("OCMM_USER", "", "User whose key signs for the station, when the package is installed."),
    Option("OCMM_WINDOW", "--start", "Arguments of the window that a station starts."),
    Option("LC_ALL LC_MESSAGES LANG", "", "Language of the system, if no other is selected."),
    Option("DISPLAY WAYLAND_DISPLAY XDG_RUNTIME_DIR", "", "The screen of the window."),
    Option("QT_QPA_PLATFORM", "", "How Qt shows the window; offscreen for pictures and reports."),
    Option("QT_SCALE_FACTOR", "", "Zoom of the window; it wins over the setting."),
    Option("NUMBA_CPU_NAME", "", "Kind of processor that loops are compiled for."),
    Option("OPENBLAS_NUM_THREADS", "1", "Threads of linear algebra, for the same digits anywhere."),
    Option("PYTHONSAFEPATH", "1", "Set for child processes: no modules of the working folder."),
    Option("PATH", "", "Folders of the programs ip and unshare of the virtual wire."),
    Option("SUDO_USER USER", "", "User that the doctor checks the rights of."),
    Option("XDG_CONFIG_DIRS XDG_CONFIG_HOME", "", "Folders of the settings of station and user."),
    Option("GENICAM_GENTL64_PATH", "", "Folders of the GenTL producers of camera makers."),
    Option("TZ", "", "Time zone that the doctor compares with that of the computer."),
)  # fmt: skip
"""Environment variables that the program reads or sets, and what each is for."""

"""Table of all settings; the only place that lists them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.surroundings import TEMPERATURE

Value = str | float | bool | int | Path | tuple[str, ...] | dict[str, tuple[str, ...]] | None
"""Value of a setting; None if unset."""


class Kind(Enum):
    """Types of input."""

    TEXT = "text"
    CHOICE = "choice"
    SWITCH = "yes or no"
    NUMBER = "number"
    WHOLE = "whole number"
    FILE = "file"
    FOLDER = "folder"
    LINES = "lines"
    KEYS = "keys"


class Scope(Enum):
    """Document that a setting is written to by default."""

    STATION = "station"
    USER = "user"


class Applies(Enum):
    """When a change takes effect."""

    NOW = "at once"
    REOPEN = "when the job is opened again"


@dataclass(frozen=True, slots=True)
class SettingSpec:
    key: str
    """``section.name``."""
    kind: Kind
    default: Value
    scope: Scope
    applies: Applies
    label: str
    tip: str
    """`label`, `tip`: Texts of its input field, in English."""
    choices: tuple[str, ...] = ()
    """For `Kind.CHOICE`; suggestions for texts."""
    least: float = 0.0
    most: float = 0.0
    """`least`, `most`: Limits of a number, in ``unit``."""
    unit: str = ""
    schema: str = ""
    """Schema of the document in a file."""
    option: str = ""
    """Command-line option that overrides it."""

    @property
    def section(self) -> str:
        return self.key.partition(".")[0]

    @property
    def name(self) -> str:
        return self.key.partition(".")[2]


def later(sentence: str) -> str:
    """Mark a sentence for translation; the window translates what it shows."""
    return sentence


SECTIONS = {
    "instrument": later("Instrument"),
    "job": later("Jobs"),
    "temperature": later("Temperature"),
    "report": later("Report head"),
    "stream": later("Live stream"),
    "archive": later("Archive"),
    "window": later("Window"),
}
"""Sections in the order shown, with their titles."""

_TEMPERATURES = (TEMPERATURE.least, TEMPERATURE.most)
_S, _U, _NOW, _LATER = Scope.STATION, Scope.USER, Applies.NOW, Applies.REOPEN


def _spec(
    key: str, kind: Kind, default: Value, scope: Scope, applies: Applies, label: str, tip: str,
    *, choices: tuple[str, ...] = (), limits: tuple[float, float] = (0.0, 0.0), unit: str = "",
    schema: str = "", option: str = "",
) -> SettingSpec:  # fmt: skip
    least, most = limits
    return SettingSpec(
        key, kind, default, scope, applies, label, tip, choices, least, most, unit, schema, option
    )


SETTINGS: tuple[SettingSpec, ...] = (
    _spec(
        "instrument.source", Kind.TEXT, "simulated", _S, _LATER, later("Cameras"),
        later("simulated, ethercat:INTERFACE, ethercat:service or replay:FILE"),
        choices=("simulated", "ethercat:service", "ethercat:virtual"), option="--source",
    ),
    _spec(
        "instrument.rig", Kind.FILE, resource("rigs", "recommended.toml"), _S, _LATER, later("Rig"),
        later("Document of the cameras"), schema="ocmm.rig/1", option="--rig",
    ),
    _spec(
        "instrument.probe", Kind.FILE, resource("probes", "standard.toml"), _S, _LATER,
        later("Probe"),
        later("Document of the probe"), schema="ocmm.probe/1", option="--probe",
    ),
    _spec(
        "instrument.tip", Kind.TEXT, None, _S, _LATER, later("Tip"),
        later("Name of the mounted tip; empty: as its records say"), option="--tip",
    ),
    _spec(
        "instrument.reference", Kind.FILE, None, _S, _LATER, later("Reference body"),
        later("LEDs fixed to the part; empty: none"), schema="ocmm.reference/1",
        option="--reference",
    ),
    _spec(
        "instrument.calibrations", Kind.FOLDER, None, _S, _LATER, later("Camera records"),
        later("Folder of calibrations; empty: of this user"), option="--calibrations",
    ),
    _spec(
        "instrument.probes", Kind.FOLDER, None, _S, _LATER, later("Tip records"),
        later("Folder of probe and tip records; empty: of this user"), option="--probes",
    ),
    _spec(
        "instrument.check_after_h", Kind.NUMBER, 8.0, _S, _LATER, later("Check the tip after"),
        later("Hours without a point or a check"), limits=(0.1, 168.0), unit="h",
        option="--check-after",
    ),
    _spec(
        "instrument.bus_processor", Kind.WHOLE, None, _S, _LATER, later("Processor of the bus"),
        later("For the camera bus, 0 first; empty: any"),
        limits=(0.0, 1023.0), option="--bus-processor",
    ),
    _spec(
        "job.folder", Kind.FOLDER, Path.home() / "ocmm-out", _U, _LATER, later("Job folder"),
        later("Where jobs and reports are written"), option="--out",
    ),
    _spec(
        "job.rescue", Kind.FOLDER, None, _S, _LATER, later("Second job folder"),
        later("For jobs whose file was removed, moved or replaced; empty: data folder of the user"),
    ),
    _spec(
        "job.plans", Kind.FOLDER, None, _S, _NOW, later("Plan folder"),
        later("Where plans are looked for; empty: recent places only"),
    ),
    _spec(
        "job.released_only", Kind.SWITCH, False, _S, _LATER, later("Released plans only"),
        later("Refuse plans that are not released, or were changed after the release"),
    ),
    _spec(
        "job.operator", Kind.TEXT, "", _U, _NOW, later("Operator"), later("Proposed for a new job"),
        option="--operator",
    ),
    _spec(
        "job.operators", Kind.LINES, (), _S, _NOW, later("Users"),
        later("Names proposed as operator, parted by semicolons"),
    ),
    _spec(
        "temperature.part_c", Kind.NUMBER, None, _S, _LATER, later("Part temperature"),
        later("Measured today; empty: unknown"), limits=_TEMPERATURES, unit="°C",
        option="--part-temperature",
    ),
    _spec(
        "temperature.part_expansion_ppm", Kind.NUMBER, None, _S, _LATER, later("Part expansion"),
        later("Empty: by the material of the plan"), limits=(-200.0, 200.0), unit="1e-6/K",
        option="--part-expansion",
    ),
    _spec(
        "temperature.compensate_part", Kind.SWITCH, False, _S, _LATER, later("Compensate the part"),
        later("Report coordinates at 20 °C"), option="--compensate-part",
    ),
    _spec(
        "temperature.probe_c", Kind.NUMBER, None, _S, _LATER, later("Probe temperature"),
        later("Measured today; empty: unknown"), limits=_TEMPERATURES, unit="°C",
        option="--probe-temperature",
    ),
    _spec(
        "temperature.probe_design", Kind.FILE, None, _S, _LATER, later("Probe design"),
        later("Document of its materials: growth and bending"), schema="ocmm.probe-design/1",
        option="--probe-design",
    ),
    _spec(
        "temperature.compensate_probe", Kind.SWITCH, False, _S, _LATER,
        later("Compensate the probe"),
        later("Use its geometry at its temperature"), option="--compensate-probe",
    ),
    _spec(
        "temperature.sigma_k", Kind.NUMBER, None, _S, _LATER, later("Standard uncertainty"),
        later("Of each temperature"), limits=(0.01, 10.0), unit="K", option="--temperature-sigma",
    ),
    _spec(
        "temperature.thermometer", Kind.TEXT, "", _S, _LATER, later("Thermometer"),
        later("Instead: its U (k = 2) in K, or its id in the register"), option="--temperature-u",
    ),
    _spec(
        "temperature.valid_h", Kind.NUMBER, 8.0, _S, _LATER, later("Temperatures hold for"),
        later("Older ones are not used: measure again"), limits=(0.1, 24.0), unit="h",
    ),
    _spec(
        "report.laboratory", Kind.TEXT, "", _S, _NOW, later("Laboratory"),
        later("Over every report"),
    ),
    _spec(
        "report.address", Kind.LINES, (), _S, _NOW, later("Address"),
        later("Lines, parted by semicolons"),
    ),
    _spec(
        "report.logo", Kind.FILE, None, _S, _NOW, later("Logo"), later("PNG or JPEG"),
    ),
    _spec(
        "report.contact", Kind.TEXT, "", _S, _NOW, later("Contact"),
        later("Telephone, mail or page"),
    ),
    _spec(
        "report.accreditation", Kind.TEXT, "", _S, _NOW, later("Accreditation"),
        later("Number of the laboratory; empty: none"),
    ),
    _spec(
        "report.country", Kind.TEXT, "", _S, _NOW, later("Country"),
        later("Two capital letters, for digital certificates"),
    ),
    _spec(
        "report.place", Kind.TEXT, "", _S, _NOW, later("Place"),
        later("Where it is measured, unless a job says otherwise"),
    ),
    _spec(
        "report.machine", Kind.TEXT, "", _S, _NOW, later("Machine"),
        later("Name of the measuring machine"),
    ),
    _spec(
        "report.machine_serial", Kind.TEXT, "", _S, _NOW, later("Its serial number"),
        later("Of the measuring machine"),
    ),
    _spec(
        "report.machine_inventory", Kind.TEXT, "", _S, _NOW, later("Its inventory number"),
        later("As the laboratory calls it"),
    ),
    _spec(
        "report.signatures", Kind.LINES, (), _S, _NOW, later("Signatures"),
        later("Below the lines, 1 to 3, parted by semicolons"),
    ),
    _spec(
        "report.formats", Kind.LINES, ("polyworks",), _S, _NOW, later("Formats of E"),
        later("polyworks; qif; dfq; xlsx; json; fai; pdf: written together, parted by semicolons"),
        choices=("polyworks", "qif", "dfq", "xlsx", "json", "fai", "pdf"),
    ),
    _spec(
        "report.template", Kind.FILE, None, _S, _NOW, later("Template"),
        later("Report template; empty: the plain one"), schema="ocmm.report-template/1",
        option="--template",
    ),
    _spec(
        "report.language", Kind.CHOICE, "window", _S, _NOW, later("Report language"),
        later("Of reports on paper; window: that of the window"),
        choices=(later("window"), "en", "de"),
    ),
    _spec(
        "report.units", Kind.CHOICE, "window", _S, _NOW, later("Unit of reports"),
        later("Of reports on paper and workbooks; window: that of the window"),
        choices=(later("window"), "mm", later("inch")),
    ),
    _spec(
        "stream.port", Kind.WHOLE, None, _S, _LATER, later("Port"),
        later("Points and poses for other programs; empty: off"), limits=(1.0, 65535.0),
        option="--stream",
    ),
    _spec(
        "stream.host", Kind.TEXT, "127.0.0.1", _S, _LATER, later("Address of this computer"),
        later("Other computers need a token"), option="--stream-host",
    ),
    _spec(
        "stream.token", Kind.FILE, None, _S, _LATER, later("Token"),
        later("File with the token, readable by you alone"), option="--stream-token",
    ),
    _spec(
        "stream.certificate", Kind.FILE, None, _S, _LATER, later("Certificate"),
        later("PEM; the stream then speaks TLS"), option="--stream-cert",
    ),
    _spec(
        "stream.key", Kind.FILE, None, _S, _LATER, later("Private key"),
        later("PEM, of that certificate"), option="--stream-key",
    ),
    _spec(
        "archive.address", Kind.TEXT, "local", _S, _LATER, later("Archive"),
        later("Place: local, off, a file, or a PostgreSQL database; without password"),
        choices=("local", "off"), option="--archive",
    ),
    _spec(
        "archive.station", Kind.TEXT, "", _S, _LATER, later("Name of this station"),
        later("In the archive; empty: the name of this computer"),
    ),
    _spec(
        "archive.password", Kind.FILE, None, _S, _LATER, later("Password"),
        later("File that only you can read"),
    ),
    _spec(
        "window.language", Kind.CHOICE, "system", _U, _LATER, later("Language"),
        later("Of all sentences; system: that of the computer"),
        choices=(later("system"), "en", "de"),
    ),
    _spec(
        "window.decimal", Kind.CHOICE, "locale", _U, _LATER, later("Decimal sign"),
        later("On screen; locale: that of the language"),
        choices=(later("locale"), later("point"), later("comma")),
    ),
    _spec(
        "window.units", Kind.CHOICE, "mm", _U, _LATER, later("Unit of length"),
        later("On screen; files for programs are in mm"), choices=("mm", later("inch")),
    ),
    _spec(
        "window.theme", Kind.CHOICE, "dark", _U, _NOW, later("Theme"),
        later("Colours of the window"),
        choices=(later("dark"), later("light"), later("contrast")), option="--theme",
    ),
    _spec(
        "window.zoom", Kind.WHOLE, 100, _U, _NOW, later("Zoom"),
        later("Of the size that fits the screen; Ctrl + and Ctrl - change it"),
        limits=(80.0, 200.0), unit="%",
    ),
    _spec(
        "window.gloves", Kind.SWITCH, False, _U, _NOW, later("Glove mode"),
        later("Buttons and rows of at least 15 mm on this screen"),
    ),
    _spec(
        "window.ruler_mm", Kind.NUMBER, None, _S, _NOW, later("Length of the line below"),
        later("By a ruler; empty: as the screen says"),
        limits=(15.0, 600.0), unit="mm",
    ),
    _spec(
        "window.sounds", Kind.SWITCH, True, _U, _NOW, later("Sounds"),
        later("Play sounds"), option="--silent",
    ),
    _spec(
        "window.volume", Kind.WHOLE, 80, _U, _NOW, later("Volume"),
        later("Of all sounds; Test of sounds plays them"), limits=(5.0, 100.0), unit="%",
    ),
    _spec(
        "window.far", Kind.SWITCH, False, _U, _LATER, later("Far view first"),
        later("Open jobs in the view for three metres"), option="--far",
    ),
    _spec(
        "window.keys", Kind.KEYS, {}, _U, _NOW, later("Keys"),
        later("Keys that differ from those shipped"),
    ),
)  # fmt: skip

_BY_KEY = {spec.key: spec for spec in SETTINGS}


def spec_of(key: str) -> SettingSpec:
    """Return the entry of a setting; InputError if unknown."""
    try:
        return _BY_KEY[key]
    except KeyError:
        raise InputError(
            "settings.unknown",
            f"{key!r} is not a setting.",
            "The settings are listed by: ocmm settings show.",
        ) from None

"""Table of all settings; the only place that lists them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import inf
from pathlib import Path

from ocmm_core.ambient import Quantity
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.typed_numbers import number_field

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
    number: str = ""
    """Name of the field that has unit and limits of a number (`typed_numbers`)."""
    schemas: tuple[str, ...] = ()
    """Schemas that the document in a file may have."""

    @property
    def section(self) -> str:
        return self.key.partition(".")[0]

    @property
    def name(self) -> str:
        return self.key.partition(".")[2]

    @property
    def quantity(self) -> Quantity:
        """Return unit and limits; all numbers without unit if it has none."""
        return number_field(self.number).quantity if self.number else _ANY


def later(sentence: str) -> str:
    """Mark a sentence for translation; the window translates what it shows."""
    return sentence


SECTIONS = {
    "instrument": later("Instrument"),
    "job": later("Jobs"),
    "temperature": later("Temperature"),
    "report": later("Report head"),
    "stream": later("Live stream"),
    "serve": later("Measuring programs"),
    "screen": later("Second screen"),
    "archive": later("Archive"),
    "window": later("Window"),
}
"""Sections in the order shown, with their titles."""

DEFAULT_SOURCE = "simulated"
RECOMMENDED_RIG = resource("rigs", "recommended.toml")
STANDARD_PROBE = resource("probes", "standard.toml")

_ANY = Quantity("", "", -inf, inf)
_S, _U, _NOW, _LATER = Scope.STATION, Scope.USER, Applies.NOW, Applies.REOPEN


SETTINGS: tuple[SettingSpec, ...] = (
    SettingSpec(
        "instrument.source", Kind.TEXT, DEFAULT_SOURCE, _S, _LATER, later("Cameras"),
        later("simulated, ethercat:INTERFACE, ethercat:service, genicam:SERIAL,SERIAL, a tracker "
              "(igtl:, natnet:, ndi:, qtm:) or replay:FILE"),
        choices=("simulated", "ethercat:service", "ethercat:virtual", "genicam:virtual")),
    SettingSpec(
        "instrument.rig", Kind.FILE, RECOMMENDED_RIG, _S, _LATER, later("Rig"),
        later("Document of the cameras or of the tracker"),
        schemas=("ocmm.rig/1", "ocmm.tracker/1")),
    SettingSpec(
        "instrument.probe", Kind.FILE, STANDARD_PROBE, _S, _LATER,
        later("Probe"), later("Document of the probe"), schemas=("ocmm.probe/1",)),
    SettingSpec(
        "instrument.tip", Kind.TEXT, None, _S, _LATER, later("Tip"),
        later("Name of the mounted tip; empty: as its records say")),
    SettingSpec(
        "instrument.reference", Kind.FILE, None, _S, _LATER, later("Reference body"),
        later("LEDs fixed to the part; empty: none"), schemas=("ocmm.reference/1",)),
    SettingSpec(
        "instrument.calibrations", Kind.FOLDER, None, _S, _LATER, later("Camera records"),
        later("Folder of calibrations; empty: of this user")),
    SettingSpec(
        "instrument.probes", Kind.FOLDER, None, _S, _LATER, later("Tip records"),
        later("Folder of probe and tip records; empty: of this user")),
    SettingSpec(
        "instrument.check_after_h", Kind.NUMBER, 8.0, _S, _LATER, later("Check the tip after"),
        later("Hours without a point or a check"), number="hours-between-checks"),
    SettingSpec(
        "instrument.bus_processor", Kind.WHOLE, None, _S, _LATER, later("Processor of the bus"),
        later("For the camera bus, 0 first; empty: any"),
        number="processor"),
    SettingSpec(
        "job.folder", Kind.FOLDER, Path.home() / "ocmm-out", _U, _LATER, later("Job folder"),
        later("Where jobs and reports are written")),
    SettingSpec(
        "job.rescue", Kind.FOLDER, None, _S, _LATER, later("Second job folder"),
        later("For jobs whose file was removed, moved or replaced; empty: data folder of the user"),
    ),
    SettingSpec(
        "job.plans", Kind.FOLDER, None, _S, _NOW, later("Plan folder"),
        later("Folder searched for plans; empty: recent places only")),
    SettingSpec(
        "job.released_only", Kind.SWITCH, False, _S, _LATER, later("Released plans only"),
        later("Refuse plans that are not released, or were changed after the release")),
    SettingSpec(
        "job.operator", Kind.TEXT, "", _U, _NOW, later("Operator"),
        later("Proposed for a new job")),
    SettingSpec(
        "job.operators", Kind.LINES, (), _S, _NOW, later("Users"),
        later("Names proposed as operator, parted by semicolons")),
    SettingSpec(
        "temperature.part_c", Kind.NUMBER, None, _S, _LATER, later("Part temperature"),
        later("Measured today; empty: unknown"), number="temperature"),
    SettingSpec(
        "temperature.part_expansion_ppm", Kind.NUMBER, None, _S, _LATER, later("Part expansion"),
        later("Empty: by the material of the plan"), number="part-expansion"),
    SettingSpec(
        "temperature.compensate_part", Kind.SWITCH, False, _S, _LATER, later("Compensate the part"),
        later("Report coordinates at 20 °C")),
    SettingSpec(
        "temperature.probe_c", Kind.NUMBER, None, _S, _LATER, later("Probe temperature"),
        later("Measured today; empty: unknown"), number="temperature"),
    SettingSpec(
        "temperature.probe_design", Kind.FILE, None, _S, _LATER, later("Probe design"),
        later("Document of its materials: growth and bending"), schemas=("ocmm.probe-design/1",)),
    SettingSpec(
        "temperature.compensate_probe", Kind.SWITCH, False, _S, _LATER,
        later("Compensate the probe"),
        later("Use its geometry at its temperature")),
    SettingSpec(
        "temperature.sigma_k", Kind.NUMBER, None, _S, _LATER, later("Standard uncertainty"),
        later("Of each temperature"), number="temperature-sigma"),
    SettingSpec(
        "temperature.thermometer", Kind.TEXT, "", _S, _LATER, later("Thermometer"),
        later("Instead: its U (k = 2) in K, or its id in the register")),
    SettingSpec(
        "temperature.valid_h", Kind.NUMBER, 8.0, _S, _LATER, later("Temperatures hold for"),
        later("Older ones are not used: measure again"), number="hours-of-validity"),
    SettingSpec(
        "report.laboratory", Kind.TEXT, "", _S, _NOW, later("Laboratory"),
        later("Over every report")),
    SettingSpec(
        "report.address", Kind.LINES, (), _S, _NOW, later("Address"),
        later("Lines, parted by semicolons")),
    SettingSpec(
        "report.logo", Kind.FILE, None, _S, _NOW, later("Logo"), later("PNG or JPEG")),
    SettingSpec(
        "report.contact", Kind.TEXT, "", _S, _NOW, later("Contact"),
        later("Telephone, mail or page")),
    SettingSpec(
        "report.accreditation", Kind.TEXT, "", _S, _NOW, later("Accreditation"),
        later("Number of the laboratory; empty: none")),
    SettingSpec(
        "report.country", Kind.TEXT, "", _S, _NOW, later("Country"),
        later("Two capital letters, for digital certificates")),
    SettingSpec(
        "report.place", Kind.TEXT, "", _S, _NOW, later("Place"),
        later("Place of measurement, unless a job states another")),
    SettingSpec(
        "report.machine", Kind.TEXT, "", _S, _NOW, later("Machine"),
        later("Name of the measuring machine")),
    SettingSpec(
        "report.machine_serial", Kind.TEXT, "", _S, _NOW, later("Its serial number"),
        later("Of the measuring machine")),
    SettingSpec(
        "report.machine_inventory", Kind.TEXT, "", _S, _NOW, later("Its inventory number"),
        later("As the laboratory calls it")),
    SettingSpec(
        "report.signatures", Kind.LINES, (), _S, _NOW, later("Signatures"),
        later("Below the lines, 1 to 3, parted by semicolons")),
    SettingSpec(
        "report.formats", Kind.LINES, ("polyworks",), _S, _NOW, later("Formats of E"),
        later("polyworks; qif; dfq; xlsx; json; fai; cloud; points; pdf: written together, "
              "parted by semicolons"),
        choices=(
            "polyworks", "qif", "dfq", "xlsx", "json", "fai", "cloud", "points", "pdf")),
    SettingSpec(
        "report.template", Kind.FILE, None, _S, _NOW, later("Template"),
        later("Report template; empty: the plain one"), schemas=("ocmm.report-template/1",)),
    SettingSpec(
        "report.language", Kind.CHOICE, "window", _S, _NOW, later("Report language"),
        later("Of reports on paper; window: that of the window"),
        choices=(later("window"), "en", "de")),
    SettingSpec(
        "report.units", Kind.CHOICE, "window", _S, _NOW, later("Unit of reports"),
        later("Of reports on paper and workbooks; window: that of the window"),
        choices=(later("window"), "mm", later("inch"))),
    SettingSpec(
        "stream.port", Kind.WHOLE, None, _S, _LATER, later("Port"),
        later("Points and poses for other programs; empty: off"), number="fixed-port"),
    SettingSpec(
        "stream.host", Kind.TEXT, "127.0.0.1", _S, _LATER, later("Address of this computer"),
        later("Other computers need a token")),
    SettingSpec(
        "stream.token", Kind.FILE, None, _S, _LATER, later("Token"),
        later("File with the token, readable by you alone")),
    SettingSpec(
        "stream.certificate", Kind.FILE, None, _S, _LATER, later("Certificate"),
        later("PEM; the stream then speaks TLS")),
    SettingSpec(
        "stream.key", Kind.FILE, None, _S, _LATER, later("Private key"),
        later("PEM, of that certificate")),
    SettingSpec(
        "serve.dialect", Kind.CHOICE, "1.4", _S, _NOW, later("Edition of I++ DME"),
        later("The one that the measuring program speaks"), choices=("1.4", "2.5")),
    SettingSpec(
        "serve.host", Kind.TEXT, "127.0.0.1", _S, _NOW, later("Address of this computer"),
        later("Other computers must be on the list below")),
    SettingSpec(
        "serve.port", Kind.WHOLE, 1294, _S, _NOW, later("Port"),
        later("TCP port of the measuring program"), number="fixed-port"),
    SettingSpec(
        "serve.allow", Kind.LINES, (), _S, _NOW, later("Permitted computers"),
        later("Addresses or networks, parted by semicolons")),
    SettingSpec(
        "serve.shift_sign", Kind.CHOICE, "origin", _S, _NOW, later("Sign of the shift"),
        later("X0, Y0, Z0: origin of the part, or offset added after the rotation"),
        choices=(later("origin"), later("offset"))),
    SettingSpec(
        "serve.point", Kind.CHOICE, "ball", _S, _NOW, later("Point that is sent"),
        later("ball: its centre; surface: compensated, with radius 0"),
        choices=(later("ball"), later("surface"))),
    SettingSpec(
        "screen.host", Kind.TEXT, "127.0.0.1", _S, _NOW, later("Address of this computer"),
        later("The one that the tablet reaches, or 0.0.0.0 for all; 127.0.0.1: this one only")),
    SettingSpec(
        "screen.port", Kind.WHOLE, 1391, _S, _NOW, later("Port"),
        later("TCP port of the page for a tablet or phone"), number="fixed-port"),
    SettingSpec(
        "screen.control", Kind.SWITCH, False, _S, _NOW, later("Buttons"),
        later("The page can undo, finish and choose; in a network only with the certificate")),
    SettingSpec(
        "archive.address", Kind.TEXT, "local", _S, _LATER, later("Archive"),
        later("Place: local, off, a file, or a PostgreSQL database; without password"),
        choices=("local", "off")),
    SettingSpec(
        "archive.station", Kind.TEXT, "", _S, _LATER, later("Name of this station"),
        later("In the archive; empty: the name of this computer")),
    SettingSpec(
        "archive.password", Kind.FILE, None, _S, _LATER, later("Password"),
        later("File that only you can read")),
    SettingSpec(
        "window.language", Kind.CHOICE, "system", _U, _LATER, later("Language"),
        later("Of all sentences; system: that of the computer"),
        choices=(later("system"), "en", "de")),
    SettingSpec(
        "window.decimal", Kind.CHOICE, "locale", _U, _LATER, later("Decimal sign"),
        later("On screen; locale: that of the language"),
        choices=(later("locale"), later("point"), later("comma"))),
    SettingSpec(
        "window.units", Kind.CHOICE, "mm", _U, _LATER, later("Unit of length"),
        later("On screen; files for programs are in mm"), choices=("mm", later("inch"))),
    SettingSpec(
        "window.theme", Kind.CHOICE, "dark", _U, _NOW, later("Theme"),
        later("Colours of the window"),
        choices=(later("dark"), later("light"), later("contrast"))),
    SettingSpec(
        "window.zoom", Kind.WHOLE, 100, _U, _NOW, later("Zoom"),
        later("Of the size that fits the screen; Ctrl + and Ctrl - change it"),
        number="zoom"),
    SettingSpec(
        "window.gloves", Kind.SWITCH, False, _U, _NOW, later("Glove mode"),
        later("Buttons and rows of at least 15 mm on this screen")),
    SettingSpec(
        "window.ruler_mm", Kind.NUMBER, None, _S, _NOW, later("Length of the line below"),
        later("By a ruler; empty: as stated by the screen"),
        number="ruler"),
    SettingSpec(
        "window.sounds", Kind.SWITCH, True, _U, _NOW, later("Sounds"),
        later("Play sounds")),
    SettingSpec(
        "window.volume", Kind.WHOLE, 80, _U, _NOW, later("Volume"),
        later("Of all sounds; Test of sounds plays them"), number="volume"),
    SettingSpec(
        "window.far", Kind.SWITCH, False, _U, _LATER, later("Far view first"),
        later("Open jobs in the view for three metres")),
    SettingSpec(
        "window.keys", Kind.KEYS, {}, _U, _NOW, later("Keys"),
        later("Keys that differ from those shipped")),
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

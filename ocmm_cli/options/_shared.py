"""Options of commands of several groups."""

from dataclasses import replace

from ocmm_core.composition import source_help
from ocmm_core.options import DEFAULT_OPERATOR, OF_SETTINGS, SHARED, SPEED, Option, argument

_SOURCE, *_OF_SETTINGS = (one for one in OF_SETTINGS if not one.setting.startswith("window."))

_ALL = (
    replace(_SOURCE, text=f"Source of frames. {source_help()}"), *_OF_SETTINGS, *SHARED, SPEED,
    Option("room", "", "Temperature of the room, °C: a number or a range."),
    Option("humidity", "", "Of the air, %."),
    Option("pressure", "", "Of the air, hPa."),
    Option("who", DEFAULT_OPERATOR, "Name for the record."),
    Option("incomplete", False, "Report an incomplete job too; its pages and files say "
           "INCOMPLETE."),
    Option("customer", "", "For whom."),
    Option("json_file", None, "Write the recall to this file, sealed.", flags="--json"),
    Option("pdf_file", None, "Write the recall report to this file.", flags="--pdf"),
    Option("unit", "", "Unit of the lengths in the file, in place of the stated one: inch."),
    Option("columns", "", "Meaning of each column, '-' for one that is not read: name,x,y,z,-."),
    Option("decimal", "", "Decimal sign of the file: point or comma."),
    Option("skip", "", "Lines that are not read: 3 for the first three, or 4-9,12-12."),
    argument("camera", ..., "Name of the camera in the rig."),
    Option("temperature", None, "Ambient temperature, degrees Celsius; default: read the "
           "thermometer of --temperature-u.", "temperature"),
    Option("reason", ..., "Why."),
    Option("site_scheduler", "", "Compute on the workers of this Dask scheduler, e.g. "
           "tls://server:8786; default: this computer.", flags="--scheduler", metavar="ADDRESS"),
    Option("site_workers", None, "Processes of this computer. Default: as it pays.", "workers",
           flags="--workers"),
    Option("site_ca", None, "PEM file: who signed the certificates of the scheduler.",
           flags="--scheduler-ca"),
    Option("site_cert", None, "PEM file: certificate of this computer.", flags="--scheduler-cert"),
    Option("site_key", None, "PEM file: its key.", flags="--scheduler-key"),
    Option("site_unencrypted", False, "Allow a scheduler without TLS in a network: only where "
           "nobody else is in it.", flags="--unencrypted"),
)  # fmt: skip

TABLE = {
    "": _ALL,
    "ocmm": (
        Option("version", False, "Print the version."),
        Option("language", None,
               "Language of all texts; default: that of the window, or of the system."),
    ),
}  # fmt: skip
"""Of all commands, and of the program before the command."""

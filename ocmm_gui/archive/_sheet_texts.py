"""Keys, queries and fields of the Archive page, in words, and typed dates."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from ocmm_core.errors import InputError
from ocmm_gui.kit import ActionInfo, later, tr

D = TypeVar("D")

USE_WORDS = {
    "calibration": later("calibration"),
    "tip": later("tip"),
    "probe": later("probe"),
    "artefact": later("artefact"),
    "rig": later("rig"),
    "plan": later("plan"),
    "reference": later("reference body"),
}
"""Kinds of equipment, as shown."""

KEYS = (
    ActionInfo("ask", later("Ask"), later("Ask the archive"), ("F8",)),
    ActionInfo("next", later("Next question"), later("Choose the next question"), ("F6",)),
    ActionInfo(
        "export", later("Export"), later("Write the table to a file, .csv or .parquet"), ("F7",)
    ),
    ActionInfo("stop", later("Stop"), later("Stop; what is shown stays"), ("F9",)),
    ActionInfo(
        "recall", later("Recall"), later("Recall archived jobs, or back to the questions"), ("F10",)
    ),
    ActionInfo(
        "store",
        later("Store"),
        later("Store the recall; stations hold back what does not hold"),
        ("Shift+F8",),
    ),
)
TITLES = {
    "today": later("What was measured"),
    "trend": later("Trend of a characteristic"),
    "used": later("Which jobs used this"),
    "cpk": later("Cpk by month"),
    "passed": later("Who passed what"),
    "rr": later("R&R over stations"),
}
FIELDS = (
    ("part", later("Part"), later("name of the part")),
    ("characteristic", later("Characteristic"), later("as in the plan")),
    ("what", later("What"), later("hash, serial number or name")),
    ("operator", later("Operator"), later("empty: all")),
    ("station", later("Station"), later("empty: all")),
    ("first", later("From"), later("day, e.g. 2026-11-26; empty: today")),
    ("last", later("To"), later("day; empty: the same")),
)


def read_day(text: str, read: Callable[[str], D]) -> D:
    """Return a typed date; InputError if invalid."""
    try:
        return read(text)
    except ValueError:
        raise InputError(
            "archive.day",
            tr("{text} is no day.").format(text=text),
            tr("Write it like 2026-11-26."),
        ) from None

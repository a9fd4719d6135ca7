"""Translation of a workbook: words of the program, not names; programs read the rest."""

from __future__ import annotations

from dataclasses import replace

from ocmm_core.export.report._tables import JOB_STATE, Cell, ReportTable
from ocmm_core.wording import Speech

_SPOKEN = frozenset({
    "Verdict", "Test", "Control", "Type", "Component", "CoordinateSystem", "Criterion", "Note",
    "Association", "Frame", "Rule", "PartVerdict", "Flag", "Temperature", JOB_STATE,
})  # fmt: skip
"""Columns whose cells are words or sentences of the program."""

_SPOKEN_LINES = frozenset({
    "Part verdict", "Job state", "Decision rule", "Uncertainty", "Frame", "Complete",
    "Not proven because", "Temperatures", "Reported at 20 C", "Item", "Cameras", "Probe",
})  # fmt: skip
"""Lines of the front sheet with a translated value; others hold names, numbers and hashes."""

_NUMBERED = ("Cameras ", "Doubt ")
"""Start of numbered lines of sentences."""


def said_table(table: ReportTable, speech: Speech) -> ReportTable:
    """Return a translated table: its heads, and cells with words of the program."""
    spoken = [name in _SPOKEN for name in table.columns]
    rows = tuple(
        tuple(said(cell, speech) if say else cell for cell, say in zip(row, spoken, strict=True))
        for row in table.rows
    )
    return replace(table, columns=tuple(map(speech.word, table.columns)), rows=rows)


def said_line(name: Cell, told: Cell, speech: Speech) -> tuple[Cell, Cell]:
    head = str(name)
    if head in _SPOKEN_LINES or head.startswith(_NUMBERED):
        told = said(told, speech)
    word, blank, number = head.rpartition(" ")
    if blank and number.isdecimal():
        return f"{speech.say(word)} {number}", told
    return speech.say(head), told


def said(cell: Cell, speech: Speech) -> Cell:
    """Return translated words of the program: a sentence, a word, or a list with commas."""
    if not isinstance(cell, str) or not cell:
        return cell
    whole = speech.say(cell)
    if whole != cell:
        return whole
    for mark in (", ", " + "):
        parts = cell.split(mark)
        spoken = [speech.word(part) for part in parts]
        if len(parts) > 1 and spoken != parts:
            return mark.join(spoken)
    return cell

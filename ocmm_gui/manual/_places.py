from __future__ import annotations

from PySide6.QtWidgets import QWidget

PLACES = {
    # Start.
    "StartPage": "start.md#the-start-page",
    "PlanList": "start.md#choosing-a-plan",
    "FileBrowser": "start.md#opening-a-file",
    "SettingsPage": "settings.md#settings",
    "ManualSheet": "start.md#the-manual",
    "KeysSheet": "start.md#all-keys",
    # Measuring, and results.
    "DeskView": "inspecting.md#measure",
    "FarView": "inspecting.md#measure",
    "JobSheet": "inspecting.md#start-j",
    "PlanSheet": "plans.md#in-the-window",
    "AlignmentSheet": "inspecting.md#alignment-f5",
    "ResultsSheet": "inspecting.md#results-f3",
    "ReportSheet": "exports.md#report-template-and-head",
    "CompareSheet": "exports.md#a-batch",
    "ArchiveSheet": "archive.md#questions",
    "RecallSheet": "recall.md#recalculating",
    "WhatToDoSheet": "help.md#what-to-do-if-shiftf1",
    "SupportSheet": "help.md#support-bundle-ctrlb",
    # Maintain.
    "BusPage": "wire.md#verdicts",
    "CalibrationPage": "calibrating.md#the-page-of-the-cameras",
    "ProbePage": "calibrating.md#the-page-of-the-probe",
    "TestsPage": "acceptance.md#in-the-window",
    "AcceptanceDesk": "acceptance.md#in-the-window",
    "ArtefactSheet": "acceptance.md#artefacts",
    "StudySheet": "msa.md#in-the-window",
    "ProbeDesignPage": "probe_design.md#what-enters-the-uncertainty-of-a-point",
    "FitsPage": "inspecting.md#are-the-fits-right",
    # Wizards, by their procedure.
    "DefinitionPage": "wizards.md#defining-a-probe",
    "Wizard": "wizards.md#in-the-wizards",
    "Wizard known-points": "calibration.md#from-known-points",
    "Wizard relocation": "calibration.md#relocation",
    "Wizard verification": "calibration.md#verification",
    "Wizard pivot": "probe_calibration.md#how-it-is-done",
    "Wizard qualification": "tip.md#how-it-is-done",
    "Wizard tip-check": "tip.md#how-it-is-done",
}
"""By the class of the page; for a wizard also by its procedure."""

FIRST = "start.md"


def place_of(page: QWidget | None) -> str:
    """Return the section that explains a page, as ``document.md#section``.

    Containers return the current page in ``page()``, pages of several kinds ``topic()``.
    """
    shown = page
    inner = getattr(shown, "page", None)
    if callable(inner):
        shown = inner()
    name = type(shown).__name__
    topic = getattr(shown, "topic", None)
    if callable(topic):
        found = PLACES.get(f"{name} {topic()}")
        if found is not None:
            return found
    return PLACES.get(name, FIRST)

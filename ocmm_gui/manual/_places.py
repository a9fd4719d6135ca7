from __future__ import annotations

from PySide6.QtWidgets import QWidget

PLACES = {
    # Start.
    "StartPage": "inspector/start.md#the-start-page",
    "PlanList": "inspector/start.md#choosing-a-plan",
    "FileBrowser": "inspector/start.md#opening-a-file",
    "SettingsPage": "inspector/settings.md#settings",
    "ManualSheet": "inspector/start.md#the-manual",
    "KeysSheet": "inspector/start.md#all-keys",
    # Measuring, and results.
    "DeskView": "inspector/inspecting.md#measure",
    "FarView": "inspector/inspecting.md#measure",
    "JobSheet": "inspector/inspecting.md#start-j",
    "PlanSheet": "inspector/plans.md#in-the-window",
    "AlignmentSheet": "inspector/inspecting.md#alignment-f5",
    "ResultsSheet": "inspector/inspecting.md#results-f3",
    "ReportSheet": "quality/exports.md#report-template-and-head",
    "CompareSheet": "quality/exports.md#a-batch",
    "ArchiveSheet": "quality/archive.md#questions",
    "RecallSheet": "quality/recall.md#recalculating",
    "WhatToDoSheet": "inspector/help.md#what-to-do-if-shiftf1",
    "SupportSheet": "inspector/help.md#support-bundle-ctrlb",
    # Maintain.
    "BusPage": "technician/wire.md#verdicts",
    "CalibrationPage": "technician/calibrating.md#the-page-of-the-cameras",
    "ProbePage": "technician/calibrating.md#the-page-of-the-probe",
    "TestsPage": "quality/acceptance.md#in-the-window",
    "AcceptanceDesk": "quality/acceptance.md#in-the-window",
    "ArtefactSheet": "quality/acceptance.md#artefacts",
    "StudySheet": "quality/msa.md#in-the-window",
    "ProbeDesignPage": "technician/probe_design.md#what-enters-the-uncertainty-of-a-point",
    "FitsPage": "inspector/inspecting.md#are-the-fits-right",
    # Wizards, by their procedure.
    "DefinitionPage": "technician/wizards.md#defining-a-probe",
    "Wizard": "technician/wizards.md#in-the-wizards",
    "Wizard known-points": "technician/calibration.md#from-known-points",
    "Wizard relocation": "technician/calibration.md#relocation",
    "Wizard verification": "technician/calibration.md#verification",
    "Wizard pivot": "technician/probe_calibration.md#how-it-is-done",
    "Wizard qualification": "technician/tip.md#how-it-is-done",
    "Wizard tip-check": "technician/tip.md#how-it-is-done",
}
"""By the class of the page; for a wizard also by its procedure."""

FIRST = "inspector/start.md"


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

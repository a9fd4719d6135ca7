"""All keys, foot switches and buttons as one table.

A foot switch is programmed to F13, F14 and F15, which no field accepts as text. The probe's own
button comes over the bus and is handled by the core.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ocmm_gui.kit._texts import later

TAKE_KEYS = ("Space", "F13")
UNDO_KEYS = ("Backspace", "F14")
FINISH_KEYS = ("Return", "Enter", "F15")


class Mode(Enum):
    """Mode of the window."""

    INSPECT = later("Inspect")
    MAINTAIN = later("Maintain")


@dataclass(frozen=True, slots=True)
class ActionInfo:
    """An action of the inspector."""

    key: str
    text: str
    tip: str
    """One sentence; also for screen readers."""
    shortcuts: tuple[str, ...]
    """Keys; the first one is shown."""
    is_trigger: bool = False
    """May come from a foot switch, so it is debounced."""
    mode: Mode | None = Mode.INSPECT
    opens_wizard: bool = False
    """Action of a wizard. Stated here, because importing the wizards would delay the window."""


ACTIONS = (
    ActionInfo("take", later("Take"), later("Take a point now"), TAKE_KEYS, True),
    ActionInfo("undo", later("Undo"), later("Undo the last point"), UNDO_KEYS, True),
    ActionInfo(
        "finish", later("Finish"),
        later("Finish this feature and go to the next"), FINISH_KEYS, True,
    ),
    ActionInfo("flip", later("Flip"), later("Flip the last point to the other side"), ("X",)),
    ActionInfo(
        "previous", later("Previous"), later("Show the previous feature of the plan"), ("PgUp",),
    ),
    ActionInfo("next", later("Next"), later("Show the next feature of the plan"), ("PgDown",)),
    ActionInfo("skip", later("Skip"), later("Skip this feature; it can be measured later"), ("S",)),
    ActionInfo(
        "repeat", later("Repeat"),
        later("Repeat this feature; its old points stay in the file"), ("A",),
    ),
    ActionInfo(
        "reopen", later("Reopen"),
        later("Reopen a finished or skipped feature to add points"), ("F6",),
    ),
    ActionInfo("order", later("Order"), later("Switch between plan order and any order"), ("O",)),
    ActionInfo("side", later("Side"), later("Change how the probe side is found"), ("I",)),
    ActionInfo("pause", later("Pause"), later("Pause or resume"), ("Z", "Pause")),
    ActionInfo(
        "redo", later("Redo"), later("Redo the last undone step"), ("Ctrl+Y", "Shift+Backspace"),
    ),
    ActionInfo(
        "point_after", later("Next point"), later("Select the next point of the feature"), (".",),
    ),
    ActionInfo("point_before", later("Previous point"), later("Select the previous point"), (",",)),
    ActionInfo(
        "delete", later("Delete point"),
        later("Delete the selected point and give a reason"), ("Del",),
    ),
    ActionInfo("restore", later("Restore"), later("Restore the deleted point"), ("Ins",)),
    ActionInfo("tone", later("Tone"), later("Turn the approach tone on or off"), ("U",)),
    ActionInfo(
        "refit", later("Refit"), later("Recalculate all results from the raw data"), ("Ctrl+R",),
    ),
    ActionInfo(
        "job", later("Job"),
        later("Operator, serial number, next part, unfinished jobs"), ("J", "F2"),
    ),
    ActionInfo(
        "results", later("Results"),
        later("All characteristics, their uncertainty, and reports to print, such as PDF"), ("F3",)
    ),
    ActionInfo("plan", later("Plan"), later("Create or edit a plan"), ("F4",)),
    ActionInfo(
        "alignment", later("Alignment"), later("Alignment: residuals and free axes"), ("F5",),
    ),
    ActionInfo(
        "serve", later("Serve program"),
        later("Let a measuring program measure by I++ DME, in a separate job; or stop it"),
        ("Ctrl+I",),
    ),
    ActionInfo(
        "screen", later("Second screen"),
        later("Show this job on a tablet or phone at the part"), ("Ctrl+D",),
    ),
    ActionInfo(
        "view", later("Far view"), later("Switch between far view and desk view"), ("F11", "V"),
    ),
    ActionInfo("cameras", later("Cameras"), later("Show or hide the live camera images"), ("C",)),
    ActionInfo("fit", later("Fit view"), later("Zoom the 3-D view to the whole part"), ("F",)),
    ActionInfo(
        "closeup", later("Close-up"), later("Zoom the 3-D view to the active feature"), ("G",),
    ),
    ActionInfo(
        "part_mode", later("Part look"),
        later("Show the part shaded, as hidden lines or transparent"), ("3",),
    ),
    ActionInfo("export", later("Export"), later("Write the report files"), ("E",)),
    ActionInfo(
        "bus_text", later("Bus report"), later("Write the bus report as text, for support"), ("B",),
        mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "calibrate", later("Calibrate cameras"),
        later("Calibrate the cameras from known points"), ("K",),
        mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "relocate", later("Relocate"),
        later("Recalibrate the cameras in place, with the probe and a length bar"), ("R",),
        mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "tracker", later("Calibrate tracker"), later("Measure the noise of an optical tracker"),
        ("Shift+K",), mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "verify", later("Verify"), later("Verify the calibration with independent artefacts"),
        ("Y",), mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "write_cameras", later("Write to cameras"),
        later("Store the intrinsics of the calibration in the cameras"), ("W",),
        mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "recall", later("Recall jobs"),
        later("Recalculate older jobs whose calibration later failed"), ("F12",),
        mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "archive", later("Archive"),
        later("Jobs of all stations: lists, trends, what used a calibration"), ("Ctrl+J",),
        mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "pivot", later("Calibrate probe"),
        later("Find tip and LED positions: pivot the probe with its ball in a cone"), ("P",),
        mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "qualify", later("Qualify tip"), later("Find the ball diameter on a certified sphere"),
        ("Q",),
        mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "check_tip", later("Check tip"),
        later("One-minute check that the tip is still as qualified"),
        ("H",), mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "mount", later("Mount tip"), later("Confirm tip change"), ("N",), mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "define", later("Define"), later("Define a new probe document"), ("D",), mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "acceptance", later("Acceptance test"),
        later("Standard tests with limits and a verdict"), ("F7",), mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "interim", later("Interim check"), later("90 seconds: is the system still as it was"),
        ("F8",), mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "artefacts", later("Artefacts"), later("Register of spheres, bars, blocks and parts"),
        ("F9",), mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "study", later("Gauge study"), later("Measurement system analysis from jobs"),
        ("F10",), mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "certificate", later("Certificate"),
        later("Write the certificate of what this page shows, PDF and DCC"), ("Ctrl+P",),
        mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "hand", later("Take over"),
        later("SIMULATED: take the probe from the robot hand, or hand it back"), ("Ctrl+T",),
    ),
    ActionInfo(
        "tour", later("Tour"), later("SIMULATED: learn the window in two minutes"), ("Ctrl+G",),
    ),
    ActionInfo(
        "manual", later("Manual"), later("Read about this page, and search the manual"), ("F1",),
        mode=None,
    ),
    ActionInfo(
        "keys", later("Keys"), later("All keyboard shortcuts of the window"), ("Ctrl+F1",)
    ),
    ActionInfo(
        "what_to_do", later("What to do if"),
        later("Symptoms, errors and their remedies, to be searched"), ("Shift+F1",), mode=None,
    ),
    ActionInfo(
        "support", later("Support bundle"),
        later("Pack what support needs, after showing what is inside"), ("Ctrl+B",), mode=None,
    ),
    ActionInfo(
        "start", later("Home"),
        later("Leave the job for the Start page; no point is lost"), ("Ctrl+H",), mode=None,
    ),
    ActionInfo(
        "settings", later("Settings"),
        later("Cameras, probe, folders, temperatures, language, units, sounds, keys"),
        ("Ctrl+,",), mode=None,
    ),
    ActionInfo(
        "find", later("Find"), later("Type what you want to do"), ("Ctrl+K",), mode=None,
    ),
    ActionInfo(
        "theme", later("Theme"), later("Switch between dark, light and high contrast"),
        ("T",), mode=None
    ),
    ActionInfo(
        "zoom_in", later("Larger"), later("Show everything larger"), ("Ctrl++", "Ctrl+="),
        mode=None,
    ),
    ActionInfo(
        "zoom_out", later("Smaller"), later("Show everything smaller"), ("Ctrl+-",), mode=None,
    ),
    ActionInfo(
        "zoom_reset", later("Usual size"), later("Show everything as large as fits the screen"),
        ("Ctrl+0",), mode=None,
    ),
    ActionInfo(
        "gloves", later("Glove mode"), later("Make buttons and rows at least 15 mm, or as usual"),
        ("Ctrl+L",), mode=None,
    ),
    ActionInfo(
        "log", later("Save log"), later("Save the message log, for support"), ("L",), mode=None
    ),
    ActionInfo(
        "mode", later("Maintain"), later("Switch between Inspect and Maintain"), ("M",), mode=None,
    ),
)  # fmt: skip

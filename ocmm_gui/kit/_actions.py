"""Everything that a key or a button does, as one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QPushButton, QWidget

from ocmm_gui.kit._triggers import FINISH_KEYS, TAKE_KEYS, UNDO_KEYS, Debounced


class Mode(Enum):
    """What the window is for at the moment."""

    INSPECT = "Inspect"
    MAINTAIN = "Maintain"


@dataclass(frozen=True, slots=True)
class ActionInfo:
    """One thing that the inspector can do.

    Attributes
    ----------
    key
        Stable name.
    text
        On the button.
    tip
        One sentence; also what a screen reader says.
    shortcuts
        Keys; the first one is shown.
    is_trigger
        It may come from a foot switch, so it is debounced.
    mode
        The mode that it belongs to; None for every mode.
    opens_wizard
        A wizard has it as its action. Said here, as loading the wizards takes a moment that nobody
        should wait for before the window is there.
    """

    key: str
    text: str
    tip: str
    shortcuts: tuple[str, ...]
    is_trigger: bool = False
    mode: Mode | None = Mode.INSPECT
    opens_wizard: bool = False


ACTIONS = (
    ActionInfo("take", "Take", "Take a point now", TAKE_KEYS, True),
    ActionInfo("undo", "Undo", "Undo the last point", UNDO_KEYS, True),
    ActionInfo("finish", "Finish", "Finish this feature and go to the next", FINISH_KEYS, True),
    ActionInfo("flip", "Flip", "Flip the last point to the other side", ("X",)),
    ActionInfo("previous", "Previous", "Show the previous feature of the plan", ("PgUp",)),
    ActionInfo("next", "Next", "Show the next feature of the plan", ("PgDown",)),
    ActionInfo("skip", "Skip", "Skip this feature; it can be measured later", ("S",)),
    ActionInfo("repeat", "Repeat", "Repeat this feature; its old points stay in the file", ("A",)),
    ActionInfo("reopen", "Reopen", "Reopen a finished or skipped feature to add points", ("F6",)),
    ActionInfo("order", "Order", "Switch between plan order and any order", ("O",)),
    ActionInfo("side", "Side", "Change how the probe side is found", ("I",)),
    ActionInfo("pause", "Pause", "Pause or resume", ("Z", "Pause")),
    ActionInfo("redo", "Redo", "Redo the last undone step", ("Ctrl+Y", "Shift+Backspace")),
    ActionInfo("point_after", "Next point", "Select the next point of the feature", (".",)),
    ActionInfo("point_before", "Previous point", "Select the previous point", (",",)),
    ActionInfo("delete", "Delete point", "Delete the selected point and give a reason", ("Del",)),
    ActionInfo("restore", "Restore", "Restore the deleted point", ("Ins",)),
    ActionInfo("tone", "Tone", "Turn the approach tone on or off", ("U",)),
    ActionInfo("refit", "Refit", "Recalculate all results from the raw data", ("Ctrl+R",)),
    ActionInfo("job", "Job", "Operator, serial number, next part, unfinished jobs", ("J", "F2")),
    ActionInfo(
        "results", "Results", "All characteristics, their uncertainty and the reports", ("F3",)
    ),
    ActionInfo("plan", "Plan", "Create or edit a plan", ("F4",)),
    ActionInfo("alignment", "Alignment", "Alignment: residuals and free axes", ("F5",)),
    ActionInfo("view", "Far view", "Switch between far view and desk view", ("F11", "V")),
    ActionInfo("cameras", "Cameras", "Show or hide the live camera images", ("C",)),
    ActionInfo("fit", "Fit view", "Zoom the 3-D view to the whole part", ("F",)),
    ActionInfo("closeup", "Close-up", "Zoom the 3-D view to the active feature", ("G",)),
    ActionInfo("export", "Export", "Write the report files", ("E",)),
    ActionInfo(
        "bus_text", "Bus report", "Write the bus report as text, for support", ("B",),
        mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "calibrate", "Calibrate cameras", "Calibrate the cameras from known points", ("K",),
        mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "relocate", "Relocate", "Recalibrate the cameras in place, with the probe and a length "
                                "bar", ("R",), mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "verify", "Verify", "Verify the calibration with independent artefacts",
        ("Y",), mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "write_cameras", "Write to cameras", "Store the intrinsics of the calibration in the "
        "cameras", ("W",), mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "recall", "Recall jobs", "Recalculate older jobs whose calibration later failed", ("F12",),
        mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "pivot", "Calibrate probe", "Find tip and LED positions: pivot the probe with its ball "
                                    "in a cone", ("P",), mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "qualify", "Qualify tip", "Find the ball diameter on a certified sphere", ("Q",),
        mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "check_tip", "Check tip", "One-minute check that the tip is still as qualified",
        ("H",), mode=Mode.MAINTAIN, opens_wizard=True,
    ),
    ActionInfo(
        "mount", "Mount tip", "Confirm tip change", ("N",), mode=Mode.MAINTAIN,
    ),
    ActionInfo(
        "define", "Define", "Define a new probe document", ("D",), mode=Mode.MAINTAIN,
    ),
    ActionInfo("keys", "Keys", "All keyboard shortcuts of the window", ("F1",)),
    ActionInfo(
        "theme", "Theme", "Switch between dark, light and high contrast", ("T",), mode=None
    ),
    ActionInfo(
        "log", "Save log", "Save the message log, for support", ("L",), mode=None
    ),
    ActionInfo("mode", "Maintain", "Switch between Inspect and Maintain", ("M",), mode=None),
)  # fmt: skip


def show_mode(actions: Mapping[str, QAction], mode: Mode) -> None:
    """Enable the actions of a mode and disable those of the other."""
    for info in ACTIONS:
        actions[info.key].setEnabled(info.mode in (None, mode))


def make_actions(window: QWidget) -> dict[str, QAction]:
    """Return the actions by key, with their shortcuts active in ``window``; they do nothing yet."""
    actions: dict[str, QAction] = {}
    for info in ACTIONS:
        action = QAction(info.text, window)
        action.setObjectName(info.key)
        action.setToolTip(f"{info.tip} ({', '.join(info.shortcuts)})")
        action.setShortcuts([QKeySequence(keys) for keys in info.shortcuts])
        action.setShortcutContext(Qt.ShortcutContext.WindowShortcut)
        # A held pedal must not flood the job with points.
        action.setAutoRepeat(False)
        window.addAction(action)
        actions[info.key] = action
    return actions


def bind_actions(actions: Mapping[str, QAction], calls: Mapping[str, Callable[[], None]]) -> None:
    """Let every action do what it is there for.

    ``calls`` has one entry for every key of `ACTIONS`; a missing one is a KeyError.
    """
    for info in ACTIONS:
        call = calls[info.key]
        command = Debounced(call) if info.is_trigger else call
        # QAction sends its checked state, which no command wants.
        actions[info.key].triggered.connect(lambda _checked, command=command: command())


def make_button(action: QAction, *, primary: bool = False) -> QPushButton:
    """Return a button that does what ``action`` does and shows its first key."""
    key = action.shortcuts()[0].toString(QKeySequence.SequenceFormat.NativeText)
    button = QPushButton(f"{action.text()}  [{key}]")
    button.setAccessibleName(action.text())
    button.setAccessibleDescription(action.toolTip())
    button.setToolTip(action.toolTip())
    button.setProperty("role", "primary" if primary else "plain")
    button.setEnabled(action.isEnabled())
    action.changed.connect(lambda: button.setEnabled(action.isEnabled()))
    button.clicked.connect(action.trigger)
    return button

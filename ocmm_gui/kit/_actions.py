"""Everything that a key, a foot switch or a button does, as one table.

A foot switch is programmed to F13, F14 and F15, which no field takes as text. The probe's own
button comes over the bus and is handled by the core. A held or bouncing switch gives one command.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QPushButton, QWidget

from ocmm_gui.kit._narrow import NarrowButton
from ocmm_gui.kit._texts import later, literal, tr

DEBOUNCE_S = 0.15
"""Two presses closer than this are one: contacts bounce for some 20 ms, feet need 250 ms."""

TAKE_KEYS = ("Space", "F13")
UNDO_KEYS = ("Backspace", "F14")
FINISH_KEYS = ("Return", "Enter", "F15")


class Debounced:
    """Call ``command`` unless it was called less than `DEBOUNCE_S` ago."""

    def __init__(
        self, command: Callable[[], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._command = command
        self._clock = clock
        self._last = float("-inf")

    def __call__(self) -> None:
        """Give the command if it is due."""
        now = self._clock()
        if now - self._last >= DEBOUNCE_S:
            self._last = now
            self._command()


class Mode(Enum):
    """What the window is for at the moment."""

    INSPECT = later("Inspect")
    MAINTAIN = later("Maintain")


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


def show_mode(actions: Mapping[str, QAction], mode: Mode) -> None:
    """Enable the actions of a mode and disable those of the other."""
    for info in ACTIONS:
        actions[info.key].setEnabled(info.mode in (None, mode))


_KEY_NAMES = {
    name: name
    for name in (
        later("Space"), later("Return"), later("Enter"), later("Backspace"), later("Ins"),
        later("Del"), later("PgUp"), later("PgDown"), later("Shift"), later("Ctrl"), later("Alt"),
    )
}  # fmt: skip
"""Keys whose names differ between keyboards; Qt's own German names do not fit on buttons."""


def key_words(shortcut: QKeySequence | str) -> str:
    """Return the name of a key as it stands on the keyboard of the language."""
    text = QKeySequence(shortcut).toString(QKeySequence.SequenceFormat.PortableText)
    # `Ctrl++` is the plus with Ctrl held.
    held, plus, key = text[:-1].rpartition("+") if len(text) > 1 else ("", "", "")
    last = f"{key}{text[-1:]}"
    parts = [*held.split("+"), last] if plus else [last]
    return "+".join(tr(part) if part in _KEY_NAMES else part for part in parts)


def shortcuts_of(info: ActionInfo, changed: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return the keys of an action: those that somebody chose, or those shipped."""
    return tuple(changed.get(info.key, ())) or info.shortcuts


def conflict_of(key: str, shortcut: str, changed: Mapping[str, Sequence[str]]) -> ActionInfo | None:
    """Return which other action has a key already, or None.

    The mode makes no difference: a key means one thing in the whole window.
    """
    wanted = QKeySequence(shortcut)
    for info in ACTIONS:
        if info.key != key and any(
            QKeySequence(one) == wanted for one in shortcuts_of(info, changed)
        ):
            return info
    return None


def usable_keys(changed: Mapping[str, Sequence[str]]) -> dict[str, tuple[str, ...]]:
    """Return the chosen keys without those that mean something else already, or nothing at all.

    A document may have been written by hand, or for a version with other actions.
    """
    known = {info.key for info in ACTIONS}
    usable: dict[str, tuple[str, ...]] = {}
    for key, shortcuts in changed.items():
        sound = all(not QKeySequence(one).isEmpty() for one in shortcuts)
        trial = {**usable, key: tuple(shortcuts)}
        if key in known and sound and not any(conflict_of(key, one, trial) for one in shortcuts):
            usable[key] = tuple(shortcuts)
    return usable


_NEVER_TYPED = frozenset({"zoom_in", "zoom_out", "zoom_reset", "manual"})
"""Actions whose keys mean nothing in a field: they work from it, too."""


def is_never_typed(event: QKeyEvent) -> bool:
    """Return whether a key changes the size of the window or asks for the manual.

    Keys of the pad and shifted ones are the same: ``+`` has its own key in some countries only.
    """
    held = event.modifiers() & ~(
        Qt.KeyboardModifier.KeypadModifier | Qt.KeyboardModifier.ShiftModifier
    )
    pressed = QKeySequence(held.value | event.key())
    return any(
        pressed == QKeySequence(key)
        for info in ACTIONS
        if info.key in _NEVER_TYPED
        for key in info.shortcuts
    )


def use_shortcuts(actions: Mapping[str, QAction], changed: Mapping[str, Sequence[str]]) -> None:
    """Give every action its keys."""
    for info in ACTIONS:
        keys = shortcuts_of(info, changed)
        action = actions[info.key]
        named = ", ".join(map(key_words, keys))
        action.setToolTip(literal(f"{tr(info.tip)} ({named})"))
        action.setShortcuts([QKeySequence(key) for key in keys])


def make_actions(window: QWidget) -> dict[str, QAction]:
    """Return the actions by key, with their shortcuts active in ``window``; they do nothing yet."""
    actions: dict[str, QAction] = {}
    for info in ACTIONS:
        action = QAction(tr(info.text), window)
        action.setObjectName(info.key)
        action.setShortcutContext(Qt.ShortcutContext.WindowShortcut)
        # A held pedal must not flood the job with points.
        action.setAutoRepeat(False)
        window.addAction(action)
        actions[info.key] = action
    use_shortcuts(actions, {})
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


SHORT = "short"
"""Property of an action: what its button says where its text has no room, or says too little."""


def make_button(action: QAction, *, primary: bool = False) -> QPushButton:
    """Return a button that does what ``action`` does and shows its first key."""
    button = NarrowButton("")
    button.setProperty("role", "primary" if primary else "plain")
    shown: tuple[str, str] | None = None

    def follow() -> None:
        nonlocal shown
        button.setEnabled(action.isEnabled())
        now = _first_key(action), str(action.property(SHORT) or action.text())
        if now != shown:
            shown = now
            button.setText(f"{now[1]}  [{now[0]}]")
            name = action.text() if now[1] == action.text() else f"{action.text()}: {now[1]}"
            button.setAccessibleName(name)
            button.setAccessibleDescription(action.toolTip())
            button.setToolTip(literal(action.toolTip()))

    follow()
    action.changed.connect(follow)
    button.clicked.connect(action.trigger)
    return button


def _first_key(action: QAction) -> str:
    return key_words(action.shortcut())

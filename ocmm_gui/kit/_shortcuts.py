"""Keys of actions: texts, changes by settings, conflicts, and buttons."""

from __future__ import annotations

import time
from collections.abc import Callable, Container, Mapping, Sequence

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QAction, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QPushButton, QWidget

from ocmm_gui.kit._actions import ACTIONS, ActionInfo, Mode
from ocmm_gui.kit._narrow import NarrowButton
from ocmm_gui.kit._parts import dressed
from ocmm_gui.kit._texts import later, literal, tr
from ocmm_gui.kit._theme import text_font

DEBOUNCE_S = 0.15
"""Faster presses count once: contacts bounce for some 20 ms, feet need 250 ms."""


class DebouncedCommand:
    """Call ``command`` unless called less than `DEBOUNCE_S` ago."""

    def __init__(
        self, command: Callable[[], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._command = command
        self._clock = clock
        self._last = float("-inf")

    def __call__(self) -> None:
        now = self._clock()
        if now - self._last >= DEBOUNCE_S:
            self._last = now
            self._command()


def show_mode(actions: Mapping[str, QAction], mode: Mode) -> None:
    """Enable the actions of a mode and disable the others."""
    for info in ACTIONS:
        actions[info.key].setEnabled(info.mode in (None, mode))


_KEY_NAMES = {
    name: name
    for name in (
        later("Space"), later("Return"), later("Enter"), later("Backspace"), later("Ins"),
        later("Del"), later("PgUp"), later("PgDown"), later("Shift"), later("Ctrl"), later("Alt"),
    )
}  # fmt: skip
"""Keys whose names differ between keyboards; Qt's German names do not fit on buttons."""


def key_words(shortcut: QKeySequence | str) -> str:
    """Return the name of a key on keyboards of the language."""
    text = QKeySequence(shortcut).toString(QKeySequence.SequenceFormat.PortableText)
    # `Ctrl++` is the plus with Ctrl held.
    held, plus, key = text[:-1].rpartition("+") if len(text) > 1 else ("", "", "")
    last = f"{key}{text[-1:]}"
    parts = [*held.split("+"), last] if plus else [last]
    return "+".join(tr(part) if part in _KEY_NAMES else part for part in parts)


def shortcuts_of(info: ActionInfo, changed: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return the keys of an action: chosen ones, otherwise the defaults."""
    return tuple(changed.get(info.key, ())) or info.shortcuts


def conflict_of(key: str, shortcut: str, changed: Mapping[str, Sequence[str]]) -> ActionInfo | None:
    """Return another action with this key in any mode, or None."""
    wanted = QKeySequence(shortcut)
    for info in ACTIONS:
        if info.key != key and any(
            QKeySequence(one) == wanted for one in shortcuts_of(info, changed)
        ):
            return info
    return None


def usable_keys(changed: Mapping[str, Sequence[str]]) -> dict[str, tuple[str, ...]]:
    """Return the chosen keys without conflicting or invalid ones."""
    known = {info.key for info in ACTIONS}
    usable: dict[str, tuple[str, ...]] = {}
    for key, shortcuts in changed.items():
        sound = all(not QKeySequence(one).isEmpty() for one in shortcuts)
        trial = {**usable, key: tuple(shortcuts)}
        if key in known and sound and not any(conflict_of(key, one, trial) for one in shortcuts):
            usable[key] = tuple(shortcuts)
    return usable


_NEVER_TYPED = frozenset({"zoom_in", "zoom_out", "zoom_reset", "manual"})
"""Actions that also work while typing in a field."""


def is_never_typed(event: QKeyEvent) -> bool:
    """Return whether a key zooms or opens the manual, also on the keypad or shifted."""
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


ARROWS = {
    Qt.Key.Key_Left: (-1.0, 0.0), Qt.Key.Key_Right: (1.0, 0.0),
    Qt.Key.Key_Up: (0.0, 1.0), Qt.Key.Key_Down: (0.0, -1.0),
}  # fmt: skip
"""Directions of the arrow keys: right and up."""
F_KEYS = range(Qt.Key.Key_F1.value, Qt.Key.Key_F12.value + 1)


def keeps_keys(event: QEvent, keys: Container[int]) -> bool:
    """Return whether an event asks for one of these keys, and keep it from shortcuts then."""
    asks = event.type() is QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent)
    if asks and isinstance(event, QKeyEvent) and event.key() in keys:
        event.accept()
        return True
    return False


def use_shortcuts(actions: Mapping[str, QAction], changed: Mapping[str, Sequence[str]]) -> None:
    """Assign the keys of every action."""
    for info in ACTIONS:
        _use_keys(actions[info.key], info, changed)


def _use_keys(action: QAction, info: ActionInfo, changed: Mapping[str, Sequence[str]]) -> None:
    keys = shortcuts_of(info, changed)
    action.setToolTip(literal(f"{tr(info.tip)} ({', '.join(map(key_words, keys))})"))
    action.setShortcuts([QKeySequence(key) for key in keys])


def make_action(
    info: ActionInfo,
    owner: QWidget,
    changed: Mapping[str, Sequence[str]] | None = None,
    *,
    everywhere: bool = False,
) -> QAction:
    """Return an action of a widget, not connected; its shortcuts work while this has the focus.

    `changed`: Chosen keys. `everywhere`: Shortcuts work in the whole window.
    """
    action = QAction(tr(info.text), owner)
    action.setObjectName(info.key)
    _use_keys(action, info, changed or {})
    if not everywhere:
        action.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
    # A held pedal must not flood the job with points.
    action.setAutoRepeat(False)
    owner.addAction(action)
    return action


def make_actions(window: QWidget) -> dict[str, QAction]:
    """Return the actions by key, with shortcuts in ``window``, not connected yet."""
    return {info.key: make_action(info, window, everywhere=True) for info in ACTIONS}


def bind_actions(actions: Mapping[str, QAction], calls: Mapping[str, Callable[[], None]]) -> None:
    """Connect every action to its command; KeyError if ``calls`` lacks one."""
    for info in ACTIONS:
        call = calls[info.key]
        command = DebouncedCommand(call) if info.is_trigger else call
        # QAction sends its checked state, which no command needs.
        actions[info.key].triggered.connect(lambda _checked, command=command: command())


SHORT = "short"
"""Property of an action: button text if its own is too long or unspecific."""


def make_button(action: QAction, *, primary: bool = False) -> QPushButton:
    """Return a button for ``action`` with its first key."""
    button = NarrowButton("")
    button.setProperty("role", "primary" if primary else "plain")
    shown: tuple[str, str] | None = None

    def follow() -> None:
        nonlocal shown
        button.setEnabled(action.isEnabled())
        now = key_words(action.shortcut()), str(action.property(SHORT) or action.text())
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


def large_button(text: str, name: str, key: str = "") -> QPushButton:
    """Return a button of a start page, optionally with its key; that of Return is primary."""
    role = "primary" if key == "Return" else "plain"
    button = dressed(NarrowButton(text), name, font=text_font(18, bold=True), role=role, high=54)
    if key:
        button.setShortcut(key)
    return button

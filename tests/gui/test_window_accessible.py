"""Every control has a name that a screen reader can say, and every action a key."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtGui import QAccessible, QKeySequence
from PySide6.QtWidgets import QAbstractButton, QLineEdit, QListWidget, QTableWidget, QWidget

from ocmm_gui.kit import ACTIONS, ThemedWidget

if TYPE_CHECKING:
    from tests.gui.conftest import OpenWindow

# Qt makes these itself, inside its own widgets.
_QT_PARTS = ("qt_", "Scroll", "ExtensionButton")


def _is_control(widget: QWidget) -> bool:
    paints_itself = isinstance(widget, ThemedWidget) and not QWidget.children(widget)
    return paints_itself or isinstance(
        widget, QAbstractButton | QLineEdit | QListWidget | QTableWidget
    )


def test_every_control_has_an_accessible_name(open_window: OpenWindow) -> None:
    window = open_window(speed=0.1).window
    controls = [widget for widget in window.findChildren(QWidget) if _is_control(widget)]
    assert len(controls) > 40
    for widget in controls:
        if widget.objectName().startswith(_QT_PARTS):
            continue
        interface = QAccessible.queryAccessibleInterface(widget)
        assert interface is not None
        assert interface.text(QAccessible.Text.Name).strip(), widget


def test_no_two_actions_share_a_key(open_window: OpenWindow) -> None:
    window = open_window(speed=0.1).window
    keys = [
        sequence.toString(QKeySequence.SequenceFormat.PortableText)
        for info in ACTIONS
        for sequence in window.actions_by_key[info.key].shortcuts()
    ]
    assert all(keys)
    assert len(keys) == len(set(keys))
    # The 3-D view turns and zooms with these, and a shortcut of the window would come first.
    assert not {"+", "-", "=", "Left", "Right", "Up", "Down"} & set(keys)


def test_no_key_repeats_while_it_is_held(open_window: OpenWindow) -> None:
    window = open_window(speed=0.1).window
    assert not any(action.autoRepeat() for action in window.actions_by_key.values())

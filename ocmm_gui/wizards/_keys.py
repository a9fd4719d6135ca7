from __future__ import annotations

from collections.abc import Callable, Mapping

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QWidget

from ocmm_gui.kit import (
    FINISH_KEYS,
    TAKE_KEYS,
    UNDO_KEYS,
    ActionInfo,
    Debounced,
    key_words,
    later,
    literal,
    tr,
)

_PLOTS = (
    (later("Plot 1"), later("Show plot 1")),
    (later("Plot 2"), later("Show plot 2")),
    (later("Plot 3"), later("Show plot 3")),
    (later("Plot 4"), later("Show plot 4")),
)
WIZARD_ACTIONS = (
    ActionInfo("take", later("Take"), later("Take an observation now"), TAKE_KEYS, True),
    ActionInfo(
        "drop", later("Undo"), later("Undo the last observation of this step"), UNDO_KEYS, True
    ),
    ActionInfo("next", later("Next"), later("Go to the next step"), FINISH_KEYS, True),
    ActionInfo(
        "back", later("Back"), later("Back to the previous step; nothing is lost"), ("PgUp",)
    ),
    ActionInfo("automatic", later("Automatic"), later("Turn automatic taking on or off"), ("Y",)),
    ActionInfo("skip", later("Skip"), later("Skip this point: no camera sees it"), ("S",)),
    ActionInfo("repeat", later("Repeat line"), later("Repeat a misplaced or failed line"), ("N",)),
    ActionInfo("anew", later("Repeat sweep"), later("Discard this sweep and repeat it"), ("W",)),
    ActionInfo("calculate", later("Calculate"), later("Recalculate the result"), ("R",)),
    ActionInfo("cancel", later("Cancel"), later("Cancel the calculation"), ("C",)),
    ActionInfo("accept", later("Accept"), later("Activate the result"), ("A",)),
    ActionInfo("keep", later("Keep the old"), later("End without changes"), ("K",)),
    ActionInfo(
        "leave", later("Leave"), later("Back to Maintain; the session can be resumed"), ("Esc",)
    ),
    *(
        ActionInfo(f"plot{number}", text, tip, (f"{number}",))
        for number, (text, tip) in enumerate(_PLOTS, start=1)
    ),
)


def make_wizard_actions(
    wizard: QWidget, calls: Mapping[str, Callable[[], None]]
) -> dict[str, QAction]:
    """Return the actions by key; shortcuts work while ``wizard`` has the focus."""
    actions: dict[str, QAction] = {}
    for info in WIZARD_ACTIONS:
        action = QAction(tr(info.text), wizard)
        action.setObjectName(info.key)
        action.setToolTip(literal(f"{tr(info.tip)} ({', '.join(map(key_words, info.shortcuts))})"))
        action.setShortcuts([QKeySequence(keys) for keys in info.shortcuts])
        action.setShortcutContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        action.setAutoRepeat(False)
        action.setEnabled(False)
        call = calls[info.key]
        command = Debounced(call) if info.is_trigger else call
        action.triggered.connect(lambda _checked, command=command: command())
        wizard.addAction(action)
        actions[info.key] = action
    return actions

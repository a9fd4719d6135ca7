"""Everything that a key or a button of a wizard does, as one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QWidget

from ocmm_gui.kit import FINISH_KEYS, TAKE_KEYS, UNDO_KEYS, ActionInfo, Debounced

WIZARD_ACTIONS = (
    ActionInfo("take", "Take", "Take an observation now", TAKE_KEYS, True),
    ActionInfo("drop", "Undo", "Undo the last observation of this step", UNDO_KEYS, True),
    ActionInfo("next", "Next", "Go to the next step", FINISH_KEYS, True),
    ActionInfo("back", "Back", "Back to the previous step; nothing is lost", ("PgUp",)),
    ActionInfo("automatic", "Automatic", "Turn automatic taking on or off", ("Y",)),
    ActionInfo("skip", "Skip", "Skip this point: no camera sees it", ("S",)),
    ActionInfo("repeat", "Repeat line", "Repeat a misplaced or failed line", ("N",)),
    ActionInfo("anew", "Repeat sweep", "Discard this sweep and repeat it", ("W",)),
    ActionInfo("calculate", "Calculate", "Recalculate the result", ("R",)),
    ActionInfo("cancel", "Cancel", "Cancel the calculation", ("C",)),
    ActionInfo("accept", "Accept", "Activate the result", ("A",)),
    ActionInfo("keep", "Keep the old", "End without changes", ("K",)),
    ActionInfo("leave", "Leave", "Back to Maintain; the session can be resumed", ("Esc",)),
    *(
        ActionInfo(f"plot{number}", f"Plot {number}", f"Show plot {number}", (f"{number}",))
        for number in range(1, 5)
    ),
)


def make_wizard_actions(
    wizard: QWidget, calls: Mapping[str, Callable[[], None]]
) -> dict[str, QAction]:
    """Return the actions by key; their shortcuts act while ``wizard`` has the keyboard."""
    actions: dict[str, QAction] = {}
    for info in WIZARD_ACTIONS:
        action = QAction(info.text, wizard)
        action.setObjectName(info.key)
        action.setToolTip(f"{info.tip} ({', '.join(info.shortcuts)})")
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

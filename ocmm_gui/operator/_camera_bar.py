"""One line about the cameras, and the button that opens their images."""

from __future__ import annotations

import numpy as np
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QFrame, QHBoxLayout, QSizePolicy

from ocmm_core.camera import Rig
from ocmm_core.inspection.evaluation import LiveView
from ocmm_gui.kit import PlainLabel, literal, make_button, said, text_font, tr

_MOST_NAMED = 4
"""Of more cameras only those are named that see nothing."""


class CameraBar(QFrame):
    """Says how many spots each camera sees, and in words which one sees none.

    A camera that sees nothing opens no image: that would take the part away from whoever measures.

    Parameters
    ----------
    rig
        Whose cameras they are.
    action
        What the button does.
    """

    def __init__(self, rig: Rig, action: QAction) -> None:
        super().__init__()
        self._names = tuple(camera.name for camera in rig.cameras)
        self._label = PlainLabel()
        self._label.setAccessibleName(tr("Cameras"))
        self._label.setFont(text_font(13))
        self._label.setProperty("role", "muted")
        # Of a rig with many cameras it is too long for the line.
        self._label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        button = make_button(action)
        button.setProperty("role", "tool")
        button.setFont(text_font(12))
        layout = QHBoxLayout(self)
        layout.setContentsMargins(4, 0, 0, 0)
        layout.setSpacing(8)
        layout.addWidget(self._label, 1)
        layout.addWidget(button)

    def show_live(self, live: LiveView) -> None:
        """Show what the cameras see."""
        counts = np.isfinite(live.spots).all(axis=2).sum(axis=1).tolist()
        # Where no frames come, no camera is blind: the line must not send anybody to look for that.
        silent = not any(counts) and not live.frames_per_second
        words = said(live.reason) if silent else _camera_words(self._names, counts)
        if self._label.text() != words:
            self._label.setText(words)
            self._label.setToolTip(literal(words))

    def words(self) -> str:
        """Return what it says; for tests."""
        return self._label.text()


def _camera_words(names: tuple[str, ...], counts: list[int]) -> str:
    """Return which cameras see nothing, or else how many spots each one sees."""
    seen = list(zip(names, counts, strict=True))
    blind = [name for name, count in seen if not count]
    if blind:
        return tr("Camera sees no LED: {names}").format(names=", ".join(blind))
    if len(seen) <= _MOST_NAMED:
        return "   ".join(
            tr("{name}: %n spots", "{name}: 1 spot", count).format(name=name)
            for name, count in seen
        )
    return tr(
        "{count} cameras, at least %n spots each",
        "{count} cameras, at least 1 spot each",
        min(counts),
    ).format(count=len(seen))

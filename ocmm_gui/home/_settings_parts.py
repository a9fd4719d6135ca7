"""Parts of the settings page: all keys, changeable, and all sounds with their meaning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QGridLayout, QListWidget, QListWidgetItem, QPushButton, QWidget

from ocmm_gui import kit
from ocmm_gui.home._setting_row import wide_button
from ocmm_gui.kit import later, tr

_ROW_PX = 40
_BARE = (
    Qt.Key.Key_Shift, Qt.Key.Key_Control, Qt.Key.Key_Alt, Qt.Key.Key_Meta, Qt.Key.Key_AltGr,
    Qt.Key.Key_CapsLock, Qt.Key.Key_NumLock, Qt.Key.Key_unknown,
)  # fmt: skip
_KEPT = ("Esc", "Tab", "Shift+Tab", "Shift+Backtab", "Backtab")
"""Reserved navigation keys."""


class KeyList(QWidget):
    """Select an action, press Change, and press the new key; keys in use are refused."""

    changed = Signal(object)
    """Emits all non-default keys, by action."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Keys"))
        self._changed: dict[str, tuple[str, ...]] = {}
        self.list = kit.dressed(QListWidget(), tr("Actions and their keys"), font=kit.text_font(16))
        self.told = kit.sentence_label(
            tr("About the chosen key"), 15,
            tr("Choose an action and press Change; a foot switch is set up likewise."),
        )  # fmt: skip
        self.capture = _Capture()
        self.capture.pressed_key.connect(self.assign)
        self.capture.given_up.connect(self._give_up)
        self._change = wide_button(tr("Change"))
        self._change.clicked.connect(self._start)
        self._default = wide_button(tr("Default key"))
        self._default.clicked.connect(self.restore)
        row = kit.hbox(self._change, self._default, (self.capture, 1))
        kit.vbox((self.list, 1), self.told, row, parent=self, margins=0)
        self.list.itemActivated.connect(lambda _item: self._start())
        self.show_keys({})

    def show_keys(self, changed: Mapping[str, tuple[str, ...]]) -> None:
        self._changed = dict(changed)
        row = max(self.list.currentRow(), 0)
        self.list.clear()
        for info in kit.ACTIONS:
            keys = ", ".join(map(kit.key_words, kit.shortcuts_of(info, changed)))
            mark = "●" if info.key in changed else "  "
            item = QListWidgetItem(f"{mark} {keys}   {tr(info.text)}: {tr(info.tip)}", self.list)
            item.setData(Qt.ItemDataRole.UserRole, info.key)
            item.setSizeHint(QSize(200, _ROW_PX))
        self.list.setCurrentRow(min(row, self.list.count() - 1))

    def select(self, key: str) -> None:
        self.list.setCurrentRow([info.key for info in kit.ACTIONS].index(key))

    def assign(self, shortcut: str) -> None:
        """Assign a key to the selected action, or show why not."""
        info = self._chosen()
        other = kit.conflict_of(info.key, shortcut, self._changed)
        if shortcut in _KEPT:
            self.told.setText(
                tr("{key} leaves and walks through pages.").format(key=kit.key_words(shortcut))
            )
        elif other is not None:
            self.told.setText(
                tr(
                    "{key} is already {action}. Choose another key, or change that one first."
                ).format(key=kit.key_words(shortcut), action=tr(other.text))
            )
        else:
            self.told.setText(
                tr("{action} is now on {key}.").format(
                    action=tr(info.text), key=kit.key_words(shortcut)
                )
            )
            # Foot switch keys (F13 and up) are kept in addition to the new key.
            kept = tuple(
                key for key in info.shortcuts[1:] if key.startswith("F1") and key != shortcut
            )
            self.changed.emit({**self._changed, info.key: (shortcut, *kept)})
        self.list.setFocus()

    def restore(self) -> None:
        info = self._chosen()
        left = {key: keys for key, keys in self._changed.items() if key != info.key}
        taken = [kit.conflict_of(info.key, key, left) for key in info.shortcuts]
        other = next((one for one in taken if one is not None), None)
        if other is not None:
            self.told.setText(
                tr("The default key is now {action}. Change that one first.").format(
                    action=tr(other.text)
                )
            )
        elif info.key in self._changed:
            self.changed.emit(left)

    def _chosen(self) -> kit.ActionInfo:
        return kit.ACTIONS[max(self.list.currentRow(), 0)]

    def _start(self) -> None:
        self.told.setText(
            tr("Press the new key of {action}. Esc keeps the old one.").format(
                action=tr(self._chosen().text)
            )
        )
        self.capture.listen()

    def _give_up(self) -> None:
        self.told.setText(tr("The key was not changed."))
        self.list.setFocus()


class _Capture(kit.PlainLabel):
    """Captures the next key, whatever its other meaning."""

    pressed_key = Signal(str)
    given_up = Signal()

    def __init__(self) -> None:
        super().__init__()
        kit.dressed(self, tr("Press the new key"), font=kit.text_font(16, bold=True))
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self._listens = False

    def listen(self) -> None:
        self._listens = True
        self.setText(tr("Waiting for a key"))
        self.setFocus()
        self.grabKeyboard()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = Qt.Key(event.key())
        if not self._listens or key in _BARE:
            return
        self._end()
        if key == Qt.Key.Key_Escape:
            self.given_up.emit()
            return
        self.pressed_key.emit(
            QKeySequence(event.keyCombination()).toString(QKeySequence.SequenceFormat.PortableText)
        )

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Stop capturing: after a click elsewhere the next key has another target."""
        super().focusOutEvent(event)
        if self._listens:
            self._end()
            self.given_up.emit()

    def _end(self) -> None:
        self._listens = False
        self.setText("")
        self.releaseKeyboard()


_APPROACH_HZ = (587.0, 740.0, 880.0)
_NEAR_MS = 250


@dataclass(frozen=True, slots=True)
class SoundWords:
    name: str
    goes: str
    means: str
    """Event, and its visible equivalent."""


SOUND_WORDS = {
    kit.Sound.TAKEN: SoundWords(
        later("Point taken"), later("two short, high, rising"),
        later("A point is in the job. The readout flashes green, the count goes up."),
    ),
    kit.Sound.REFUSED: SoundWords(
        later("Touch refused"), later("two low, falling"),
        later("No point was taken. The readout flashes red, the reason stands below it."),
    ),
    kit.Sound.WRONG_FACE: SoundWords(
        later("Wrong face"), later("low and up, twice"),
        later("The touch was on another face. No point was taken, the reason stands below."),
    ),
    kit.Sound.FEATURE_COMPLETE: SoundWords(
        later("Feature finished"), later("three short, rising"),
        later("Nothing speaks against it. The verdict stands in words with a tick."),
    ),
    kit.Sound.IN_DOUBT: SoundWords(
        later("In doubt"), later("three, down and up again"),
        later("Neither conform nor not conform. The verdict stands in words with a triangle."),
    ),
    kit.Sound.OUT_OF_TOLERANCE: SoundWords(
        later("Not conform"), later("three long, low, the last one lower"),
        later("Out of tolerance. The verdict stands in words with a cross."),
    ),
    kit.Sound.TICK: SoundWords(
        later("Countdown"), later("two taps"),
        later("A sweep is about to begin. The page counts down."),
    ),
    kit.Sound.STARTED: SoundWords(
        later("Sweep begins"), later("one long"),
        later("Poses are captured now; the page counts them."),
    ),
    kit.Sound.TOO_FAST: SoundWords(
        later("Too fast"), later("three short taps, high"),
        later("The ball slides too fast for points. The next step states its speed."),
    ),
    kit.Sound.LOST_CONTACT: SoundWords(
        later("Lost contact"), later("three short taps, falling"),
        later("The ball is off the surface while it slides. The next step says so."),
    ),
    kit.Sound.SCAN_DONE: SoundWords(
        later("Scan complete"), later("four short, rising"),
        later("The ball has covered the scan. The next step states 100 %."),
    ),
}  # fmt: skip
"""One entry per sound; a test compares it with `Sound`."""

_APPROACH = SoundWords(
    later("Approach"), later("single short tones, rising"),
    later("The ball comes nearer to the next point. Ring and distance show it; U turns it off."),
)  # fmt: skip


class SoundsPage(QWidget):
    """One line per sound, with a play button."""

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName(tr("Test of sounds"))
        self._player: kit.SoundPlayer | None = None
        self._enabled, self._volume = True, 0
        self.told = kit.sentence_label(tr("About the sounds"), 15)
        self.buttons: dict[kit.Sound | None, QPushButton] = {}
        grid = QGridLayout()
        grid.setHorizontalSpacing(14)
        grid.setVerticalSpacing(6)
        grid.setColumnStretch(1, 2)
        grid.setColumnStretch(2, 5)
        lines: tuple[tuple[kit.Sound | None, SoundWords], ...] = (
            *SOUND_WORDS.items(), (None, _APPROACH),
        )  # fmt: skip
        for row, (sound, words) in enumerate(lines):
            name, goes, means = tr(words.name), tr(words.goes), tr(words.means)
            button = wide_button(f"♪ {name}")
            kit.dressed(button, tr("Play: {name}").format(name=name), f"{goes}. {means}")
            button.clicked.connect(lambda _checked=False, sound=sound: self.play(sound))
            self.buttons[sound] = button
            grid.addWidget(button, row, 0)
            for column, text in enumerate((goes, means), 1):
                about = tr("About {setting}").format(setting=name)
                grid.addWidget(kit.sentence_label(about, 15, text, middle=True), row, column)
        grid.setRowStretch(99, 1)
        head = kit.PlainLabel(tr("Everything that is heard is seen, too. Volume and off: Window."))
        kit.dressed(head, font=kit.text_font(15), role="muted").setWordWrap(True)
        kit.vbox(head, (kit.scrolled(kit.panel(grid)), 1), self.told, parent=self, margins=0)

    def use(self, *, enabled: bool, volume: int) -> None:
        """Set the volume, or show that sounds are off."""
        self._enabled, self._volume = enabled, volume
        if self._player is not None:
            self._player.enable(enabled, volume)
        for button in self.buttons.values():
            button.setEnabled(enabled)
        self.told.setText("" if enabled else tr("Sounds are off. Turn them on in Window."))

    def play(self, sound: kit.Sound | None) -> None:
        """Play a sound; None plays the guiding tones."""
        if self._player is None:
            # Files are only written on demand.
            self._player = kit.SoundPlayer(self, enabled=self._enabled, volume=self._volume)
        if not self._player.can_play():
            self.told.setText(
                tr("Nothing is heard: no program that plays sounds was found on this computer.")
            )
            return
        self.told.setText("")
        if sound is not None:
            self._player.play(sound)
            return
        for place, hertz in enumerate(_APPROACH_HZ):
            QTimer.singleShot(_NEAR_MS * place, self, lambda hertz=hertz: self._step(hertz))

    def close_work(self) -> None:
        if self._player is not None:
            self._player.close()
            self._player = None

    def _step(self, hertz: float) -> None:
        if self._player is not None:
            self._player.play_pitch(hertz)

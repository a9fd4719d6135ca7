"""Start and end of the windows: arguments, options, showing, closing; the queue to the archive."""

from __future__ import annotations

import argparse
import contextlib
import gc
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QCoreApplication, QEvent, Qt, QTimer
from PySide6.QtWidgets import QApplication, QLabel, QMainWindow, QWidget

from ocmm_core.errors import InputError, OcmmError
from ocmm_core.options import WINDOW, Option
from ocmm_core.settings import Kind, LoadedSettings, SettingOrigin, SettingsStore, Value
from ocmm_core.typed_numbers import number_field
from ocmm_gui.home import StartChoice, StartPurpose
from ocmm_gui.kit import DEFAULT_THEME, THEMES, PlainLabel, apply_theme, text_font, tr

if TYPE_CHECKING:
    from ocmm_core.composition import BuiltStation
    from ocmm_shop.archive.outbox import HandOverProcess
    from ocmm_shop.archiving import ArchiveWatch

_SENDER_MS = 5000
_QUIT_EVERY_MS = 20


def given(parsed: argparse.Namespace) -> dict[str, Value]:
    """Return the settings given on the command line, by key."""
    return {name: value for name, value in vars(parsed).items() if "." in name}


def parser() -> argparse.ArgumentParser:
    """Return the parser of the arguments, made from the table of options."""
    made = argparse.ArgumentParser(
        prog="ocmm window",
        description="The OCMM window: measure a part to a plan, with real or virtual cameras. What "
        "is not given here is taken from the settings: ocmm settings show.",
    )
    group = made.add_argument_group("instead of the settings")
    for option in WINDOW:
        # A setting that is not given is absent, so that its documents hold.
        default = argparse.SUPPRESS if option.setting else option.default
        (group if option.setting else made).add_argument(
            *((option.name,) if option.is_argument else option.typed),
            default=default, help=option.text, **_reader(option),
        )  # fmt: skip
    return made


def _reader(option: Option) -> dict[str, Any]:
    """Return how argparse reads the value of an option."""
    spec = option.spec if option.setting else None
    target = {} if option.is_argument else {"dest": option.setting or option.name}
    if isinstance(option.default, bool):
        return {**target, "action": f"store_{str(not option.default).lower()}"}
    if spec is not None and spec.kind is Kind.CHOICE:
        return {**target, "choices": spec.choices}
    read: dict[str, Any] = {"metavar": option.metavar or option.name.upper()}
    if option.is_argument:
        read["nargs"] = "?"
    if option.number:
        read |= {"type": _number(option), "metavar": option.metavar or _unit(option)}
    elif isinstance(option.default, tuple):
        read |= {"type": _picture, "nargs": "+"}
    elif option.name == "size":
        read["type"] = _size
    elif option.is_argument or isinstance(option.default, Path) or (spec and spec.kind in _PATHS):
        read["type"] = _path
    return {**target, **read}


_PATHS = (Kind.FILE, Kind.FOLDER)


def _unit(option: Option) -> str | None:
    field = option.field
    return (field.quantity.unit or "N").replace("%", "%%") if field is not None else None


def _number(option: Option) -> Callable[[str], float]:
    """Return the reader of a numeric option, by the table of typed numbers."""
    field = number_field(option.number)

    def read(text: str) -> float:
        try:
            return int(field.read(text)) if field.whole else field.read(text)
        except InputError as error:
            raise argparse.ArgumentTypeError(f"{error.what} {error.remedy}") from error

    return read


def _path(text: str) -> Path:
    return Path(text).expanduser()


def _picture(text: str) -> Path:
    """Return the path of a picture; a job file after the option is refused, not overwritten."""
    if not text.lower().endswith(".png"):
        raise argparse.ArgumentTypeError(f"{text!r} is no picture; give a name ending in .png")
    return Path(text)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    return int(width), int(height)


@dataclass(frozen=True, slots=True)
class WindowOptions:
    """Options of the window's start and end."""

    theme: str = DEFAULT_THEME
    far: bool = False
    """Start with the far view."""
    size: tuple[int, int] | None = None
    """Width and height, px; None opens it maximised."""
    export: Path | None = None
    """Folder of the report; None asks in the window."""
    quit_after_s: float = 0.0
    """Close after this time; zero stays open."""
    screenshots: tuple[Path, ...] = ()
    """Files for a picture of the window just before it closes."""
    sound: bool = True


def window_options(parsed: argparse.Namespace, loaded: LoadedSettings) -> WindowOptions:
    """Return the options of a start; arguments take precedence over settings."""
    settings = loaded.settings
    told = loaded.origins["job.folder"] is not SettingOrigin.DEFAULT
    return WindowOptions(
        theme=settings.window_theme,
        far=settings.window_far,
        size=parsed.size,
        export=settings.job_folder if told else None,
        quit_after_s=parsed.quit_after,
        screenshots=tuple(parsed.screenshot),
        sound=settings.window_sounds,
    )


class HandOverSender:
    """Start the delivering process, which reads ``store``, after the window is shown; end it."""

    def __init__(self, store: SettingsStore) -> None:
        self._store = store
        self._process: HandOverProcess | None = None
        self._ended = False
        QTimer.singleShot(_SENDER_MS, self._start)

    def close(self) -> None:
        """End the process, and never restart it."""
        self._ended = True
        if self._process is not None:
            self._process.close()

    def _start(self) -> None:
        if self._ended:
            return
        # Loaded late: the first page is shown before numerical libraries are loaded.
        from ocmm_shop.archive.outbox import HandOverProcess
        from ocmm_shop.archiving import archive_place

        # The start page and the settings show faults of the address.
        with contextlib.suppress(OcmmError):
            place = archive_place(settings=self._store.load().settings)
            if place is not None:
                self._process = HandOverProcess(place)
                self._process.start()


def watch_jobs(
    built: BuiltStation, loaded: LoadedSettings, choice: StartChoice
) -> ArchiveWatch | None:
    """Return the watch that queues the jobs of a station; None if nothing is archived."""
    from ocmm_shop.archiving import ArchiveWatch, archive_place

    if choice.errand is StartPurpose.DEMO:
        # Demonstrations keep only their file.
        return None
    try:
        place = archive_place(settings=loaded.settings)
    except OcmmError:
        return None
    return None if place is None else ArchiveWatch(built.station, place.outbox)


def show(window: QMainWindow, size: tuple[int, int] | None) -> None:
    """Show a window in a size; None: maximised."""
    if size is None:
        # Without a window manager nothing else gives it the screen.
        window.setGeometry(window.screen().availableGeometry())
        window.showMaximized()
    else:
        window.resize(*size)
        window.show()


def end_after(seconds: float, end: Callable[[], object]) -> None:
    """Call ``end`` after a time; zero never does."""
    if seconds > 0.0:
        QTimer.singleShot(round(1000.0 * seconds), end)


def save_pictures(window: QWidget, paths: Sequence[Path]) -> bool:
    """Save the window's last picture; return whether every file could be written."""
    saved = True
    for path in paths:
        if not window.grab().save(str(path)):
            sys.stderr.write(f"The picture {path} cannot be written.\n")
            saved = False
    return saved


def let_go() -> None:
    """Free the memory of a closed window and its station; call it without references to them.

    Between two windows no event loop runs that would delete them, and objects created before the
    window was shown are frozen for the garbage collector.
    """
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    gc.unfreeze()
    gc.collect()


def splash(app: QApplication, source: str, theme: str) -> QLabel:
    """Show that the window is starting, and with which source; the caller closes it."""
    label = PlainLabel(tr("OCMM\n\nStarting: {source}").format(source=source))
    label.setAlignment(Qt.AlignmentFlag.AlignCenter)
    label.setWindowTitle("OCMM")
    label.setFont(text_font(20))
    label.resize(520, 200)
    apply_theme(label, THEMES[theme])
    label.show()
    app.processEvents()
    return label


def end_on_signals(app: QApplication) -> None:
    # Repeated: before the loop of a window runs, and while events are handled during the start,
    # quitting has no effect.
    ending = QTimer(app, interval=_QUIT_EVERY_MS)
    ending.timeout.connect(app.quit)

    def end(number: int, frame: FrameType | None) -> None:
        ending.start()

    # The timer of the live values lets Python handle signals.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)

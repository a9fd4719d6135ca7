"""The composition root of the window: arguments in, a running window out."""

from __future__ import annotations

import argparse
import gc
import os
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QApplication, QLabel

from ocmm_core.composition import DEFAULT_SOURCE
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, InternalError
from ocmm_core.failure import EXIT_INTERNAL, contained
from ocmm_gui.climate_arguments import add_climate, climate_request
from ocmm_gui.kit import DEFAULT_THEME, THEMES, PlainLabel, apply_theme, text_font, tr

if TYPE_CHECKING:
    from ocmm_core.composition import StationRequest
    from ocmm_gui.window import MainWindow

EXIT_OK, EXIT_FAILED = 0, 2
_SAFE = "All points taken are saved in the job file."


@dataclass(frozen=True, slots=True)
class WindowOptions:
    """How the window is opened and how it ends.

    Attributes
    ----------
    theme
        Name of the theme.
    far
        Begin with the far view.
    size
        Width and height, px; None opens it maximised.
    export
        Folder of the report; None asks in the window.
    quit_after_s
        Close after so many seconds; zero stays open.
    screenshots
        Files that get a picture of the window just before it closes.
    sound
        Play sounds.
    """

    theme: str = DEFAULT_THEME
    far: bool = False
    size: tuple[int, int] | None = None
    export: Path | None = None
    quit_after_s: float = 0.0
    screenshots: tuple[Path, ...] = ()
    sound: bool = True


def make_application() -> QApplication:
    """Return the application, dressed alike on every system.

    Raises
    ------
    InputError
        There is no screen to show a window on.
    """
    existing = QApplication.instance()
    if isinstance(existing, QApplication):
        return existing
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    if sys.platform == "linux" and not any(os.environ.get(name) for name in screens):
        # Qt would end the program with a message about its plugins.
        raise InputError(
            "window.no_display",
            "No display available for the window.",
            "Start OCMM on a desktop, or measure without a window: ocmm demo --headless.",
        )
    # Threads that track and simulate give way to the window after 1 ms instead of 5: the p99 of
    # its latency falls from 40 to 25 ms on two cores, at no loss of frames (benchmarks/window.py).
    sys.setswitchinterval(0.001)
    app = QApplication(["ocmm"])
    app.setApplicationName("OCMM")
    app.setStyle("Fusion")
    app.setFont(text_font(14))
    return app


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the window and return the exit code.

    That is 0, 2 if it could not be started, or 3 if something that nobody foresaw ended it or the
    measuring in it.
    """
    parsed = _parser().parse_args(arguments)
    try:
        return run(parsed, _window_options(parsed))
    except Exception as error:
        told = contained(error, "The window", _SAFE)
        sys.stderr.write(f"{told.what}\n{told.remedy}\n")
        return EXIT_INTERNAL if isinstance(told, InternalError) else EXIT_FAILED


def run(parsed: argparse.Namespace, options: WindowOptions) -> int:
    """Build the station, show the window and return when it has closed.

    Raises
    ------
    OcmmError
        The station cannot be built.
    """
    # What is loaded here stays: looking through it for garbage takes a seventh of the start.
    gc.disable()
    app = make_application()
    # Numerical libraries take a second to load: something is on the screen before that.
    splash = _splash(app, parsed.source, options)
    try:
        from ocmm_core.composition import AcceptanceBench, build_station
        from ocmm_gui.bridge import StationBridge
        from ocmm_gui.kit import ErrorHooks, NoticeCentre, SoundPlayer
        from ocmm_gui.window import MainWindow

        _end_on_signals(app)
        request = _request(parsed)
        built = build_station(request)
    finally:
        splash.close()
        splash.deleteLater()
    notices = NoticeCentre()
    try:
        bridge = StationBridge(built.station)
    except BaseException:
        built.station.close()
        raise
    code = EXIT_OK
    try:
        with ErrorHooks(notices):
            window = MainWindow(
                bridge,
                notices,
                sounds=SoundPlayer(enabled=options.sound),
                theme=options.theme,
                out=options.export,
                bench=AcceptanceBench(request, built.recorded),
            )
            _show(window, options)
            gc.freeze()
            gc.enable()
            if parsed.serial is None and parsed.source != DEFAULT_SOURCE:
                # Who measures which part comes before the first point.
                window.sheets.open_job()
            if parsed.job is not None:
                window.sheets.look_at(parsed.job)
            bridge.start()
            window.load_the_rest()
            if options.quit_after_s > 0.0:
                QTimer.singleShot(round(1000.0 * options.quit_after_s), window.close)
            app.exec()
            if not _save_pictures(window, options.screenshots):
                code = EXIT_FAILED
    finally:
        gc.enable()
        bridge.close()
    failure = built.station.faults.why_failed()
    if isinstance(failure, InternalError):
        sys.stderr.write(f"{failure.what}\n{failure.remedy}\n")
        return EXIT_INTERNAL
    return code


def _request(parsed: argparse.Namespace) -> StationRequest:
    from ocmm_core.composition import StationRequest, stream_options

    return StationRequest(
        plan=parsed.plan,
        out=parsed.out or Path("ocmm-out"),
        rig=parsed.rig,
        probe=parsed.probe,
        reference=parsed.reference,
        part=parsed.part,
        source=parsed.source,
        seed=parsed.seed,
        speed=parsed.speed,
        stay=True,
        operator=parsed.operator,
        serial=parsed.serial or "1",
        force=parsed.force,
        calibrations=parsed.calibrations,
        uncalibrated=parsed.uncalibrated,
        climate=climate_request(parsed),
        probes=parsed.probes,
        tip=parsed.tip,
        check_after_h=parsed.check_after,
        stream=stream_options(
            parsed.stream,
            parsed.stream_host,
            parsed.stream_token,
            parsed.stream_cert,
            parsed.stream_key,
        ),
    )


def _show(window: MainWindow, options: WindowOptions) -> None:
    window.show_far(options.far)
    if options.size is None:
        window.showMaximized()
    else:
        window.resize(*options.size)
        window.show()


def _save_pictures(window: MainWindow, paths: Sequence[Path]) -> bool:
    """Save what the window showed last, and say whether every file could be written."""
    saved = True
    for path in paths:
        if not window.grab().save(str(path)):
            sys.stderr.write(f"The picture {path} cannot be written.\n")
            saved = False
    return saved


def _splash(app: QApplication, source: str, options: WindowOptions) -> QLabel:
    label = PlainLabel(tr("OCMM\n\nStarting: {source}").format(source=source))
    label.setAlignment(Qt.AlignmentFlag.AlignCenter)
    label.setWindowTitle("OCMM")
    label.setFont(text_font(20))
    label.resize(520, 200)
    apply_theme(app, label, THEMES[options.theme])
    label.show()
    app.processEvents()
    return label


def _end_on_signals(app: QApplication) -> None:
    def end(number: int, frame: FrameType | None) -> None:
        # By the event loop: before it runs, quitting would have no effect.
        QTimer.singleShot(0, app.quit)

    # The timer of the live values gives Python the turns in which signals are handled.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, end)


def _window_options(parsed: argparse.Namespace) -> WindowOptions:
    return WindowOptions(
        theme=parsed.theme,
        far=parsed.far,
        size=parsed.size,
        export=parsed.out,
        quit_after_s=parsed.quit_after,
        screenshots=tuple(parsed.screenshot),
        sound=not parsed.silent,
    )


def _picture(text: str) -> Path:
    """Return where a picture goes; a job file behind the option is none and is not written over."""
    if not text.lower().endswith(".png"):
        raise argparse.ArgumentTypeError(f"{text!r} is no picture; give a name ending in .png")
    return Path(text)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    return int(width), int(height)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ocmm-window",
        description="The OCMM window: measure a part to a plan, with real or virtual cameras.",
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    add = parser.add_argument
    add("--plan", type=Path, default=resource("plans", "demo.toml"), help="what to measure")
    add("job", nargs="?", type=Path, help="job file to look at, read-only")
    add("--rig", type=Path, default=resource("rigs", "recommended.toml"), help="the cameras")
    add("--probe", type=Path, default=resource("probes", "standard.toml"), help="the probe")
    add("--reference", type=Path, help="reference body: LEDs fixed on the part or its table")
    add(
        "--part", type=Path, default=resource("parts", "demo.toml"),
        help="the true part, for virtual rigs",
    )  # fmt: skip
    add(
        "--source", default=DEFAULT_SOURCE,
        help="source of frames, see 'ocmm measure --help'",
    )  # fmt: skip
    add("--seed", type=int, default=3, help="seed of the virtual rig")
    add("--speed", type=float, default=1.0, help="virtual rig: times real time; 0 is unlimited")
    add("--operator", default="demo", help="who measures")
    add("--serial", help="serial number of the part; asked in the window for real cameras")
    add("--out", type=Path, help="folder of the job file and the report; asked when exporting")
    add(
        "--force",
        action="store_true",
        help="use a network interface although the computer itself uses it",
    )
    add(
        "--calibrations", type=Path,
        help="calibration folder; default: this user's for real cameras, none for virtual ones",
    )  # fmt: skip
    add(
        "--uncalibrated",
        action="store_true",
        help="measure without a calibration: every verdict is NOT PROVEN",
    )
    add_climate(parser)
    add(
        "--probes", type=Path,
        help="probe record folder; default: this user's for real cameras, none for virtual ones",
    )  # fmt: skip
    add("--tip", help="name of the mounted tip; default: from the records")
    add(
        "--check-after", type=float, default=8.0, metavar="HOURS",
        help="hours without a point or check after which the tip must be checked",
    )  # fmt: skip
    add("--stream", type=int, metavar="PORT", help="stream points and poses to other programs")
    add(
        "--stream-host",
        default="127.0.0.1",
        help="address of the stream; non-local ones need a token",
    )
    add(
        "--stream-token", type=Path, help="file with the token of the stream, readable by you alone"
    )
    add("--stream-cert", type=Path, help="certificate (PEM): the stream speaks TLS")
    add("--stream-key", type=Path, help="private key of that certificate (PEM, no password)")
    add("--theme", choices=tuple(THEMES), default=DEFAULT_THEME, help="colour theme; T changes it")
    add("--far", action="store_true", help="start in the far view; F11 changes it")
    add("--size", type=_size, help="of the window, e.g. 1280x720; default: maximised")
    add("--silent", action="store_true", help="no sounds")
    add("--quit-after", type=float, default=0.0, metavar="SECONDS", help="close automatically")
    add(
        "--screenshot", type=_picture, nargs="+", default=[], metavar="FILE",
        help="save a picture of the window when it closes automatically",
    )  # fmt: skip
    return parser

"""Composition root of the window: arguments and settings in, a running window out.

Windows follow each other in one process: the start page, a job, the start page or the job again
with other settings. Each job has a station of its own, which its window closes.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QtMsgType, qInstallMessageHandler
from PySide6.QtWidgets import QApplication

from ocmm_core.composition import DEFAULT_SOURCE, DEMO_PLAN
from ocmm_core.errors import InputError, InternalError, OcmmError
from ocmm_core.failure import EXIT_INTERNAL, REOPEN, contained, hold_standard_streams, write_last
from ocmm_core.host import library_fault
from ocmm_core.options import DEFAULT_SERIAL
from ocmm_core.settings import LoadedSettings, Settings, SettingsStore
from ocmm_core.wording import LANGUAGE_VARIABLE, language_of
from ocmm_gui import _start as starting
from ocmm_gui import kit
from ocmm_gui.access import zoom_before_start
from ocmm_gui.home import StartChoice, StartPurpose, StartWindow

if TYPE_CHECKING:
    from ocmm_core.composition import StationRequest
    from ocmm_gui.bridge import StationBridge
    from ocmm_gui.window import MainWindow

EXIT_OK, EXIT_FAILED = 0, 2
_START_PAGE = StartChoice(StartPurpose.START)
_HELD = "job.locked"
_LOST = ("job.lost", "job.disk")
_SAFE = "All points taken are saved in the job file."


def make_application(zoom_percent: int = 100) -> QApplication:
    """Return the application, styled alike on every system; InputError without a screen.

    ``zoom_percent`` is used if Qt cannot change it later.
    """
    existing = QApplication.instance()
    if isinstance(existing, QApplication):
        return existing
    screens = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    if sys.platform == "linux" and not any(os.environ.get(name) for name in screens):
        # Qt would end the program with a message about its plugins.
        raise _no_display()
    # Tracking and simulating threads yield to the window after 1 ms instead of 5: the p99 of its
    # latency falls from 40 to 25 ms on two cores, without a loss of frames (benchmarks/window.py).
    sys.setswitchinterval(0.001)
    zoom_before_start(zoom_percent)
    with _fatal_messages_end_in_a_sentence():
        app = QApplication(["ocmm"])
    app.setApplicationName("OCMM")
    app.setStyle("Fusion")
    app.setFont(kit.text_font(14))
    return app


def _no_display() -> InputError:
    return library_fault() or InputError(
        "window.no_display",
        "No display available for the window.",
        "Start OCMM on a desktop, or measure without a window: ocmm demo --headless.",
    )


@contextlib.contextmanager
def _fatal_messages_end_in_a_sentence() -> Iterator[None]:
    """Exit with 2 where Qt would abort: the display does not answer, or a library is missing."""
    messages: list[str] = []

    def keep(kind: QtMsgType, _context: object, text: str) -> None:
        messages.append(text)
        if kind == QtMsgType.QtFatalMsg:
            error = _no_display()
            write_last("\n".join((error.what, error.remedy, "", *messages, "")))
            os._exit(EXIT_FAILED)

    before = qInstallMessageHandler(keep)
    try:
        yield
    finally:
        qInstallMessageHandler(before)
    # Qt then uses a locale with UTF-8: nothing to do for the user.
    kept = (text for text in messages if not text.startswith("Detected locale"))
    sys.stderr.write("".join(f"{text}\n" for text in kept))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the window; return 0, 2 if not started or the last job is lost, 3 after other errors."""
    hold_standard_streams()
    parsed = starting.parser().parse_args(arguments)
    try:
        return run(parsed)
    except Exception as error:
        told = contained(error, "The window", _SAFE, remedy=REOPEN)
        sys.stderr.write(f"{told.what}\n{told.remedy}\n")
        return EXIT_INTERNAL if isinstance(told, InternalError) else EXIT_FAILED


def run(parsed: argparse.Namespace) -> int:
    """Show windows in sequence, and return when the last one has closed.

    OcmmError if the station of the command line cannot be built. Choices of the start page that
    cannot be opened are reported there instead.
    """
    store = SettingsStore.of_this_user(starting.given(parsed))
    app = make_application(store.load().settings.window_zoom)
    app.setQuitOnLastWindowClosed(False)
    starting.end_on_signals(app)
    told = kit.NoticeCentre()
    sender = starting.HandOverSender(store)
    try:
        return _windows(app, parsed, store, told)
    finally:
        sender.close()


def _windows(
    app: QApplication, parsed: argparse.Namespace, store: SettingsStore, told: kit.NoticeCentre
) -> int:
    choice = StartChoice(StartPurpose.MEASURE)
    if parsed.job is not None:
        # A double click on a job opens it read-only: no robot measures behind the page.
        choice = StartChoice(StartPurpose.LOOK, parsed.job)
    elif parsed.start:
        choice = _START_PAGE
    closed, before = EXIT_OK, store.load().settings.window_language
    while True:
        # Windows use the language of the settings; a change recreates them, and ends `--language`.
        settings = store.load().settings
        if settings.window_language != before:
            os.environ.pop(LANGUAGE_VARIABLE, None)
        use_language_of(app, settings)
        if choice.errand is StartPurpose.START:
            chosen = _ask(app, parsed, store, choice, told)
            if chosen is None:
                return closed
            choice, told = chosen, kit.NoticeCentre()
            continue
        try:
            code, after = _work(app, parsed, store, choice, told)
        except OcmmError as error:
            if choice.errand is StartPurpose.MEASURE:
                raise
            told = kit.NoticeCentre()
            told.error(error)
            if error.code in _LOST:
                # The Start page states where the points are; its exit code is that of the loss.
                choice, closed = _START_PAGE, EXIT_FAILED
            else:
                choice = choice.otherwise or _instead(choice, error)
            continue
        if code != EXIT_OK or after is None:
            return code
        starting.let_go()
        choice, told = after, kit.NoticeCentre()


def _instead(choice: StartChoice, error: OcmmError) -> StartChoice:
    """Return the fallback of an impossible errand: a job in use can be viewed."""
    if choice.errand is StartPurpose.CONTINUE and choice.path is not None and error.code == _HELD:
        return StartChoice(StartPurpose.LOOK, choice.path)
    return _START_PAGE


def use_language_of(app: QApplication, settings: Settings) -> None:
    """Use the language of the command, else of the settings, and the numbers of the settings."""
    language = language_of(os.environ, kit.chosen_language(settings.window_language))
    kit.use_language(app, language)
    kit.use_numbers(kit.style_of(language, settings.window_decimal, settings.window_units))


def _ask(
    app: QApplication,
    parsed: argparse.Namespace,
    store: SettingsStore,
    choice: StartChoice,
    told: kit.NoticeCentre,
) -> StartChoice | None:
    """Show the start page, and return the choice; None if it was closed."""
    notices = kit.NoticeCentre()
    window = StartWindow(store, notices)
    for notice in told.kept():
        notices.post(notice)
    window.closed.connect(app.quit)
    starting.show(window, parsed.size)
    window.read()
    if choice.section:
        window.show_settings(choice.section)
    starting.end_after(parsed.quit_after, window.close)
    app.exec()
    starting.save_pictures(window, parsed.screenshot)
    window.close()
    window.deleteLater()
    return window.choice


def _work(
    app: QApplication,
    parsed: argparse.Namespace,
    store: SettingsStore,
    choice: StartChoice,
    told: kit.NoticeCentre,
) -> tuple[int, StartChoice | None]:
    """Do an errand, and return the exit code with the next choice, or None."""
    # Everything loaded here stays: garbage collection would take a seventh of the start.
    gc.disable()
    loaded = store.load()
    options = starting.window_options(parsed, loaded)
    # Numerical libraries take a second to load: show something before that.
    splash = starting.splash(app, loaded.settings.instrument_source, options.theme)
    try:
        from ocmm_core.composition import AcceptanceBench, build_station, source_of
        from ocmm_gui.bridge import StationBridge
        from ocmm_gui.kit import ErrorHooks, SoundPlayer
        from ocmm_gui.window import REOPEN, START, MainWindow

        request = _request(parsed, loaded, choice)
        built = build_station(request)
    finally:
        splash.close()
        splash.deleteLater()
    notices = kit.NoticeCentre()
    try:
        bridge = StationBridge(built.station)
    except BaseException:
        built.station.close()
        raise
    watch = starting.watch_jobs(built, loaded, choice)
    code, after = EXIT_OK, ""
    path, plan = built.job_path, built.station.job.plan_file
    practised = source_of(request.source).spec.practice
    try:
        with ErrorHooks(notices):
            window = MainWindow(
                bridge,
                notices,
                sounds=SoundPlayer(enabled=options.sound, volume=loaded.settings.window_volume),
                theme=options.theme,
                out=options.export,
                bench=AcceptanceBench(request, built.recorded),
                store=store,
                hand=built.hand,
                practice=None if practised is None else practised(request),
            )
            window.show_far(options.far)
            starting.show(window, options.size)
            gc.freeze()
            gc.enable()
            _open_page(window, bridge, parsed, loaded, choice)
            window.load_the_rest()
            for note in loaded.notes:
                notices.warn(note.what, note.remedy)
            for notice in told.kept():
                notices.post(notice)
            window.closed.connect(app.quit)
            starting.end_after(options.quit_after_s, window.close)
            app.exec()
            # The current job may differ from the first by now.
            path, plan = built.station.job.path, built.station.job.plan_file
            after = window.after
            if not starting.save_pictures(window, options.screenshots):
                code = EXIT_FAILED
    finally:
        gc.enable()
        bridge.close()
        if watch is not None:
            watch.close()
    failure, lost = built.station.faults.why_failed(), built.station.job.lost
    for ended in (window, bridge, notices):
        ended.deleteLater()
    if isinstance(failure, InternalError):
        sys.stderr.write(f"{failure.what}\n{failure.remedy}\n")
        return EXIT_INTERNAL, None
    if lost is not None and not after:
        raise lost
    leaves = choice.errand is not StartPurpose.MEASURE or bool(after) or failure is not None
    kept = _left_behind(path, plan) if leaves else path
    if after == START:
        return code, _START_PAGE
    if after == REOPEN:
        by_plan = StartChoice(StartPurpose.NEW, plan)
        # Points of other cameras or another probe stay unchanged: the next job is a new one.
        return code, by_plan if kept is None else StartChoice(StartPurpose.CONTINUE, kept, by_plan)
    return code, None


def _left_behind(path: Path, plan: Path | None) -> Path | None:
    """Remember the last job; remove a job without points and return None for it."""
    from ocmm_core.station import drop_job_without_points

    recent = kit.RecentPlaces()
    if plan is not None:
        recent.note_plan(plan)
    with contextlib.suppress(OcmmError):
        if drop_job_without_points(path):
            return None
    recent.note_job(path)
    return path


def _open_page(
    window: MainWindow,
    bridge: StationBridge,
    parsed: argparse.Namespace,
    loaded: LoadedSettings,
    choice: StartChoice,
) -> None:
    """Open the page of an errand; frames are recorded once measuring starts."""
    started = False

    def start() -> None:
        nonlocal started
        if not started:
            started = True
            bridge.start()

    errand, path = choice.errand, choice.path
    source = loaded.settings.instrument_source
    if errand in (StartPurpose.NEW, StartPurpose.LOOK, StartPurpose.PLANS):
        # Before that nothing is touched: a robot hand must not measure behind the page.
        bridge.jobs.job_begun.connect(start)
        window.sheets.left.connect(start)
    if errand is StartPurpose.NEW:
        window.sheets.open_job()
    elif errand is StartPurpose.LOOK and path is not None:
        window.sheets.look_at(path)
    elif errand is StartPurpose.PLANS:
        window.sheets.show_sheet("plan")
    elif errand is StartPurpose.CALIBRATE:
        window.show_mode(kit.Mode.MAINTAIN)
        window.maintenance.view.show_page(window.maintenance.calibration)
        if source == DEFAULT_SOURCE:
            # A robot hand must not measure behind the page.
            window.pages.turned.connect(lambda: start() if window.pages.measures() else None)
        else:
            start()
    else:
        unknown = parsed.serial == DEFAULT_SERIAL
        if errand is StartPurpose.MEASURE and unknown and source != DEFAULT_SOURCE:
            # Operator and part are entered before the first point.
            window.sheets.open_job()
        start()


def _request(
    parsed: argparse.Namespace, loaded: LoadedSettings, choice: StartChoice
) -> StationRequest:
    from ocmm_core.composition import Errand, StationRequest, request_of_settings

    settings = loaded.settings
    if choice.errand is StartPurpose.DEMO:
        # As shipped, regardless of the station: its records do not apply to a virtual rig.
        return StationRequest(plan=DEMO_PLAN, out=settings.job_folder, speed=1.0, stay=True)
    plan = parsed.plan
    if choice.errand is StartPurpose.NEW and choice.path is not None:
        plan = choice.path
    errand = Errand(
        plan=plan,
        part=parsed.part,
        seed=parsed.seed,
        speed=parsed.speed,
        serial=parsed.serial,
        resume=choice.path if choice.errand is StartPurpose.CONTINUE else None,
        force=parsed.force,
        uncalibrated=parsed.uncalibrated,
    )
    return request_of_settings(settings, errand)

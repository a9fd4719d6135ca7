"""Tables of the bus page: cameras and events."""

from __future__ import annotations

from datetime import datetime

from PySide6.QtWidgets import QHeaderView

from ocmm_core.fieldbus.report import BusEvent, BusReport, CameraReport, is_present
from ocmm_gui.kit import DataTable, Theme, day_words, later, localised, said, tr, tr_all

_UNKNOWN = "–"
_CAMERA_COLUMNS = (
    (later("Camera"), later("Name in the rig document")),
    (later("Serial"), later("Serial number")),
    (later("Place"), later("Position on the bus, from 1")),
    (later("State"), later("State of its bus controller; OP = operational")),
    (later("AL status"), later("Why it left operation")),
    (later("Frames"), later("Frames received")),
    (later("Lost"), later("Frames lost")),
    (later("Overruns"), later("Buffer overruns")),
    (later("Bad"), later("Cycles refused because of it")),
    (later("Clock"), later("Clock offset from the bus clock, ns")),
    ("°C", later("Sensor temperature")),
    (later("Link"), later("Link errors counted by the camera")),
    (later("Emerg."), later("Emergency messages")),
    (later("Starts"), later("Power-on count")),
    (later("Firmware"), later("Version it reports")),
)
_STATE_COLUMN, _AL_COLUMN, _LOSS_COLUMN = 3, 4, 6
_EVENT_COLUMNS = (
    (later("Time"), later("Local start time")),
    (later("Camera"), later("Camera concerned")),
    (later("What happened"), later("Description")),
    (later("What to do"), later("Description")),
    (later("Cycles"), later("Number of cycles affected")),
    (later("Code"), later("For support")),
)
_WORD_COLUMNS = (2, 3)


class CameraTable(DataTable):
    """One row per camera of the rig."""

    def __init__(self) -> None:
        super().__init__(tr("Cameras on the bus"), tr_all(_CAMERA_COLUMNS))
        header = self.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(_AL_COLUMN, QHeaderView.ResizeMode.Stretch)
        self.verticalHeader().setDefaultSectionSize(24)
        self._report: BusReport | None = None

    def show_report(self, report: BusReport) -> None:
        """Show the cameras of a report, in the order of the rig."""
        self._report = report
        if self.rowCount() != len(report.cameras):
            self.setRowCount(len(report.cameras))
            frame = 2 * self.frameWidth() + 6
            high = self.horizontalHeader().sizeHint().height() + frame
            self.setFixedHeight(high + sum(self.rowHeight(r) for r in range(self.rowCount())))
        for row, camera in enumerate(report.cameras):
            colours = self._colours_of(camera)
            for column, text in enumerate(_camera_words(camera)):
                self._write(row, column, text, colours.get(column))

    def set_theme(self, theme: Theme) -> None:
        self._colours = theme
        if self._report is not None:
            self.show_report(self._report)

    def _colours_of(self, camera: CameraReport) -> dict[int, str]:
        theme = self._colours
        in_order = camera.state == "OP" and camera.al_code == 0
        state = theme.good if in_order else theme.warn if is_present(camera) else theme.bad
        code = theme.bad if camera.al_code else theme.muted
        colours = {_STATE_COLUMN: state, _AL_COLUMN: code}
        counts = (camera.frames_lost, camera.overruns, camera.bad_cycles)
        for column, count in enumerate(counts, start=_LOSS_COLUMN):
            if count:
                colours[column] = theme.warn
        return colours


class BusEventTable(DataTable):
    """Events, newest first."""

    def __init__(self) -> None:
        super().__init__(tr("Events, newest first"), tr_all(_EVENT_COLUMNS))
        header = self.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        for column in _WORD_COLUMNS:
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.Stretch)
        self.setWordWrap(True)
        self._events: tuple[BusEvent, ...] = ()
        header.sectionResized.connect(self._fit_rows)

    def show_report(self, report: BusReport) -> None:
        if report.events != self._events:
            self._events = report.events
            self._show_events()

    def set_theme(self, theme: Theme) -> None:
        self._colours = theme
        self._show_events()

    def _show_events(self) -> None:
        theme = self._colours
        self.setRowCount(len(self._events))
        for row, event in enumerate(reversed(self._events)):
            back = event.code == "bus.operation"
            for column, text in enumerate(_event_words(event)):
                colour = theme.muted if column in (0, 4, 5) else theme.good if back else None
                self._write(row, column, text, colour)
        self.resizeRowsToContents()

    def _fit_rows(self, column: int) -> None:
        if column in _WORD_COLUMNS:
            self.resizeRowsToContents()


def _camera_words(camera: CameraReport) -> tuple[str, ...]:
    code = f"0x{camera.al_code:04X} {camera.al_text}" if camera.al_code else tr("no error")
    offset, warm = camera.clock_offset_ns, camera.temperature_c
    return (
        camera.name,
        str(camera.serial),
        str(camera.position) if camera.position else tr("not found"),
        camera.state if is_present(camera) else tr("NO ANSWER"),
        code if is_present(camera) or camera.al_code else _UNKNOWN,
        str(camera.frames),
        str(camera.frames_lost),
        str(camera.overruns),
        str(camera.bad_cycles),
        _UNKNOWN if offset is None else str(offset),
        _UNKNOWN if warm is None else localised(f"{warm:.1f}"),
        str(camera.link_errors),
        str(camera.emergencies),
        str(camera.boot_counter),
        camera.firmware or _UNKNOWN,
    )


def _event_words(event: BusEvent) -> tuple[str, ...]:
    when = datetime.fromtimestamp(event.utc_ns * 1e-9).astimezone()
    today = when.date() == datetime.now().astimezone().date()
    stamp = f"{when:%H:%M:%S.%f}"[:-3]
    return (
        stamp if today else f"{day_words(when)} {stamp}",
        event.camera or tr("all"),
        said(event.what),
        said(event.remedy),
        str(event.cycles),
        event.code,
    )

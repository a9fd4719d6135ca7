"""Bus report: alarms, a snapshot, and their texts.

In: counters and events of the bus process.
Out: JSON, sentences, and a text to mail.

Start with `_alarms` (title and remedy of each) and `_report` (snapshot and JSON); then
`_formatting` (sentences, plain text, figures for other programs).

It must not import the wire or the device: another computer can display a report.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.fieldbus.report._alarms import (
        Alarm, AlarmResponse, AlarmSpec, alarm_of_code, alarm_of_error,
    )  # fmt: skip
    from ocmm_core.fieldbus.report._formatting import (
        Link, WirePicture, is_present, microseconds, pace_words, report_text, shares,
        statistics_csv, statistics_json, trouble_words, unaccounted, wire_picture, within_us,
    )  # fmt: skip
    from ocmm_core.fieldbus.report._report import (
        EDGES_US, MAX_EVENTS, BusEvent, BusPhase, BusReport, CameraReport, Histogram, decode_report,
        encode_report,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "EDGES_US", "MAX_EVENTS", "Alarm", "AlarmResponse", "AlarmSpec", "BusEvent", "BusPhase",
    "BusReport", "CameraReport", "Histogram", "Link", "WirePicture", "alarm_of_code",
    "alarm_of_error", "decode_report", "encode_report", "is_present", "microseconds", "pace_words",
    "report_text", "shares", "statistics_csv", "statistics_json", "trouble_words", "unaccounted",
    "wire_picture", "within_us",
]  # fmt: skip

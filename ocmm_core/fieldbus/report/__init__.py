"""What the bus says about itself: alarms, a snapshot, and both in words.

In: counters and events as the bus process gives them. Out: JSON, sentences, and a text to mail.

Read `_alarms` (one name, one sentence and one remedy each), `_report` (the snapshot and its JSON),
`_messages` (what it means, in shares) and `_formatting` (the whole as plain text); `_statistics`
(figures for other programs).
It must not know the wire or the device: a screen on another computer can read a report.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.fieldbus.report._alarms import (
        Alarm,
        AlarmResponse,
        AlarmSpec,
        alarm_of_code,
        alarm_of_error,
    )
    from ocmm_core.fieldbus.report._formatting import report_text
    from ocmm_core.fieldbus.report._messages import (
        Link,
        WirePicture,
        is_present,
        microseconds,
        pace_words,
        shares,
        trouble_words,
        unaccounted,
        wire_picture,
        within_us,
    )
    from ocmm_core.fieldbus.report._report import (
        EDGES_US,
        MAX_EVENTS,
        BusEvent,
        BusPhase,
        BusReport,
        CameraReport,
        Histogram,
        decode_report,
        encode_report,
    )
    from ocmm_core.fieldbus.report._statistics import statistics_csv, statistics_json
else:
    __getattr__ = door(
        __name__,
        _alarms="Alarm AlarmSpec AlarmResponse alarm_of_code alarm_of_error",
        _report=(
            "BusEvent BusPhase BusReport CameraReport EDGES_US Histogram MAX_EVENTS decode_report "
            "encode_report"
        ),
        _formatting="report_text",
        _statistics="statistics_csv statistics_json",
        _messages=(
            "Link WirePicture is_present microseconds pace_words shares trouble_words "
            "unaccounted wire_picture within_us"
        ),
    )

__all__ = [
    "EDGES_US",
    "MAX_EVENTS",
    "Alarm",
    "AlarmResponse",
    "AlarmSpec",
    "BusEvent",
    "BusPhase",
    "BusReport",
    "CameraReport",
    "Histogram",
    "Link",
    "WirePicture",
    "alarm_of_code",
    "alarm_of_error",
    "decode_report",
    "encode_report",
    "is_present",
    "microseconds",
    "pace_words",
    "report_text",
    "shares",
    "statistics_csv",
    "statistics_json",
    "trouble_words",
    "unaccounted",
    "wire_picture",
    "within_us",
]

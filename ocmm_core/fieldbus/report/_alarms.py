"""Bus alarms: one table for supervisor, journal, Bus page, report and docs/technician/wire.md."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, StrEnum, auto


class AlarmResponse(Enum):
    """Automatic response to an alarm."""

    NOTE = auto()
    """None: no cycle is refused."""
    WAIT = auto()
    """Refuse the cycle and wait for a good one; after a long wait, a bring-up."""
    LIFT = auto()
    """As WAIT, with more patience: cameras in SAFEOP are lifted meanwhile."""
    BRING_UP = auto()
    """Refuse the cycle; after some in a row, a bring-up."""
    REPEAT = auto()
    """Found by bring-ups only; repeat them with a growing pause."""


@dataclass(frozen=True, slots=True)
class AlarmSpec:
    code: str
    """Stable; used in logs, reports and on screen."""
    title: str
    remedy: str
    """`title`, `remedy`: user texts."""
    answer: AlarmResponse = AlarmResponse.NOTE
    confirmed: int = 0
    """Consecutive cycles until confirmed; zero except for `AlarmResponse.BRING_UP`."""
    errors: tuple[str, ...] = ()
    """Codes of bring-up errors with the same meaning."""


class Alarm(StrEnum):
    """All alarms by name; as text each is its code."""

    spec: AlarmSpec

    def __new__(cls, spec: AlarmSpec) -> Alarm:
        """Create the member of an entry."""
        alarm = str.__new__(cls, spec.code)
        alarm._value_ = spec.code
        alarm.spec = spec
        return alarm

    LINK_DOWN = AlarmSpec(
        "bus.link_down", "No link to the cameras",
        "Plug in the bus cable at both ends; check the camera supply.",
        AlarmResponse.BRING_UP, 1, errors=("bus.no_interface", "bus.down", "bus.unusable"),
    )  # fmt: skip
    SILENT = AlarmSpec(
        "bus.silent", "No camera answers",
        "Check power and cable of the first camera on the bus.",
        AlarmResponse.WAIT, errors=("bus.no_cameras",),
    )  # fmt: skip
    LOST_ANSWERS = AlarmSpec(
        "bus.lost_answers", "Answers lost",
        "Check the bus cables and keep them away from drives and welders.",
        AlarmResponse.WAIT,
    )  # fmt: skip
    LATE_ANSWERS = AlarmSpec(
        "bus.late_answers", "Answers late",
        "Connect only the cameras to this network adapter.",
        AlarmResponse.WAIT,
    )  # fmt: skip
    STRAY_ANSWERS = AlarmSpec(
        "bus.stray_answers", "Duplicate or out-of-order answers",
        "Do not use an ordinary switch between the cameras.",
    )  # fmt: skip
    WORKING_COUNTER = AlarmSpec(
        "bus.working_counter", "Not every camera took part",
        "Check the cable at the port that is named and the power of that camera.",
        AlarmResponse.WAIT, errors=("bus.map",),
    )  # fmt: skip
    CAMERA_MISSING = AlarmSpec(
        "bus.camera_missing", "A camera is missing",
        "Switch the camera on and check the cable that leads to it.",
        AlarmResponse.BRING_UP, 10, errors=("bus.no_answer",),
    )  # fmt: skip
    FOREIGN_DEVICE = AlarmSpec(
        "bus.foreign_device", "A device on the bus is not a camera",
        "Connect only the cameras to this bus.",
        AlarmResponse.REPEAT, errors=("bus.revision",),
    )  # fmt: skip
    DUPLICATE = AlarmSpec(
        "bus.duplicate", "Two cameras have the same identity",
        "Give each camera its own serial number and alias.",
        AlarmResponse.REPEAT,
    )  # fmt: skip
    DUPLICATE_ADDRESS = AlarmSpec(
        "bus.duplicate_address", "Two cameras answer to the same address",
        "Power-cycle the cameras.",
        AlarmResponse.BRING_UP, 2,
    )  # fmt: skip
    CAMERAS = AlarmSpec(
        "bus.cameras", "The cameras do not match the rig",
        "Connect the cameras of the rig, or load the matching rig.",
        AlarmResponse.BRING_UP, 3,
        errors=("bus.no_serial", "bus.too_many", "bus.two_serials", "bus.sensor"),
    )  # fmt: skip
    ALIAS = AlarmSpec(
        "bus.alias", "Cameras were swapped",
        "Swap the cameras back, or correct their alias and calibrate.",
        AlarmResponse.REPEAT,
    )  # fmt: skip
    RESTARTED = AlarmSpec(
        "bus.restarted", "A camera was restarted",
        "Wait until it is checked again; check its power supply.",
        AlarmResponse.BRING_UP, 2,
    )  # fmt: skip
    LEFT_OPERATION = AlarmSpec(
        "bus.left_operation", "A camera left operation",
        "Wait until it is back; if it stays away, power-cycle it.",
        AlarmResponse.LIFT, errors=("bus.state",),
    )  # fmt: skip
    WATCHDOG = AlarmSpec(
        "bus.watchdog", "A camera waited too long for this computer",
        "Close other programs; the cameras resume by themselves.",
        AlarmResponse.LIFT,
    )  # fmt: skip
    SYNC = AlarmSpec(
        "bus.sync", "A camera does not follow the bus clock",
        "Check the cables between the cameras.",
        AlarmResponse.LIFT, errors=("bus.clock",),
    )  # fmt: skip
    FROZEN = AlarmSpec(
        "bus.frozen", "A camera repeats old data",
        "Power-cycle the camera; have it checked if it happens again.",
        AlarmResponse.WAIT,
    )  # fmt: skip
    CONFIGURATION = AlarmSpec(
        "bus.configuration", "A camera has a configuration other than the one set",
        "Open the job again.",
        AlarmResponse.BRING_UP, 20, errors=("bus.mapping",),
    )  # fmt: skip
    FRAME_RATE = AlarmSpec(
        "bus.frame_rate", "A camera runs at another frame rate",
        "Open the job again.",
        AlarmResponse.BRING_UP, 20,
    )  # fmt: skip
    PAYLOAD = AlarmSpec(
        "bus.payload", "Inconsistent data from a camera",
        "Check the bus cables; have the camera checked.",
        AlarmResponse.WAIT,
    )  # fmt: skip
    EXCHANGED = AlarmSpec(
        "bus.exchanged_data", "Data of one camera in the place of another",
        "Remove what is between the cameras and this computer; power-cycle the cameras.",
        AlarmResponse.BRING_UP, 10,
    )  # fmt: skip
    GAP = AlarmSpec(
        "bus.gap", "A camera skipped frames",
        "Check the load of this computer and the bus cables.",
        AlarmResponse.BRING_UP, 10,
    )  # fmt: skip
    CLOCK_JUMP = AlarmSpec(
        "bus.clock_jump", "The bus clock jumped",
        "Wait until the clocks are set again; check the first camera.",
        AlarmResponse.BRING_UP, 3,
    )  # fmt: skip
    CLOCK_DRIFT = AlarmSpec(
        "bus.clock_drift", "The clocks of cameras and computer drift apart",
        "Have the first camera checked; its clock is out of tolerance.",
    )  # fmt: skip
    PORT_ERRORS = AlarmSpec(
        "bus.port_errors", "Broken frames or lost links at a port of a camera",
        "Replace the cable at that port; keep it away from drives and welders.",
    )  # fmt: skip
    EMERGENCY = AlarmSpec(
        "bus.emergency", "A camera reports an emergency",
        "Look up the error code in the camera's error history.",
    )  # fmt: skip
    SECOND_MASTER = AlarmSpec(
        "bus.second_master", "Another master is on the camera bus",
        "Stop the other program, or disconnect the other computer from the bus.",
        AlarmResponse.BRING_UP, confirmed=3,
    )  # fmt: skip
    OBJECT_TIMEOUT = AlarmSpec(
        "bus.object_timeout", "A camera does not answer a request",
        "Measuring continues; repeat the request.",
    )  # fmt: skip
    OBJECT_REFUSED = AlarmSpec(
        "bus.refused", "A camera refuses a request",
        "Check the value; install the matching firmware.",
    )  # fmt: skip
    REDUNDANCY = AlarmSpec(
        "bus.redundancy", "The redundancy cable or a bus cable is broken",
        "Measuring continues; replace the broken cable.",
    )  # fmt: skip
    STRETCHED = AlarmSpec(
        "bus.stretched", "The virtual bus is slower than real time",
        "Nothing is lost; close other programs to make it faster.",
    )  # fmt: skip
    HOST_BUSY = AlarmSpec(
        "bus.host_busy", "This computer was too busy for the bus",
        "Close other programs on this computer.",
    )  # fmt: skip


_BY_CODE = {alarm.spec.code: alarm for alarm in Alarm}
_BY_ERROR = {code: alarm for alarm in Alarm for code in alarm.spec.errors}


def alarm_of_code(code: str) -> Alarm | None:
    """Return the alarm with a code; None for other events."""
    return _BY_CODE.get(code)


def alarm_of_error(code: str) -> Alarm | None:
    """Return the alarm of a bring-up error, by the code of either; None if none."""
    return _BY_ERROR.get(code) or _BY_CODE.get(code)

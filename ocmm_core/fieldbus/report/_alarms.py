"""What can go wrong on the bus: one name, one sentence and one remedy for each alarm."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Alarm(StrEnum):
    """Stable codes; they stand in logs, reports and on the screen."""

    LINK_DOWN = "bus.link_down"
    SILENT = "bus.silent"
    LOST_ANSWERS = "bus.lost_answers"
    LATE_ANSWERS = "bus.late_answers"
    STRAY_ANSWERS = "bus.stray_answers"
    WORKING_COUNTER = "bus.working_counter"
    CAMERA_MISSING = "bus.camera_missing"
    FOREIGN_DEVICE = "bus.foreign_device"
    DUPLICATE = "bus.duplicate"
    DUPLICATE_ADDRESS = "bus.duplicate_address"
    CAMERAS = "bus.cameras"
    ALIAS = "bus.alias"
    RESTARTED = "bus.restarted"
    LEFT_OPERATION = "bus.left_operation"
    WATCHDOG = "bus.watchdog"
    SYNC = "bus.sync"
    FROZEN = "bus.frozen"
    CONFIGURATION = "bus.configuration"
    FRAME_RATE = "bus.frame_rate"
    PAYLOAD = "bus.payload"
    GAP = "bus.gap"
    CLOCK_JUMP = "bus.clock_jump"
    CLOCK_DRIFT = "bus.clock_drift"
    EMERGENCY = "bus.emergency"
    OBJECT_TIMEOUT = "bus.object_timeout"
    OBJECT_REFUSED = "bus.refused"
    REDUNDANCY = "bus.redundancy"
    HOST_BUSY = "bus.host_busy"


@dataclass(frozen=True, slots=True)
class AlarmText:
    """What an alarm means to people."""

    title: str
    remedy: str


TEXTS: dict[Alarm, AlarmText] = {
    Alarm.LINK_DOWN: AlarmText(
        "No link to the cameras", "Plug in the bus cable at both ends; check the camera supply."
    ),
    Alarm.SILENT: AlarmText(
        "No camera answers", "Check power and cable of the first camera on the bus."
    ),
    Alarm.LOST_ANSWERS: AlarmText(
        "Answers get lost", "Check the bus cables and keep them away from drives and welders."
    ),
    Alarm.LATE_ANSWERS: AlarmText(
        "Answers come late", "Let nothing but the cameras be on this network adapter."
    ),
    Alarm.STRAY_ANSWERS: AlarmText(
        "Answers came twice or out of order", "Use no ordinary switch between the cameras."
    ),
    Alarm.WORKING_COUNTER: AlarmText(
        "Not every camera took part", "Check the cable and power of the camera that is named."
    ),
    Alarm.CAMERA_MISSING: AlarmText(
        "A camera is missing", "Switch the camera on and check the cable that leads to it."
    ),
    Alarm.FOREIGN_DEVICE: AlarmText(
        "A device that is no camera is on the bus", "Leave only the cameras on this bus."
    ),
    Alarm.DUPLICATE: AlarmText(
        "Two cameras have the same identity", "Give each camera its own serial number and alias."
    ),
    Alarm.DUPLICATE_ADDRESS: AlarmText(
        "Two cameras answer to the same address", "Switch the cameras off and on."
    ),
    Alarm.CAMERAS: AlarmText(
        "The cameras are not those of the rig",
        "Connect the cameras of the rig, or load the rig of these cameras.",
    ),
    Alarm.ALIAS: AlarmText(
        "Cameras were exchanged", "Put the cameras back, or correct their alias and calibrate."
    ),
    Alarm.RESTARTED: AlarmText(
        "A camera was restarted", "Wait until it is checked again; look at its supply."
    ),
    Alarm.LEFT_OPERATION: AlarmText(
        "A camera left operation", "Wait until it is back; if it stays away, switch it off and on."
    ),
    Alarm.WATCHDOG: AlarmText(
        "A camera waited too long for this computer",
        "Close other programs; the cameras resume by themselves.",
    ),
    Alarm.SYNC: AlarmText(
        "A camera does not follow the bus clock", "Check the cables between the cameras."
    ),
    Alarm.FROZEN: AlarmText(
        "A camera repeats old data", "Switch the camera off and on; have it checked if it repeats."
    ),
    Alarm.CONFIGURATION: AlarmText(
        "A camera has another configuration than was set", "Start the acquisition again."
    ),
    Alarm.FRAME_RATE: AlarmText(
        "A camera runs at another frame rate", "Start the acquisition again."
    ),
    Alarm.PAYLOAD: AlarmText(
        "A camera's data contradict themselves", "Check the bus cables; have the camera checked."
    ),
    Alarm.GAP: AlarmText(
        "A camera left out frames", "Check the load of this computer and the bus cables."
    ),
    Alarm.CLOCK_JUMP: AlarmText(
        "The bus clock jumped", "Wait until the clocks are set again; check the first camera."
    ),
    Alarm.CLOCK_DRIFT: AlarmText(
        "The clocks of cameras and computer drift apart",
        "Have the first camera checked; its clock is out of its tolerance.",
    ),
    Alarm.EMERGENCY: AlarmText(
        "A camera reports an emergency", "Look up the error code in the camera's error history."
    ),
    Alarm.OBJECT_TIMEOUT: AlarmText(
        "A camera does not answer a request", "Measuring goes on; repeat the request."
    ),
    Alarm.OBJECT_REFUSED: AlarmText(
        "A camera refuses a request", "Check the value; install the matching firmware."
    ),
    Alarm.REDUNDANCY: AlarmText(
        "The redundancy cable or a bus cable is broken",
        "Measuring goes on; replace the broken cable.",
    ),
    Alarm.HOST_BUSY: AlarmText(
        "This computer was too busy for the bus", "Close other programs on this computer."
    ),
}

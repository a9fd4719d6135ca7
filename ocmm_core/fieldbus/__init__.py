"""The EtherCAT bus: the device model of the camera, and the master that runs the cameras.

In: cycles on a network interface. Out: process data of every camera that are proven fresh.

Rooms, from the first to the last: `device` (what the camera is: objects, identity, ESI file) and
`report` (alarms and the report of the bus), `wire` (frames, sockets, the fence around pysoem),
`objects` (mailboxes and transfers beside the cycle), `cycle` (bring-up, clock, health,
supervisor).
It must not know frames of exposures or processes: that is `acquisition`.
"""

__all__: list[str] = []

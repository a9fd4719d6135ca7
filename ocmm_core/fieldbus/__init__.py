"""EtherCAT: the device model of the camera and the master that runs the cameras.

In: cycles on a network interface. Out: process data of every camera, discarded unless proven
current.

Packages from first to last: `device` (objects, identity, ESI file), `report` (alarms and bus
report), `wire` (frames, sockets, pysoem), `objects` (mailboxes and acyclic transfers), `cycle`
(bring-up, clock, health, supervisor).
It must not import exposure frames or processes: those belong to `acquisition`.
"""

__all__: list[str] = []

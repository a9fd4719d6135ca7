"""Frames from any source, with every cycle counted.

In: the camera bus, the virtual rig, a raw recording, or network traffic captured with tcpdump.
Out: blocks of frames in a ring in shared memory, with counts and reasons of losses.

Three packages: `frames` defines frames and the ring; `recording` writes frames to the disk and
replays them; `bus_process` runs the real bus in a separate process. The last two are independent.
Nothing here interprets labels, poses or points; spots are passed on unchanged.
"""

__all__: list[str] = []

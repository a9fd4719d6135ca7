"""Frames from any source, with every cycle accounted for.

In: the camera bus, the virtual rig, a raw recording, or network traffic that tcpdump recorded.
Out: blocks of frames in a ring in shared memory, with counts of what was lost and why.

Three rooms, in this order: `frames` says what a frame is and how it waits in the ring;
`recording` writes frames to the disk and plays them back; `bus_process` runs the real bus in a
process of its own. The last two do not know each other.
Nothing here knows labels, poses or points; spots are passed on as the cameras gave them.
"""

__all__: list[str] = []

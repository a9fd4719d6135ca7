"""The live stream: points, button and poses for other programs, as lines of JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.station.stream._messages import verdict_line
    from ocmm_core.station.stream._options import StreamOptions, check_stream
    from ocmm_core.station.stream._probe_button import ButtonChange, ButtonWatch
    from ocmm_core.station.stream._server import StreamServer
else:
    __getattr__ = door(
        __name__,
        _messages="verdict_line",
        _options="StreamOptions check_stream",
        _probe_button="ButtonChange ButtonWatch",
        _server="StreamServer",
    )

__all__ = [
    "ButtonChange",
    "ButtonWatch",
    "StreamOptions",
    "StreamServer",
    "check_stream",
    "verdict_line",
]

"""The live stream: points, button and poses for other programs, as lines of JSON.

In: points, annulments, verdicts and poses as the station has them. Out: lines over TCP, numbered,
so that a client that comes later gets all of them in order.

Read `_messages` (one JSON object a line), `_options` (where and to whom), `_reception` (who gets
in) with `_client`, `_server`, `_log` (what was said with a number), `_verdict_watch` and
`_probe_button`.
docs/live_stream.md explains it to those who read it. Clients can read; nothing that they send does
anything. It must not know the station.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.station.stream._messages import verdict_line
    from ocmm_core.station.stream._options import StreamOptions, check_stream, tls_context
    from ocmm_core.station.stream._probe_button import ButtonChange, ButtonWatch
    from ocmm_core.station.stream._server import StreamServer
else:
    __getattr__ = door(
        __name__,
        _messages="verdict_line",
        _options="StreamOptions check_stream tls_context",
        _probe_button="ButtonChange ButtonWatch",
        _server="StreamServer",
    )

__all__ = [
    "ButtonChange", "ButtonWatch", "StreamOptions", "StreamServer", "check_stream", "tls_context",
    "verdict_line",
]  # fmt: skip

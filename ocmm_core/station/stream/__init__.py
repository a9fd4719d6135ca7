"""The live stream: points, button and poses for other programs, as lines of JSON.

In: points, annulments, verdicts and poses of the station. Out: numbered lines over TCP, so that
late clients get all of them in order.

Read `_messages` (one JSON object a line; also the button, the station as a source, and verdicts),
`_reception` (address, access, connections) with `_client` (and numbered messages), and `_server`
(also points as plain lines).
docs/integrator/live_stream.md is for readers of the stream. Clients can only read. It must not know
the station.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.station.stream._messages import (
        ButtonChange, ButtonWatch, StepReader, StreamSource, verdict_line,
    )  # fmt: skip
    from ocmm_core.station.stream._reception import (
        StreamOptions, check_stream, listen, may_connect, tls_context,
    )  # fmt: skip
    from ocmm_core.station.stream._server import PlainLines, StreamServer
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ButtonChange", "ButtonWatch", "PlainLines", "StepReader", "StreamOptions", "StreamServer",
    "StreamSource", "check_stream", "listen", "may_connect", "tls_context", "verdict_line",
]  # fmt: skip

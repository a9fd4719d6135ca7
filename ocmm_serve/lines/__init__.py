"""Points as text for any program: over TCP, a serial line, or typed by a keyboard wedge.

In: accepted points of a station. Out: one line each, in a format of the user.

Read `_template` (the format and its checks), `_feed` (the station, a serial line, a wedge)
and `_command` (`ocmm serve lines`, `ocmm serve keyboard`). TCP is the server of the
live stream (`ocmm_core.station.stream`). It must not know I++ DME.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_serve.lines._command import serve_keyboard, serve_lines
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["serve_keyboard", "serve_lines"]

"""A second screen: a page for the tablet or phone at the part.

In: the view of the job and the live values of a station, and three actions of a permitted reader.
Out: a snapshot in the reader's language, by a schema, over a WebSocket.

Read `_snapshot` (the texts and the schema), `_job` (evaluation, actions), `_access` (tokens,
addresses, connections), `_server` (its thread, pace and readers), `_command` (`ocmm serve
screen`) and `_service` (next to a job in the window). The page is in `resources/screen`.
Verdicts and numbers come from the core; nothing here makes one.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_serve.screen._access import ScreenAccess, ScreenOptions
    from ocmm_serve.screen._command import serve_screen
    from ocmm_serve.screen._job import ScreenCall
    from ocmm_serve.screen._server import ScreenServer
    from ocmm_serve.screen._service import SERVICE
    from ocmm_serve.screen._snapshot import ScreenSnapshot
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "SERVICE", "ScreenAccess", "ScreenCall", "ScreenOptions", "ScreenServer", "ScreenSnapshot",
    "serve_screen",
]  # fmt: skip

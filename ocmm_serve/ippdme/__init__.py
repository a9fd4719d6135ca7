"""Server of I++ DME (VDMA 8722): the measuring program is the client, this machine the server.

In: lines of a client over TCP, touches of a station. Out: answers, and a job next to each session.

Read `_session` first (transactions, error state, touches), then `_registry` (the commands, and the
handlers of touches and tools) with `_commands` (other handlers), `_state` and `_points`. `_grammar`
(with its dialects) and `_frames` are pure. `_machine` is a measuring station, `_server` the
sockets, and the service that joins both; `_command` is `ocmm serve ippdme`. Numbers come from the
core; a point that it refuses is never answered.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_serve.ippdme._command import serve_app
    from ocmm_serve.ippdme._frames import CsyFrames, ShiftSign
    from ocmm_serve.ippdme._grammar import DmeDialect
    from ocmm_serve.ippdme._machine import StationMachine
    from ocmm_serve.ippdme._registry import CommandSpec, supported
    from ocmm_serve.ippdme._server import SERVICE, DmeOptions, DmeServer, DmeService
    from ocmm_serve.ippdme._session import DmeSession
    from ocmm_serve.ippdme._state import DmeState
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "SERVICE", "CommandSpec", "CsyFrames", "DmeDialect", "DmeOptions", "DmeServer", "DmeService",
    "DmeSession", "DmeState", "ShiftSign", "StationMachine", "serve_app", "supported",
]  # fmt: skip

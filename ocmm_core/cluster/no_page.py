"""Keep the HTTP server of Dask closed: ``dask scheduler --preload ocmm_core.cluster.no_page``.

Dask opens one in every scheduler and worker, in the clear and on a port of its own, also with TLS
and without a dashboard. It starts after the preloads, and no option turns it off.
"""

from __future__ import annotations

from distributed.node import ServerNode


def _closed(self: ServerNode, *_given: object, **_named: object) -> None:
    """Open nothing, in the place of ``ServerNode.start_http_server``."""


ServerNode.start_http_server = _closed

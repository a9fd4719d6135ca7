"""Keep the HTTP server of Dask closed: ``dask scheduler --preload ocmm_shop.cluster.no_page``.

Dask opens an unencrypted one on a separate port in every scheduler and worker, even with TLS and
without a dashboard. It starts after the preloads, and no option disables it.
"""

from __future__ import annotations

from distributed.node import ServerNode


def _closed(self: ServerNode, *_given: object, **_named: object) -> None:
    """Replace ``ServerNode.start_http_server``: open nothing."""


ServerNode.start_http_server = _closed

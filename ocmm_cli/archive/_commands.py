"""All commands of the group, registered by importing their modules in this order."""

from __future__ import annotations

from ocmm_cli.archive import _archive, _ask, _check
from ocmm_cli.archive._app import archive_app

__all__ = ["_archive", "_ask", "_check", "archive_app"]

"""Results as a QIF 3.0 document (ISO 23952)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.export.qif._qif import QIF
else:
    __getattr__ = door(
        __name__,
        _qif="QIF",
    )

__all__ = [
    "QIF",
]

"""Waiting in tests: for an event, or for a time prescribed by the product.

A time is no substitute for an event. Times prescribed by the product keep their length if
`tests.sleeps` scales the others.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

from tests.host import HANG_S

_POLL_S = 0.005


def wait_until(condition: Callable[[], object]) -> None:
    """Wait until a condition is true; fail after `HANG_S`."""
    end = time.monotonic() + HANG_S
    while not condition():
        assert time.monotonic() < end, "the condition never came true"
        time.sleep(_POLL_S)


def let_pass(seconds: float) -> None:
    """Wait until the clock has advanced by a time prescribed by the product.

    Events of an open window are processed.
    """
    core = sys.modules.get("PySide6.QtCore")
    application = None if core is None else core.QCoreApplication.instance()
    end = time.monotonic() + seconds
    while time.monotonic() <= end:
        if application is not None:
            application.processEvents()
        time.sleep(_POLL_S)

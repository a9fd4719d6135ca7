"""The Start page is on the screen before anything that evaluates or computes is loaded."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from tests.host import HANG_S

HEAVY = ("scipy", "numba", "llvmlite", "pyqtgraph", "lxml", "pysoem", "sqlite3")

_SHOWN = """
import json, sys
import ocmm_gui.app
from ocmm_core.settings import SettingsStore
from ocmm_gui.home import StartWindow
from ocmm_gui.kit import NoticeCentre
app = ocmm_gui.app.make_application()
window = StartWindow(SettingsStore.of_this_user({}), NoticeCentre())
window.show()
app.processEvents()
assert window.isVisible()
print(json.dumps(sorted(sys.modules)))
sys.stdout.flush()
import os
os._exit(0)
"""


def test_the_start_page_is_shown_before_what_computes_is_loaded(tmp_path: Path) -> None:
    """One import of a room that evaluates made its start three times as long."""
    done = subprocess.run(
        [sys.executable, "-c", _SHOWN],
        capture_output=True, text=True, timeout=HANG_S, check=False,
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen", "HOME": str(tmp_path),
             "XDG_CONFIG_HOME": str(tmp_path), "XDG_DATA_HOME": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    modules = json.loads(done.stdout.splitlines()[-1])
    assert "ocmm_gui.home._start_window" in modules
    assert [name for name in modules if name.partition(".")[0] in HEAVY] == []

"""Make the pictures of the page of the probe's design.

Run ``python docs/images/make_probe_design.py [FOLDER]``; without a folder the pictures beside this
file are made again.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from ocmm_core.composition import ClimateRequest, StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_gui.app import make_application
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import THEMES, Mode, NoticeCentre
from ocmm_gui.window import MainWindow

SIZE = (1280, 720)
PATIENCE_S = 60.0


def main() -> int:
    """Make the pictures."""
    pictures = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    app = make_application()
    with tempfile.TemporaryDirectory() as folder:
        request = StationRequest(
            plan=resource("plans", "quick.toml"),
            out=Path(folder),
            frame_rate_hz=800,
            speed=1.0,
            stay=True,
            climate=ClimateRequest(
                probe_design=resource("designs", "standard.toml"),
                probe_c=24.2,
                part_c=22.8,
                part_expansion_ppm=11.5,
                compensate_probe=True,
                compensate_part=True,
            ),
        )
        bridge = StationBridge(build_station(request).station)
        window = MainWindow(bridge, NoticeCentre())
        window.resize(*SIZE)
        window.show()
        bridge.start()
        page = window.maintenance.probe_design
        window.show_mode(Mode.MAINTAIN)
        chapters = window.maintenance.view.list
        titles = [chapters.item(i).text() for i in range(chapters.count())]
        chapters.setCurrentRow(titles.index("Probe design"))
        page.toggle()
        until = time.monotonic() + PATIENCE_S
        while not page.number.text() and time.monotonic() < until:
            app.processEvents()
            time.sleep(0.01)
        for theme in THEMES:
            window.use_theme(theme)
            app.processEvents()
            window.grab().save(str(pictures / f"probe_design_{theme}.png"))
        window.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())

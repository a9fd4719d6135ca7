"""Make the pictures of a job with a reference body: after a knock, and with the body lost.

Run ``python docs/images/make_reference_body.py [FOLDER]``; without a folder the pictures beside
this file are made again.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from ocmm_core.composition import StationRequest, build_station
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import StatusWord
from ocmm_gui.app import make_application
from ocmm_gui.bridge import StationBridge
from ocmm_gui.kit import NoticeCentre
from ocmm_gui.window import MainWindow
from ocmm_sim.scene import ScriptedNudge, ScriptedOcclusion, WorldOptions

SIZE = (1600, 900)
PATIENCE_S = 60.0
RATE_HZ = 800
KNOCK = ScriptedNudge(5 * RATE_HZ, 0, (1e-3, 0.5e-3, -0.3e-3), (0.6, -0.5, 0.6))
HIDDEN = ScriptedOcclusion(0, (6, 7), 14 * RATE_HZ, 10**9)


def main() -> int:
    """Make the pictures."""
    pictures = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    app = make_application()
    with tempfile.TemporaryDirectory() as folder:
        request = StationRequest(
            plan=resource("plans", "quick.toml"),
            probe=resource("probes", "standard4.toml"),
            reference=resource("references", "plate.toml"),
            out=Path(folder),
            frame_rate_hz=RATE_HZ,
            speed=1.0,
            stay=True,
            world=WorldOptions(nudges=(KNOCK,), occlusions=(HIDDEN,)),
        )
        built = build_station(request)
        bridge = StationBridge(built.station)
        window = MainWindow(bridge, NoticeCentre())
        window.resize(*SIZE)
        window.show()
        bridge.start()

        def wait_for(done: Callable[[], bool]) -> None:
            until = time.monotonic() + PATIENCE_S
            while not done():
                if time.monotonic() > until:
                    msg = "the window did not come to what is to be shown"
                    raise TimeoutError(msg)
                app.processEvents()
                time.sleep(0.005)

        try:
            wait_for(lambda: built.station.looks.live().frame_counter > 12 * RATE_HZ)
            wait_for(lambda: built.station.looks.live().status is StatusWord.READY)
            wait_for(lambda: window.running.trust.isVisible())
            window.grab().save(str(pictures / "reference_after_a_knock.png"))
            wait_for(lambda: window.desk.strip.status.text() == "LOST")
            window.show_far(True)
            wait_for(lambda: built.station.looks.live().frame_counter > 15 * RATE_HZ)
            window.grab().save(str(pictures / "reference_lost.png"))
        finally:
            window.close()
            bridge.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())

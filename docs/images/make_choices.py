"""Make the pictures of choosing from a CAD model in the plan editor; needs the extra ``step``.

Run ``python docs/images/make_choices.py MODEL.stp [FOLDER]``; without a folder the pictures beside
this file are made again, from `nist_ftc_06_asme1_ap242-e2.stp` of the public models of NIST.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtCore import Qt  # the platform must be chosen before
from PySide6.QtWidgets import QApplication

from ocmm_cad.step import read_part
from ocmm_core.inspection.plan import PartOfPlan, new_plan
from ocmm_gui.app import make_application
from ocmm_gui.kit import THEMES, apply_theme
from ocmm_gui.plan_editor import PlanSheet

SIZE = (1280, 720)
PATIENCE_S = 300.0
CHOSEN = 6
"""So many faces are chosen in the picture."""


def main(path: Path, folder: Path) -> None:
    """Make the pictures of a model in ``folder``."""
    app = make_application()
    sheet = PlanSheet(new_plan("FTC-06", "PART"), None, lambda: Path("none.ocmm"))
    sheet.resize(*SIZE)
    sheet.show()
    models = sheet.models
    sheet.import_file(path)
    until = time.monotonic() + PATIENCE_S
    while not models.choice.isVisible() and time.monotonic() < until:
        app.processEvents()
        time.sleep(0.01)
    models.choice.list.setCurrentRow(3)
    _grab(app, sheet, folder, "choose_features")
    models.close()
    models.importing.part_read.emit(PartOfPlan(read_part(path)))
    for row in range(CHOSEN):
        models.faces.list.item(2 * row).setCheckState(Qt.CheckState.Checked)
    models.faces.list.setCurrentRow(2 * CHOSEN)
    _grab(app, sheet, folder, "choose_faces")
    sheet.close_work()
    sheet.close()


def _grab(app: QApplication, sheet: PlanSheet, folder: Path, name: str) -> None:
    for theme in THEMES:
        apply_theme(sheet, THEMES[theme])
        until = time.monotonic() + 1.0
        while time.monotonic() < until:
            app.processEvents()
            time.sleep(0.01)
        target = folder / f"{name}_{theme}.png"
        sheet.grab().save(str(target))
        sys.stdout.write(f"{target}\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2] if len(sys.argv) > 2 else Path(__file__).parent))

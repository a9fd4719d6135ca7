"""Modules of the window's side processes, for the server that preloads them; see `conftest`.

That server alone imports it: elsewhere these imports would hide missing ones from other tests.
"""

from __future__ import annotations

import gc
from importlib import import_module

from tests.compiled import load_compiled

_ROOMS = (
    "ocmm_core.composition", "ocmm_core.export", "ocmm_core.inspection.finished",
    "ocmm_shop.archive.questions", "ocmm_shop.recalls", "ocmm_shop.studies",
    "ocmm_core.calibration.relocation", "ocmm_core.calibration.verification",
    "ocmm_core.tolerances.monte_carlo", "ocmm_core.station", "ocmm_gui.kit", "ocmm_gui.results",
    "ocmm_gui.reports", "ocmm_gui.home", "ocmm_gui.archive", "ocmm_gui.acceptance",
    "ocmm_gui.maintain", "ocmm_gui.wizards", "ocmm_gui.wizards.pages",
)  # fmt: skip

for _room in _ROOMS:
    # A public face loads the module of a name on first access; a single module has none.
    for _name in getattr(import_module(_room), "__all__", ()):
        getattr(import_module(_room), _name)
load_compiled("ocmm_cad.", "ocmm_core.features.", "ocmm_core.part_model.")
# Objects excluded from the child's garbage collection stay shared.
gc.freeze()

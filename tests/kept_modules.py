"""What a process beside the window loads, for the server that has it loaded once; see `conftest`.

It is imported by that server alone: what is loaded here would hide from other tests what they load.
"""

from __future__ import annotations

import gc
from importlib import import_module

_ROOMS = (
    "ocmm_core.composition", "ocmm_core.export", "ocmm_core.inspection.archive",
    "ocmm_shop.archive.questions", "ocmm_shop.recalls", "ocmm_shop.studies",
    "ocmm_core.calibration.relocation", "ocmm_core.calibration.verification",
    "ocmm_core.tolerances.monte_carlo", "ocmm_core.station", "ocmm_gui.kit", "ocmm_gui.results",
    "ocmm_gui.reports", "ocmm_gui.home", "ocmm_gui.archive", "ocmm_gui.acceptance",
    "ocmm_gui.maintain", "ocmm_gui.wizards", "ocmm_gui.wizards.pages",
)  # fmt: skip

for _room in _ROOMS:
    # A face loads what lies behind a name when it is asked for it.
    for _name in import_module(_room).__all__:
        getattr(import_module(_room), _name)
# What a child of the server does not look through, it shares with it.
gc.freeze()

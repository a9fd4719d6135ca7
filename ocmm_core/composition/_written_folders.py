"""Where a killed program may have left half a file."""

from __future__ import annotations

from pathlib import Path

import platformdirs

from ocmm_core.calibration.records import default_folder, default_probe_folder
from ocmm_core.composition._feeds import StationRequest
from ocmm_core.failure import log_folder
from ocmm_core.seals import KeyFolder, memory_folder


def written_folders(request: StationRequest) -> set[Path]:
    """Return the folders that this program writes files into, as far as they are there."""
    records = [request.calibrations or default_folder(), request.probes or default_probe_folder()]
    within = {path for folder in records for path in folder.rglob("*") if path.is_dir()}
    files = [path.parent for path in (request.record, request.resume) if path is not None]
    state = platformdirs.user_state_path("ocmm")
    kept = (memory_folder(), KeyFolder().folder, log_folder())
    return {*records, *within, *files, request.out, state, *kept}

"""Arguments of the window about temperatures; the same as those of ``ocmm measure``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ocmm_core.composition import ClimateRequest


def add_climate(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    add = parser.add_argument
    add("--probe-design", type=Path, help="design document of the probe: growth and bending")
    add("--probe-temperature", type=float, metavar="°C", help="of the probe now")
    add(
        "--compensate-probe", action="store_true",
        help="compensate the probe geometry for its temperature",
    )  # fmt: skip
    add("--part-temperature", type=float, metavar="°C", help="of the part now")
    add("--part-expansion", type=float, metavar="PPM", help="1e-6/K; default: from the plan")
    add("--compensate-part", action="store_true", help="report coordinates at 20 °C")
    add("--temperature-sigma", type=float, default=0.5, metavar="K", help="of each temperature")


def climate_request(parsed: argparse.Namespace) -> ClimateRequest:
    """Return what was asked for."""
    # Numerical libraries take a second to load: something is on the screen before that.
    from ocmm_core.composition import ClimateRequest

    return ClimateRequest(
        probe_design=parsed.probe_design,
        probe_c=parsed.probe_temperature,
        part_c=parsed.part_temperature,
        sigma_k=parsed.temperature_sigma,
        part_expansion_ppm=parsed.part_expansion,
        compensate_probe=parsed.compensate_probe,
        compensate_part=parsed.compensate_part,
    )

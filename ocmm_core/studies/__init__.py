"""Measurement system analysis: gauge R&R, type 1, linearity, suitability, and our own U tested.

In: values of parts, operators and trials. Out: what the gauge adds to what it measures.

Read `_gauge_rr` (analysis of variance) and `_single` (studies of one reference).
It must not know how a value was measured.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.studies._gauge_rr import AIAG_LEVEL, GaugeStudy, SourceRow, gauge_study
    from ocmm_core.studies._single import (
        LinearityStudy,
        StatedScatter,
        Suitability,
        Type1Study,
        compare_stated,
        linearity_study,
        process_uncertainty,
        suitability,
        system_uncertainty,
        type1_study,
    )
else:
    __getattr__ = door(
        __name__,
        _gauge_rr="AIAG_LEVEL GaugeStudy SourceRow gauge_study",
        _single=(
            "LinearityStudy StatedScatter Suitability Type1Study compare_stated linearity_study "
            "process_uncertainty suitability system_uncertainty type1_study"
        ),
    )

__all__ = [
    "AIAG_LEVEL",
    "GaugeStudy",
    "LinearityStudy",
    "SourceRow",
    "StatedScatter",
    "Suitability",
    "Type1Study",
    "compare_stated",
    "gauge_study",
    "linearity_study",
    "process_uncertainty",
    "suitability",
    "system_uncertainty",
    "type1_study",
]

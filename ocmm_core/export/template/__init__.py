"""Whose paper a report is: its template, what no job knows, and where both are kept.

In: documents of a laboratory, settings, what was given with a job. Out: one `Paper` for every way
to a report.

Read `_template` (order, head, signatures, and what is asked of whoever writes) with
`_paper_lengths` (the unit of a paper) and `_surroundings` (what was read off in the room).
`_papers` keeps it for every route to a report, `_headed` gives it the head of the settings.
It must not know a job: the data of a report are in `report`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.export.template._headed import headed_paper, use_head
    from ocmm_core.export.template._paper_lengths import PaperLengths
    from ocmm_core.export.template._papers import (
        given_with,
        keep_given,
        keep_template,
        paper_of,
        station_template,
        template_in_use,
    )
    from ocmm_core.export.template._surroundings import surroundings
    from ocmm_core.export.template._template import (
        RELATES_ONLY,
        SECTIONS,
        WHOLE_ONLY,
        Paper,
        Particulars,
        ReportTemplate,
        Section,
        load_paper,
        plain_paper,
        standard_template,
    )
else:
    __getattr__ = door(
        __name__,
        _headed="headed_paper use_head",
        _paper_lengths="PaperLengths",
        _papers="given_with keep_given keep_template paper_of station_template template_in_use",
        _surroundings="surroundings",
        _template=(
            "RELATES_ONLY SECTIONS WHOLE_ONLY Paper Particulars ReportTemplate Section "
            "load_paper plain_paper standard_template"
        ),
    )

__all__ = [
    "RELATES_ONLY", "SECTIONS", "WHOLE_ONLY", "Paper", "PaperLengths", "Particulars",
    "ReportTemplate", "Section", "given_with", "headed_paper", "keep_given", "keep_template",
    "load_paper", "paper_of", "plain_paper", "standard_template", "station_template",
    "surroundings", "template_in_use", "use_head",
]  # fmt: skip

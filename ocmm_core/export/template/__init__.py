"""Report sheet: template, data that no job contains, and their storage.

In: documents of a laboratory, settings, data given with a job. Out: one `Paper` for every route to
a report.

Read `_template` (order, head, signatures, and data to be entered) with `_paper_lengths` (unit) and
`_surroundings` (ambient readings).
`_papers` stores it for every route to a report, `_headed` adds the head from the settings.
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

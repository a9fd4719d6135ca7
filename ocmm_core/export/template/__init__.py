"""Report sheet: template, data that no job contains, and their storage.

In: documents of a laboratory, settings, data given with a job. Out: one `Paper` for every route to
a report.

Read `_template` (order, head, signatures, unit, and data to be entered). `_headed` stores it for
every route to a report, adds ambient readings, and the head from the settings.
It must not know a job: the data of a report are in `report`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.export.template._headed import (
        ambient_conditions, given_with, headed_paper, keep_given, keep_template, paper_of,
        station_template, template_in_use, use_head,
    )  # fmt: skip
    from ocmm_core.export.template._template import (
        RELATES_ONLY, SECTIONS, WHOLE_ONLY, Paper, PaperLengths, Particulars, ReportTemplate,
        Section, load_paper, plain_paper, standard_template,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "RELATES_ONLY", "SECTIONS", "WHOLE_ONLY", "Paper", "PaperLengths", "Particulars",
    "ReportTemplate", "Section", "ambient_conditions", "given_with", "headed_paper", "keep_given",
    "keep_template", "load_paper", "paper_of", "plain_paper", "standard_template",
    "station_template", "template_in_use", "use_head",
]  # fmt: skip

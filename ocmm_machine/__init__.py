"""Corrections of a machine tool from finished jobs: proven, confirmed, recorded, undoable.

In: finished jobs, and the document of a machine's offsets. Out: changes of work offsets, tool
lengths and radii beyond U and the dead band, as files for controls.

Read `_document` (offsets, their limits, and what acts on them; results of a job, and the signed
register), `_proposal` (deviations to changes, signs and handedness), `_dialects` (files for
controls) and `_writing` (preview, confirmed write, undo). `_command` is `ocmm correct`, an entry
point of `ocmm.commands`; nothing imports this package.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_machine._command import correct_app
    from ocmm_machine._dialects import CSV_COLUMNS, DIALECTS, correction_file
    from ocmm_machine._document import (
        ControlOffset, CorrectionDocument, CorrectionLine, Drive, MachineFrame, MeasuredValue,
        PartFacts, facts_of, load_corrections, read_parts, values_in_force,
    )  # fmt: skip
    from ocmm_machine._proposal import Effect, OffsetChange, Proposal, propose
    from ocmm_machine._writing import Machine
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "CSV_COLUMNS", "DIALECTS", "ControlOffset", "CorrectionDocument", "CorrectionLine", "Drive",
    "Effect", "Machine", "MachineFrame", "MeasuredValue", "OffsetChange", "PartFacts", "Proposal",
    "correct_app", "correction_file", "facts_of", "load_corrections", "propose", "read_parts",
    "values_in_force",
]  # fmt: skip

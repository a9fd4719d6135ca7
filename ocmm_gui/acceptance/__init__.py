"""Acceptance tests in the window: start, measurement, verdict, artefacts, studies.

In: `composition.AcceptanceBench`, guided tests of `acceptance`. Out: pages for Maintain, sheets,
and the running test with rail and keys of a wizard.

Start with `_desk` (choose or resume, then run), `_start_page`, `_measure_pages` with
`_touch_picture`; then `_tests_page` (the page of Maintain),
`_artefact_sheet`, `_study_sheet`.
Plans, limits and verdicts are those of the core. It must not import the inspector's screens.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.acceptance._artefact_sheet import ArtefactSheet
    from ocmm_gui.acceptance._desk import AcceptanceDesk
    from ocmm_gui.acceptance._study_sheet import StudySheet
    from ocmm_gui.acceptance._tests_page import TestsPage
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["AcceptanceDesk", "ArtefactSheet", "StudySheet", "TestsPage"]

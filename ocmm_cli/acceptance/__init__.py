"""``ocmm acceptance``, ``ocmm artefact`` and ``ocmm msa``: tests of the instrument.

In: procedures, artefacts, frames, jobs. Out: plans, sealed records, studies as tables.

Read `_acceptance` (tests) with `_run`, `_artefact` (the register) and `_msa` (studies from jobs).
Computations are in `acceptance` and `studies`.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cli.acceptance._acceptance import acceptance_app
    from ocmm_cli.acceptance._artefact import artefact_app
    from ocmm_cli.acceptance._msa import msa_app
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["acceptance_app", "artefact_app", "msa_app"]

"""``ocmm selftest reliability``: kills, power cuts, bad disks and clocks, hostile files, soak.

In: lanes, a seed, a number of trials or hours. Out: a table of losses, with confidence bounds.

Read `_reliability` (the command) and `_trials` (a trial, a finding, the state file), then the
lanes: `_kills` (also soak), `_lost_names`, `_faults` (also power cuts) with `_faulty_disk`,
`_writers`, `_clock`, `_hostile`. `_work` is the work under test, on the stores of `_writers`.
`_hostile` gives the files of `_hostile_jobs` and `_hostile_documents` to real commands
(`_hostile_runs`, which also forges them), and `_hostile_sides` makes files of every kind next to
trusted ones. It must not know the other commands; it starts them as a user does.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_bench.campaign._clock import serve_clock
    from ocmm_bench.campaign._faults import serve_faults
    from ocmm_bench.campaign._hostile import given, good_files, hostile_groups, usual_of
    from ocmm_bench.campaign._hostile_documents import (
        document_kinds, leaf_kinds, points_kinds, recording_kinds, table_kinds,
    )  # fmt: skip
    from ocmm_bench.campaign._hostile_jobs import damaged_kinds, job_kinds
    from ocmm_bench.campaign._hostile_runs import REFUSED, Forgery, forged
    from ocmm_bench.campaign._hostile_sides import MAKERS, Make
    from ocmm_bench.campaign._kills import measure_job
    from ocmm_bench.campaign._lost_names import lose_name, possible_losses
    from ocmm_bench.campaign._reliability import reliability, selftest_app
    from ocmm_bench.campaign._writers import other_station
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "MAKERS", "REFUSED", "Forgery", "Make", "damaged_kinds", "document_kinds", "forged", "given",
    "good_files", "hostile_groups", "job_kinds", "leaf_kinds", "lose_name", "measure_job",
    "other_station", "points_kinds", "possible_losses", "recording_kinds", "reliability",
    "selftest_app", "serve_clock", "serve_faults", "table_kinds", "usual_of",
]  # fmt: skip

"""Conformance test of a camera against its object description.

In: an exclusive line with one camera, and optionally a firmware file of its maker.
Out: a report with a verdict per rule, measured times, and a verdict on the camera.

Start with `_run` (order of the rules), `_findings` (results, report, its text and HTML).
`_bench` is the camera on its line, and a rule, with `_mail_line` (line, exchanges, mailboxes);
`_sdo_talk` can send malformed requests. Rules: `_rules_startup`, `_rules_objects`,
`_rules_process_data`, `_rules_errors` (also of the mailboxes), `_rules_services`.
`_object_page` writes docs/integrator/camera_objects.md and the ESI file.
`_run` is also the process with the rights of a bus process, `_command` is `ocmm camera conform`.
The rules must not import bring-up, supervision or the software camera.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_bench.conform._command import conform_camera
    from ocmm_bench.conform._findings import (
        CameraOutcome, ConformanceReport, RuleResult, RuleVerdict, TimingSheet, conformance_page,
        conformance_text,
    )  # fmt: skip
    from ocmm_bench.conform._mail_line import ConformLine, WireLine
    from ocmm_bench.conform._run import RULES, ConformConfig, ConformNews, conform, find_place
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "RULES", "CameraOutcome", "ConformConfig", "ConformLine", "ConformNews", "ConformanceReport",
    "RuleResult", "RuleVerdict", "TimingSheet", "WireLine", "conform", "conform_camera",
    "conformance_page", "conformance_text", "find_place",
]  # fmt: skip

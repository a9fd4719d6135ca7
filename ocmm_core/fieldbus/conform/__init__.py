"""Is a camera what the page about its objects describes? Driven through every rule, and reported.

In: a line with one camera that nobody else uses, and a firmware file of its maker. Out: a report
with a verdict a rule, the times that were measured, and one verdict over the camera.

Read `_run` (the order of the rules) with `_rule`, `_findings` (what a rule finds, the report) and
`_page` (text and HTML). `_bench` is the camera on its `_line`, with `_exchanges` and `_mail_line`;
`_sdo_talk` asks for objects with every freedom to ask wrongly. The rules are `_rules_eeprom`,
`_rules_states`, `_rules_objects`, `_rules_mailbox`, `_rules_frames`, `_rules_clock`,
`_rules_errors`, `_rules_services` and `_rules_firmware`.
It must not know bring-up or supervision, nor the software camera.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.fieldbus.conform._findings import (
        ConformanceReport,
        Outcome,
        RuleResult,
        TimingSheet,
        Verdict,
    )
    from ocmm_core.fieldbus.conform._line import ConformLine, WireLine
    from ocmm_core.fieldbus.conform._page import conformance_page, conformance_text
    from ocmm_core.fieldbus.conform._run import RULES, conform, find_place
else:
    __getattr__ = door(
        __name__,
        _findings="ConformanceReport Outcome RuleResult TimingSheet Verdict",
        _line="ConformLine WireLine",
        _page="conformance_page conformance_text",
        _run="RULES conform find_place",
    )

__all__ = [
    "RULES",
    "ConformLine",
    "ConformanceReport",
    "Outcome",
    "RuleResult",
    "TimingSheet",
    "Verdict",
    "WireLine",
    "conform",
    "conformance_page",
    "conformance_text",
    "find_place",
]

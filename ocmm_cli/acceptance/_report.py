from __future__ import annotations

from rich.console import Console

from ocmm_cli.terminal import heads, lead, print_grid, say, say_word
from ocmm_core.acceptance import AcceptanceRecord
from ocmm_core.fieldbus.described import UNPROVEN_CAMERAS

_STYLES = {"PASS": "green", "FAIL": "red"}


def print_record(console: Console, record: AcceptanceRecord) -> None:
    if record.instrument.simulated:
        console.print(say("SIMULATED: measured on the virtual rig"), style="yellow")
    for why in record.instrument.unproven:
        console.print(f"{say_word(UNPROVEN_CAMERAS)}: {say(why)}", style="yellow", highlight=False)
    rule = (
        say("U taken off the limit")
        if record.procedure.rule == "guarded"
        else say("simple acceptance")
    )
    console.print(
        f"{record.procedure.id}, {say(record.wording)}; {say('decision rule')}: {rule}",
        highlight=False,
    )
    rows = []
    for one in record.quantities:
        value = record.values[one.worst]
        rows.append((
            one.quantity, str(one.count), f"{1e3 * one.error_mm:+.1f}",
            f"{1e3 * one.expanded_mm:.1f}", f"{1e3 * one.limit_mm:.1f}",
            f"{say(value.position)}, {say_word(value.name)}", say_word(one.verdict.value),
        ))  # fmt: skip
    columns = heads("Quantity", "N", "Worst, µm", "U (k = 2), µm", "MPE, µm", "At", "Verdict")
    print_grid(console, columns, rows)
    if record.retests:
        count = sum(one.superseded for one in record.values)
        console.print(
            say(
                f"Retests  {record.retests}; {count} value{'' if count == 1 else 's'} superseded, "
                "kept in the record"
            )
        )
    for refusal in record.refusals:
        console.print(f"{lead('Refused  ')}{say(refusal.reason)}", highlight=False)
    for reason in record.void_reasons:
        console.print(f"{lead('Void     ')}{say(reason)}", highlight=False)
    style = _STYLES.get(record.verdict.name, "yellow")
    console.print(
        f"{lead('Verdict  ')}{say_word(record.verdict.value)}", style=style, highlight=False
    )

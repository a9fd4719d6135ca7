from __future__ import annotations

from rich.console import Console
from rich.table import Table

from ocmm_cli.terminal import heads, say, say_word
from ocmm_shop.studies import CharacteristicStudy, StudyReport


def print_study(console: Console, report: StudyReport) -> None:
    plan = report.plan
    if report.simulated:
        console.print(say("SIMULATED: measured on the virtual rig"), style="yellow")
    console.print(
        say(
            f"{plan.name}: {len(plan.parts)} parts, {len(plan.operators)} operators, {plan.trials} "
            f"trials; {report.measured} of {len(plan.runs)} measured"
        ),
        highlight=False,
    )
    table = Table(
        *heads(
            "Characteristic", "GRR, µm (90 %)", "EV", "AV", "PV", "% study", "% tol.", "ndc",
            "Q_MS, %", "Q_MP, %", "Word",
        )
    )  # fmt: skip
    for one in report.characteristics:
        table.add_row(*_row(one))
    console.print(table)
    for one in report.characteristics:
        if one.why_not:
            console.print(f"{one.name}: {say(one.why_not)}", highlight=False)
        if one.stated is not None and one.stated.message:
            console.print(f"{one.name}: {say(one.stated.message)}", highlight=False)
    for sentence in report.left_out:
        console.print(f"{say_word('left out')}: {say(sentence)}", style="yellow", highlight=False)
    console.print(
        say("Standard deviations in µm. Q by the study, in brackets by the stated uncertainty."),
        style="dim",
    )


def _row(one: CharacteristicStudy) -> tuple[str, ...]:
    study = one.study
    if study is None:
        return (one.name, *["–"] * 10)
    um = [f"{1e3 * value:.2f}" for value in (study.ev, study.av, study.pv)]
    tolerance = "–" if study.tolerance_percent is None else f"{study.tolerance_percent:.1f}"
    q_ms = q_mp = "–"
    if one.from_study is not None and one.from_budget is not None:
        q_ms = f"{one.from_study.q_ms:.1f} ({one.from_budget.q_ms:.1f})"
        q_mp = f"{one.from_study.q_mp:.1f} ({one.from_budget.q_mp:.1f})"
    interval = f"{1e3 * study.grr:.2f} ({1e3 * study.grr_low:.2f}–{1e3 * study.grr_high:.2f})"
    return (
        one.name, interval, *um, f"{study.study_percent:.1f}", tolerance, str(study.ndc), q_ms,
        q_mp, study.word,
    )  # fmt: skip

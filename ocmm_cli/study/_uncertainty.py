"""``ocmm uncertainty``: uncertainty budget of a job, and Monte Carlo for comparison."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.progress import Progress

from ocmm_cli.options import ComputingSite
from ocmm_cli.terminal import PlainConsole, heads, make_console, print_grid, tr, tr_word
from ocmm_core.errors import InputError

if TYPE_CHECKING:
    from ocmm_core.inspection.evaluation import JobUncertainty
    from ocmm_core.tolerances.decisions import CharacteristicResult
    from ocmm_core.tolerances.monte_carlo import MonteCarloOptions, MonteCarloReport, Task
    from ocmm_core.tolerances.uncertainty import Budget


_BAR = 20


def uncertainty_command(
    *, job: Path, only: str, monte_carlo: bool, trials: int, digits: int, seed: int,
    site: ComputingSite,
) -> None:  # fmt: skip
    """Show the uncertainty budget of every result of a job.

    The job is opened read-only and recomputed from its points. Ctrl+C cancels a simulation.
    """
    from ocmm_cli.measure import print_states
    from ocmm_core.inspection.evaluation import job_uncertainty
    from ocmm_core.inspection.finished import reopen_job
    from ocmm_core.tolerances.monte_carlo import MonteCarloOptions

    console = make_console()
    opened = reopen_job(job)
    print_states(console, opened.view)
    found = job_uncertainty(
        opened.plan, opened.points, opened.sensitivities, opened.rig, opened.body, opened.options
    )
    names = [item.name for item in opened.plan.characteristics]
    if only and only not in names:
        raise InputError(
            "uncertainty.name",
            f"{job} has no characteristic named {only!r}.",
            f"Give one of: {', '.join(names)}.",
        )
    asked = [only] if only else names
    results = {item.name: item for item in opened.view.characteristics}
    for name in asked:
        _print_budget(console, name, found, results.get(name))
    if monte_carlo:
        options = MonteCarloOptions(max_trials=trials, digits=digits, seed=seed)
        for task in found.tasks:
            wanted = task.only(tuple(item for item in task.characteristics if item.name in asked))
            if wanted.characteristics:
                _print_simulation(console, _simulated(console, wanted, options, site))


def _print_budget(
    console: PlainConsole, name: str, found: JobUncertainty, result: CharacteristicResult | None
) -> None:
    from ocmm_core.tolerances.decisions import U_LABEL, rule_words

    budget = found.budgets.get(name)
    if budget is None:
        console.print(f"{name}: {tr('no budget.')} {tr(found.missing.get(name, ''))}")
        return
    _print_sources(console, budget)
    degrees = ""
    if budget.degrees <= 1e6:
        degrees = ", " + tr(f"{budget.degrees:.0f} degrees of freedom")
    wider = (
        " " + tr("(more than 2 u: noise biases such a value upward)")
        if budget.expanded > 2.0001 * budget.standard
        else ""
    )
    console.print(
        f"u = {budget.standard:.5f} {budget.unit}{degrees}; "
        f"{U_LABEL} = {budget.expanded:.5f} {budget.unit}{wider}"
    )
    if result is not None and result.rule:
        said = f"{tr_word(result.verdict.value)} ({tr(rule_words(result.rule))})"
        if result.tur is not None:
            said += f"; TUR {result.tur:.1f}"
        if result.leaning:
            said += "; " + f"{tr_word('leaning')} {tr_word(result.leaning)}"
        console.print(f"{said}. {tr(result.caution)}".strip())


def _print_sources(console: PlainConsole, budget: Budget) -> None:
    rows = [
        (
            tr(row.name), f"{row.standard:.5f}", f"{100.0 * row.share:.1f} %",
            "█" * round(_BAR * row.share), f"{row.kind}, {tr_word(row.distribution)}",
            tr(row.origin),
        )
        for row in budget.rows
    ]  # fmt: skip
    source, share, kind, origin = heads("Source", "Share", "Type", "From")
    columns = (source, f"u, {budget.unit}", share, "", kind, origin)
    title = f"{budget.characteristic} = {budget.value:.5f} {budget.unit}"
    print_grid(console, columns, rows, title, spare=[[""]])


def _simulated(
    console: PlainConsole, task: Task, options: MonteCarloOptions, site: ComputingSite
) -> MonteCarloReport:
    from ocmm_core.tolerances.monte_carlo import simulate, simulate_elsewhere

    with Progress(console=console, transient=True) as progress:
        bar = progress.add_task(tr("Monte Carlo"), total=1.0)

        def tell(what: str, share: float) -> None:
            progress.update(bar, completed=share)

        if site.scheduler or site.workers is not None:
            return simulate(task, options, tell, site=site)
        return simulate_elsewhere(task, options, tell)


def _print_simulation(console: PlainConsole, report: MonteCarloReport) -> None:
    rows = []
    for item in report.values:
        verdict = tr("valid") if item.validated else tr("differs")
        rows.append((
            item.name, f"{item.trials}", f"{item.mean:.5f}", f"{item.sigma:.5f}",
            f"{item.symmetric[0]:.5f} – {item.symmetric[1]:.5f}",
            f"{item.shortest[0]:.5f} – {item.shortest[1]:.5f}",
            f"{item.off_low:.5f}", f"{item.off_high:.5f}", f"{item.tolerance:.5f}",
            verdict if item.settled else tr(f"{verdict}, more trials needed"),
        ))  # fmt: skip
    columns = heads(
        "Characteristic", "Trials", "Mean", "u", "Interval", "Shortest", "d low", "d high",
        "Tolerance", "Linear propagation",
    )  # fmt: skip
    print_grid(console, columns, rows, tr_word("Monte Carlo (JCGM 101)"))
    console.show(
        f"Intervals hold 95.45 %; {report.seconds:.1f} s; seed {report.seed}; "
        f"{report.failed} trials without a fit.",
        style="dim",
        highlight=True,
    )

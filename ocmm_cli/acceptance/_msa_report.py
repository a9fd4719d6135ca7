"""Studies on the terminal; linearity with its chart, and the chart as SVG."""

from __future__ import annotations

import numpy as np

from ocmm_cli.terminal import PlainConsole, heads, label, nice_limit, page, print_grid, tr, tr_word
from ocmm_core.geometry import Float
from ocmm_shop.studies import CharacteristicStudy, LinearityReport, StudyReport


def print_study(console: PlainConsole, report: StudyReport) -> None:
    plan = report.plan
    if report.simulated:
        console.show("SIMULATED: measured on the virtual rig", style="yellow")
    console.show(
        f"{plan.name}: {len(plan.parts)} parts, {len(plan.operators)} operators, {plan.trials} "
        f"trials; {report.measured} of {len(plan.runs)} measured"
    )
    columns = heads(
        "Characteristic", "GRR, µm (90 %)", "EV", "AV", "PV", "% study", "% tol.", "ndc",
        "Q_MS, %", "Q_MP, %", "Word",
    )  # fmt: skip
    print_grid(console, columns, map(_row, report.characteristics))
    for one in report.characteristics:
        if one.why_not:
            console.print(f"{one.name}: {tr(one.why_not)}")
        if one.stated is not None and one.stated.message:
            console.print(f"{one.name}: {tr(one.stated.message)}")
    for sentence in report.left_out:
        console.print(f"{tr_word('left out')}: {tr(sentence)}", style="yellow")
    console.show(
        "Standard deviations in µm. Q by the study, in brackets by the stated uncertainty.",
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


_COLUMNS = 61
_LEFT, _RIGHT, _TOP, _BOTTOM = 80.0, 740.0, 70.0, 400.0


def print_linearity(console: PlainConsole, found: LinearityReport) -> None:
    study = found.study
    console.print(f"{tr_word('Linearity')}: {found.name}")
    rows = []
    lines = found.line(study.references)
    for part, value, bias, line, band in zip(
        found.parts, study.references, found.biases, lines, study.bands, strict=True
    ):
        inside = tr_word("yes") if abs(line) <= band else tr_word("NO")
        rows.append((
            part, f"{value:.4f}", str(len(bias)), f"{1e3 * bias.mean():+.2f}",
            f"{1e3 * line:+.2f}", f"{1e3 * band:.2f}", inside,
        ))  # fmt: skip
    columns = heads(
        "Part", "Reference, mm", "N", "Bias, µm", "Line, µm", "± band, µm", "Zero inside"
    )
    print_grid(console, columns, rows)
    for row in text_chart(found):
        console.print_line(row)
    console.show(
        f"Bias = {1e3 * study.intercept:+.3f} µm {1e3 * study.slope:+.5f} µm/mm × reference; "
        f"p {study.p_intercept:.3g} and {study.p_slope:.3g}; s {1e3 * study.sigma:.2f} µm"
    )
    for sentence in found.left_out:
        console.print(f"{tr_word('left out')}: {tr(sentence)}", style="yellow")
    console.print(f"{tr_word(found.word)}: {tr(found.reason)}")


def text_chart(found: LinearityReport) -> list[str]:
    """Return the chart in characters: a row per reference, the bias to the right.

    ``-`` is the 95 % band of the line, ``o`` the line, ``x`` the mean bias, ``|`` zero.
    """
    study, lines = found.study, found.line(found.study.references)
    most = max(float(np.max(np.abs(lines) + study.bands)), float(np.max(np.abs(study.biases))))
    most = nice_limit(1e3 * most)

    def column(bias: float) -> int:
        return round(0.5 * (_COLUMNS - 1) * (1.0 + 1e3 * bias / most))

    head = f"{'mm':>11}  {-most:<+10.4g}{'bias, µm':^{_COLUMNS - 20}}{most:>+10.4g}"
    rows = [head]
    for value, mean, line, band in zip(
        study.references, study.biases, lines, study.bands, strict=True
    ):
        row = [" "] * _COLUMNS
        for place in range(column(line - band), column(line + band) + 1):
            row[place] = "-"
        row[_COLUMNS // 2] = "|"
        row[column(float(line))] = "o"
        row[column(float(mean))] = "x"
        rows.append(f"{value:11.4f}  {''.join(row).rstrip()}")
    rows.append(tr("             - 95 % band of the line, o line, x mean bias, | zero"))
    return rows


def linearity_chart(found: LinearityReport, *, simulated: bool = False) -> str:
    """Return the chart as SVG, itself marked if SIMULATED: biases, the line, its band, zero."""
    study = found.study
    low, high = float(study.references.min()), float(study.references.max())
    at = np.linspace(low, high, 61)
    band = _band(found, at)
    line = found.line(at)
    largest = max(
        float(np.max(np.abs(line) + band)), *(float(np.max(np.abs(one))) for one in found.biases)
    )
    most = nice_limit(1e3 * largest)

    def x_of(value: float) -> float:
        return _LEFT + (value - low) / (high - low) * (_RIGHT - _LEFT)

    def y_of(bias: float) -> float:
        return 0.5 * (_TOP + _BOTTOM) - 0.5 * (_BOTTOM - _TOP) * 1e3 * bias / most

    def path(values: Float) -> str:
        return " ".join(f"{x_of(a):.1f},{y_of(b):.1f}" for a, b in zip(at, values, strict=True))

    back = " ".join(
        f"{x_of(a):.1f},{y_of(b):.1f}" for a, b in zip(at[::-1], (line - band)[::-1], strict=True)
    )
    parts = [f'<polygon points="{path(line + band)} {back}" fill="#2a78d6" fill-opacity="0.18"/>']
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        y = y_of(1e-3 * share * most)
        colour = "#333" if share == 0.0 else "#ccc"
        parts.append(f'<path d="M{_LEFT} {y:.1f}H{_RIGHT}" stroke="{colour}"/>')
        parts.append(label(_LEFT - 8.0, y + 4.0, f"{share * most:+g}" if share else "0", 13, "end"))
    parts.append(f'<polyline points="{path(line)}" stroke="#2a78d6" stroke-width="2"/>')
    for value, biases in zip(study.references, found.biases, strict=True):
        x = x_of(float(value))
        parts += [
            f'<circle cx="{x:.1f}" cy="{y_of(float(one)):.1f}" r="2.5" fill="#4a6572"/>'
            for one in biases
        ]
        y = y_of(float(biases.mean()))
        parts.append(
            f'<rect x="{x - 5.0:.1f}" y="{y - 5.0:.1f}" width="10" height="10" fill="#d4552a"/>'
        )
        parts.append(label(x, _BOTTOM + 20.0, f"{value:.2f}", 12, "middle"))
    parts.append(label(0.5 * (_LEFT + _RIGHT), _BOTTOM + 44.0, "reference, mm", 14, "middle"))
    parts.append(label(_LEFT - 8.0, _TOP - 14.0, "bias, µm", 14, "end"))
    parts.append(
        label(_LEFT, _BOTTOM + 66.0,
                    "Dots: results. Squares: means. Line with its 95 % band.", 12, "start")
    )  # fmt: skip
    state = "SIMULATED: " if simulated else ""
    return page(f"{state}Linearity of {found.name}: {found.word}", found.reason, parts)


def _band(found: LinearityReport, at: Float) -> Float:
    """Return the band's half width at references (n,): its square is a parabola through three."""
    study = found.study
    fit = np.polynomial.Polynomial.fit(study.references, study.bands**2, 2)
    band: Float = np.sqrt(np.maximum(fit(at), 0.0))
    return band

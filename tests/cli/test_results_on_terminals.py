"""The table of results at any width of the terminal: numbers and verdicts are whole."""

from __future__ import annotations

import io
from dataclasses import replace

import pytest

from ocmm_cli.measure import print_table
from ocmm_cli.terminal import PlainConsole, _console, tr_word
from ocmm_core.wording import load_translation
from tests.generated_jobs import generated_job
from tests.host import amount

WIDTHS = (*range(40, 120, amount(11, 1)), 118, 119, 160, 300)


def printed(seed: int, width: int, *, is_terminal: bool, long_names: bool) -> tuple[str, list[str]]:
    job, _ = generated_job(seed)
    results = [
        replace(one, name=f"{one.name} {'distance of bores ' * 3}"[:60] if long_names else one.name)
        for one in job.characteristics
    ]
    truth = {one.name: one.nominal for one in results} if seed % 2 else None
    stream = io.StringIO()
    console = PlainConsole(file=stream, width=width, force_terminal=is_terminal, no_color=True)
    print_table(console, replace(job, characteristics=tuple(results)), truth)
    verdicts = [tr_word(one.verdict.value) for one in results]
    measured = [f"{one.measured:z.4f}" for one in results if one.measured is not None]
    return stream.getvalue(), [*verdicts, *measured]


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("is_terminal", [True, False])
def test_shortens_no_number_and_no_verdict(
    monkeypatch: pytest.MonkeyPatch, language: str, is_terminal: bool
) -> None:
    if language != "en":
        monkeypatch.setattr(_console, "_translation", lambda: load_translation(language))
    for width in WIDTHS:
        for seed in range(4):
            text, wanted = printed(seed, width, is_terminal=is_terminal, long_names=seed > 1)
            assert "…" not in text, (width, seed)
            assert all(text.count(word) >= wanted.count(word) for word in wanted), (width, seed)


def test_a_pipe_gets_all_columns() -> None:
    text, _ = printed(1, 118, is_terminal=False, long_names=True)
    assert all(tr_word(name) in text for name in ("Nominal", "Lower", "Upper", "True", "Error"))

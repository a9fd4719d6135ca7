"""Answers of an archive on the terminal."""

from __future__ import annotations

from rich.text import Text

from ocmm_cli.terminal import PlainConsole, print_grid, say_word
from ocmm_core.tolerances.decisions import PartWord, Verdict
from ocmm_shop.archive.questions import ArchiveAnswer
from ocmm_shop.archive.records import shown_text

_STYLES = {
    PartWord.CONFORMS.value: "green",
    Verdict.CONFORM.value: "green",
    PartWord.DOES_NOT_CONFORM.value: "bold red",
    Verdict.NOT_CONFORM.value: "bold red",
    Verdict.NOT_PROVEN.value: "yellow",
    PartWord.NOT_PROVEN.value: "yellow",
    PartWord.NOT_COMPLETE.value: "yellow",
}


def print_answer(console: PlainConsole, answer: ArchiveAnswer) -> None:
    rows = [[_cell(cell) for cell in row] for row in answer.rows]
    print_grid(console, answer.columns, rows, answer.title)
    for note in answer.notes:
        console.say(shown_text(note), style="yellow")
    for trend in answer.trends:
        if trend.chart is not None:
            counted = [part for part in trend.parts if part.value is not None]
            for index, why in trend.chart.signals[-8:]:
                console.print(f"{counted[index].job}: {say_word(why.rule)}, {say_word(why.value)}.")
    if answer.study is not None:
        console.say(f"Gauge R&R: {answer.study.word}.")


def _cell(cell: object) -> Text:
    # Names come from anywhere: print them as text, never as markup.
    if cell is None:
        return Text("–")
    if isinstance(cell, float):
        return Text(f"{cell:.4f}")
    return Text(shown_text(str(cell)), _STYLES.get(str(cell), ""))

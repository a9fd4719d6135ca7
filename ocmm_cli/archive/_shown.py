"""Answers of an archive on the terminal."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ocmm_cli.terminal import say, say_word
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


def print_answer(console: Console, answer: ArchiveAnswer) -> None:
    table = Table(title=Text(answer.title), title_justify="left", box=box.SIMPLE_HEAD)
    for number, name in enumerate(answer.columns):
        numbers = any(isinstance(row[number], int | float) for row in answer.rows)
        table.add_column(name, justify="right" if numbers else "left")
    for row in answer.rows:
        table.add_row(*(_cell(cell) for cell in row))
    console.print(table)
    for note in answer.notes:
        console.print(say(shown_text(note)), style="yellow", highlight=False, markup=False)
    for trend in answer.trends:
        if trend.chart is not None:
            counted = [part for part in trend.parts if part.value is not None]
            for index, why in trend.chart.signals[-8:]:
                console.print(
                    f"{counted[index].job}: {say_word(why.rule)}, {say_word(why.value)}.",
                    highlight=False,
                    markup=False,
                )
    if answer.study is not None:
        console.print(say(f"Gauge R&R: {answer.study.word}."), highlight=False, markup=False)


def _cell(cell: object) -> Text:
    # Names come from anywhere: print them as text, never as markup.
    if cell is None:
        return Text("–")
    if isinstance(cell, float):
        return Text(f"{cell:.4f}")
    return Text(shown_text(str(cell)), _STYLES.get(str(cell), ""))

"""Tables of all commands, for any width: numbers and verdicts are never shortened or wrapped."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from rich import box
from rich.cells import cell_len
from rich.table import Table
from rich.text import Text

from ocmm_cli.terminal._console import PlainConsole, shown

_WHOLE = 24
"""A cell up to this width that holds a digit is a value: it stays on one line."""
_LEAST = 14
"""Width down to which the words of a name are kept whole."""
_NUMBER = re.compile(r"[-+−±<>≤≥~ ]*[\d–-][^A-Za-z]*([^\d\s]{0,4})?$")


def print_grid(
    console: PlainConsole,
    heads: Sequence[str],
    rows: Iterable[Sequence[str | Text]],
    title: str = "",
    spare: Sequence[Sequence[str]] = (),
) -> None:
    """Print rows below ``heads``; a console that is too narrow gets a block of lines each row.

    ``spare``: groups of heads left out, one after the other, before the table becomes blocks.
    """
    cells = [[_text(cell) for cell in row] for row in rows]
    for count in range(len(spare) + 1):
        left_out = {head for group in spare[:count] for head in group}
        kept = [place for place, head in enumerate(heads) if head not in left_out]
        chosen = [[row[place] for place in kept] for row in cells]
        widths = _widths([heads[place] for place in kept], chosen, console.width)
        if widths is not None:
            break
    else:
        _print_blocks(console, heads, cells, title)
        return
    bare = not any(heads)
    table = Table(
        title=Text(shown(title)) if title else None, title_justify="left",
        box=None if bare else box.SIMPLE_HEAD, show_header=not bare, pad_edge=not bare,
        padding=(0, 3, 0, 0) if bare else (0, 1),
    )  # fmt: skip
    for at, (place, width) in enumerate(zip(kept, widths, strict=True)):
        right = at > 0 and _is_numeric(row[at] for row in chosen)
        table.add_column(
            Text(shown(heads[place])), width=width, justify="right" if right else "left",
            overflow="fold",
        )  # fmt: skip
    for row in chosen:
        table.add_row(*row)
    console.print(table, soft_wrap=False, crop=False)
    if left_out:
        hidden = ", ".join(head for head in heads if head in left_out)
        console.say(f"A wider terminal also shows {hidden}.", style="dim")


def _text(cell: str | Text) -> Text:
    return cell if isinstance(cell, Text) else Text(shown(cell))


def _is_numeric(column: Iterable[Text]) -> bool:
    texts = [cell.plain for cell in column if cell.plain.strip("–- ")]
    return bool(texts) and all(_NUMBER.match(text) for text in texts)


def _is_whole(text: str) -> bool:
    """Return whether a line of a cell is a number with its unit, or a verdict."""
    return text.isupper() or (len(text) <= _WHOLE and any(map(str.isdigit, text)))


def _least(text: str, *, named: bool) -> int:
    """Return the width below which a number or verdict of a line of a cell would be cut."""
    if _NUMBER.match(text) or (_is_whole(text) and not named):
        return cell_len(text)
    words = text.split()
    return max(
        (cell_len(word) if _is_whole(word) and cell_len(word) <= _WHOLE
         else min(cell_len(word), _LEAST) for word in words),
        default=0,
    )  # fmt: skip


def _widths(heads: Sequence[str], rows: list[list[Text]], width: int) -> list[int] | None:
    """Return the width of each column, None if values would be cut."""
    least, most = [], []
    for place, head in enumerate(heads):
        lines = [line for row in rows for line in row[place].plain.split("\n")]
        words = max(map(cell_len, head.split()), default=1)
        least.append(max(words, *(_least(line, named=place == 0) for line in lines), 1))
        most.append(max(least[-1], cell_len(head), *map(cell_len, lines)))
    # A margin on both sides, and three columns between two others.
    left = width - sum(least) - 3 * len(heads) - 1
    if left < 0:
        return None
    while left > 0:
        short = [place for place in range(len(heads)) if least[place] < most[place]]
        if not short:
            break
        least[min(short, key=least.__getitem__)] += 1
        left -= 1
    return least


def _print_blocks(
    console: PlainConsole, heads: Sequence[str], rows: list[list[Text]], title: str
) -> None:
    """Print the first cell of each row, and below it a line for each other cell."""
    if title:
        console.print(title, style="italic")
    label = max(map(cell_len, heads[1:]), default=0) + 4
    for first, *others in rows:
        name = first.plain
        if _NUMBER.match(name) and heads[0]:
            first = Text(f"{shown(heads[0])} ") + first
        if name:
            console.print(first)
        for head, cell in zip(heads[1:], others, strict=True):
            if not cell.plain:
                continue
            said = Text(f"  {shown(head)}")
            if "\n" not in cell.plain and label + cell_len(cell.plain) <= console.width:
                said.pad_right(label - cell_len(said.plain))
                console.print(said + cell)
                continue
            if head:
                console.print(said)
            for line in cell.wrap(console, console.width - 4, overflow="fold"):
                console.print(Text("    ") + line)

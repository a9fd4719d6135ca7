"""Account of a model's tolerances on the terminal, as a table or as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import msgspec

from ocmm_cli.terminal import say, say_word

if TYPE_CHECKING:
    from rich.console import Console

    from ocmm_cad.drawing import Account
    from ocmm_core.tolerances.decisions import RequirementCount


def print_account(account: Account, console: Console) -> None:
    """Print the outcome of every item of a model, and counts by kind.

    Datum references and labels follow their item; both are counted, and separate in the JSON.
    """
    from rich.table import Table
    from rich.text import Text

    if not account.items:
        for remark in account.remarks:
            console.print(say(remark), highlight=False)
        return
    console.print(say("Tolerances of the model:"), highlight=False)
    table = Table(
        "",
        say_word("label"),
        say_word("says"),
        say_word("in the plan, or why not"),
        box=None,
        pad_edge=False,
    )
    for item in account.by_itself():
        became = ", ".join(item.became)
        said = "; ".join(filter(None, (became, say(item.why), say(item.remark))))
        table.add_row(*(Text(text) for text in (say(item.status), item.name, item.kind, said)))
    console.print(table, highlight=False)
    for group, counts in account.counts().items():
        told = ", ".join(f"{count} {say(word)}" for word, count in counts.items() if count)
        console.print(f"{say(group)}: {sum(counts.values())} ({told})", highlight=False)
    for remark in account.remarks:
        console.print(say(remark), highlight=False, markup=False)


def print_requirements(count: RequirementCount | None, console: Console) -> None:
    """Print the number of requirements of its sources a plan contains; nothing without a source."""
    if count is not None:
        style = "" if count.is_whole else "bold yellow"
        console.print(say(count.words), style=style, highlight=False)


def account_json(account: Account, more: dict[str, Any]) -> str:
    """Return the account as JSON: counts by group, remarks and all items."""
    content = {
        **more,
        "complete": account.is_complete,
        "counts": account.counts(),
        "remarks": account.remarks,
        "items": account.items,
    }
    return msgspec.json.format(msgspec.json.encode(content), indent=2).decode()

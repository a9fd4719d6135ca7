"""The account of what a model says of tolerances: nothing of it is dropped in silence."""

from __future__ import annotations

from collections import Counter
from typing import Literal

import msgspec

Group = Literal[
    "dimension", "tolerance", "datum reference", "datum", "datum target", "annotation", "general"
]
NOT_IMPORTED = "the tolerances of the model were not imported"
"""Reason of every requirement of a model whose features alone were imported."""

GROUPS: tuple[Group, ...] = (
    "dimension", "tolerance", "datum reference", "datum", "datum target", "annotation", "general",
)  # fmt: skip
NOTE = "note"
"""Kind of an annotation that is a text and not the label of an item."""
Status = Literal["taken", "partly", "refused"]


class RefusedError(ValueError):
    """Why an item becomes nothing of the plan, as a part of a sentence."""


class AccountItem(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One item of a model and what became of it."""

    group: Group
    name: str
    kind: str
    """`group`, `name`, `kind`: What it is, its label in the model, and what it says."""
    entity: int
    status: Status
    """``taken``, ``partly`` (for some of its surfaces), or ``refused``."""
    became: tuple[str, ...] = ()
    """Names of what it is in the plan: characteristics, datums, the alignment."""
    why: str = ""
    """Why it, or a part of it, was refused; part of a sentence."""
    remark: str = ""
    """What holds with it although it was taken; part of a sentence."""


class Account(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All items of a model, in the order of the file within their groups."""

    items: tuple[AccountItem, ...] = ()
    remarks: tuple[str, ...] = ()
    """Sentences about all of it: the standard, the alignment."""

    def of(self, *groups: Group) -> tuple[AccountItem, ...]:
        """Return the items of some groups."""
        return tuple(item for item in self.items if item.group in groups)

    def counts(self) -> dict[Group, dict[Status, int]]:
        """Return how many items of each group were taken, partly taken and refused."""
        found = Counter((item.group, item.status) for item in self.items)
        words: tuple[Status, ...] = ("taken", "partly", "refused")
        return {
            group: {word: found[group, word] for word in words}
            for group in GROUPS
            if any(found[group, word] for word in words)
        }

    def by_itself(self) -> tuple[AccountItem, ...]:
        """Return the items without those that follow another one.

        A datum reference follows its tolerance, and a label the item that it shows.
        """
        return tuple(
            item
            for item in self.items
            if item.group != "datum reference" and (item.group != "annotation" or item.kind == NOTE)
        )

    @property
    def taken(self) -> int:
        """Return how many items were taken as a whole."""
        return sum(item.status == "taken" for item in self.items)

    @property
    def is_complete(self) -> bool:
        """Return whether all items were taken as a whole."""
        return self.taken == len(self.items)

"""Account of a model's tolerances: no item is dropped silently."""

from __future__ import annotations

from collections import Counter
from typing import Literal

import msgspec

Group = Literal[
    "dimension", "tolerance", "datum reference", "datum", "datum target", "annotation", "general"
]
NOT_IMPORTED = "the tolerances of the model were not imported"
"""Reason of every requirement of a model if only its features were imported."""

GROUPS: tuple[Group, ...] = (
    "dimension", "tolerance", "datum reference", "datum", "datum target", "annotation", "general",
)  # fmt: skip
NOTE = "note"
"""Kind of an annotation that is a text and not the label of an item."""
Status = Literal["taken", "partly", "refused"]


class RefusedError(ValueError):
    """Why an item is not imported, as a part of a sentence."""


class AccountItem(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One item of a model and its result."""

    group: Group
    name: str
    kind: str
    """`group`, `name`, `kind`: Type, label in the model, and content."""
    entity: int
    status: Status
    """``taken``, ``partly`` (for some of its surfaces), or ``refused``."""
    became: tuple[str, ...] = ()
    """Names of its characteristics, datums or alignment in the plan."""
    why: str = ""
    """Why it, or a part of it, was refused; part of a sentence."""
    remark: str = ""
    """Remark on an imported item; part of a sentence."""


class Account(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All items of a model, in the order of the file within their groups."""

    items: tuple[AccountItem, ...] = ()
    remarks: tuple[str, ...] = ()
    """General sentences: the standard, the alignment."""

    def of(self, *groups: Group) -> tuple[AccountItem, ...]:
        return tuple(item for item in self.items if item.group in groups)

    def counts(self) -> dict[Group, dict[Status, int]]:
        found = Counter((item.group, item.status) for item in self.items)
        words: tuple[Status, ...] = ("taken", "partly", "refused")
        return {
            group: {word: found[group, word] for word in words}
            for group in GROUPS
            if any(found[group, word] for word in words)
        }

    def by_itself(self) -> tuple[AccountItem, ...]:
        """Return the items without datum references of tolerances and labels of items."""
        return tuple(
            item
            for item in self.items
            if item.group != "datum reference" and (item.group != "annotation" or item.kind == NOTE)
        )

    @property
    def taken(self) -> int:
        return sum(item.status == "taken" for item in self.items)

    @property
    def is_complete(self) -> bool:
        return self.taken == len(self.items)

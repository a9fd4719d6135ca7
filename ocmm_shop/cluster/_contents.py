"""Bytes needed by the open tasks, and their cache on the workers."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from distributed import Client, Future

from ocmm_shop.cluster._worker import held

_IDLE = 8
"""Contents kept on the workers although no open task needs them."""
_SMALL = 1024
"""Smaller contents are sent with every task."""
_SEEN = 4096
"""Number of remembered hashes."""


@dataclass(slots=True)
class TaskContents:
    """Contents of the tasks of one call, by their SHA-256."""

    kept: dict[str, Future] = field(default_factory=dict)
    seen: dict[str, None] = field(default_factory=dict)
    users: Counter[str] = field(default_factory=Counter)

    def hand(
        self, client: Client, contents: Sequence[bytes]
    ) -> tuple[tuple[str, ...], list[bytes | Future]]:
        """Return the hashes of a thing's contents, and what its task gets for each."""
        hashes = tuple(hashlib.sha256(one).hexdigest() for one in contents)
        return hashes, [
            self._handed(client, sha256, content)
            for sha256, content in zip(hashes, contents, strict=True)
        ]

    def _handed(self, client: Client, sha256: str, content: bytes) -> bytes | Future:
        """Return the argument of a task for a content: the bytes themselves the first time.

        Keeping them on a worker is a task as costly as the work, and maybe for nothing.
        """
        self.users[sha256] += 1
        if sha256 not in self.kept:
            if sha256 not in self.seen or len(content) < _SMALL:
                self.seen[sha256] = None
                if len(self.seen) > _SEEN:
                    del self.seen[next(iter(self.seen))]
                return content
            self.kept[sha256] = client.submit(held, content, key=f"ocmm-content-{sha256}")
        return self.kept[sha256]

    def give_back(self, hashes: Sequence[str]) -> None:
        """Note that a task is done; contents that no task needs are soon dropped."""
        for sha256 in hashes:
            self.users[sha256] -= 1
            if self.users[sha256] <= 0 and sha256 not in self.kept:
                del self.users[sha256]
        idle = [sha256 for sha256 in self.kept if self.users[sha256] <= 0]
        for sha256 in idle[:-_IDLE]:
            del self.kept[sha256], self.users[sha256]

    def forget_failed(self, hashes: Sequence[str]) -> None:
        """Drop contents that no worker could keep: they would fail every later task."""
        for sha256 in hashes:
            future = self.kept.get(sha256)
            if future is not None and future.status == "error":
                del self.kept[sha256]
                self.seen.pop(sha256, None)

    def clear(self) -> None:
        self.kept.clear()
        self.seen.clear()
        self.users.clear()

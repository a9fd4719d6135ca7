"""Independent reader of the Q-DAS ASCII transfer format, for verification."""

from __future__ import annotations

from dataclasses import dataclass

from ocmm_core.errors import StorageError

FIELD, CHARACTERISTIC = "\x14", "\x0f"
NEWLINE = "\r\n"
ENCODING = "cp1252"

FIELDS = (
    "K0001", "K0002", "K0004", "K0005", "K0006", "K0007", "K0008", "K0010", "K0011", "K0012",
)  # fmt: skip
"""value, attribute, time, events, batch, nest, operator, machine, process, gauge."""


@dataclass(frozen=True, slots=True)
class KeyedLine:
    """A keyed line: ``K2101/3 20.0000``; index zero is the whole part."""

    key: str
    index: int
    text: str


@dataclass(frozen=True, slots=True)
class TransferFile:
    lines: tuple[KeyedLine, ...]
    values: tuple[tuple[dict[str, str], ...], ...]
    """For each part the fields of every characteristic by key."""

    def text(self, key: str, index: int = 0) -> str | None:
        """Return the first text of a key; None if missing."""
        return self.texts().get((key, index))

    def texts(self) -> dict[tuple[str, int], str]:
        """Return the first text of every key and index, for many lookups."""
        # Reversed, so that the first one remains.
        return {(line.key, line.index): line.text for line in reversed(self.lines)}


def read_transfer(content: bytes) -> TransferFile:
    """Return the contents of a file; StorageError if a line is neither keyed nor one of values."""
    lines: list[KeyedLine] = []
    values: list[tuple[dict[str, str], ...]] = []
    for number, line in enumerate(content.decode(ENCODING).split(NEWLINE), start=1):
        if not line:
            continue
        head, _, text = line.partition(" ")
        key, _, index = head.partition("/")
        if FIELD in line:
            parts = [part.split(FIELD) for part in line.split(CHARACTERISTIC)]
            values.append(tuple(dict(zip(FIELDS, part, strict=False)) for part in parts))
        elif key[:1] == "K" and key[1:].isdigit() and (index or "0").isdigit():
            lines.append(KeyedLine(key, int(index or "0"), text))
        else:
            raise StorageError(
                "aqdef.line", f"Line {number} of the transfer file is {line!r}.", "Write it again."
            )
    return TransferFile(tuple(lines), tuple(values))

"""A chained file keeps every line, notices every change and survives a torn end."""

from __future__ import annotations

import os
from pathlib import Path

import msgspec
import pytest

from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import StorageError


class Note(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the lines of these tests hold."""

    text: str
    value: float


NOTES = (Note("first", 1.5), Note("line\nbreak \u2028 and \u00e4", -0.1), Note("", 1e300))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a file with three lines."""
    chain = ChainFile(tmp_path / "new" / "notes.jsonl", Note)
    for note in NOTES:
        chain.append(note)
    assert chain.items == NOTES
    return chain.path


def test_what_was_appended_is_there_again(path: Path) -> None:
    again = ChainFile(path, Note)
    assert again.items == NOTES
    again.append(NOTES[0])
    assert ChainFile(path, Note).items == (*NOTES, NOTES[0])


def test_every_changed_byte_is_noticed(path: Path) -> None:
    content = path.read_bytes()
    for at in range(len(content)):
        path.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
        try:
            seen = ChainFile(path, Note).items
        except StorageError:
            continue
        # Only the end of the last line can look as if the line was never finished.
        assert at == len(content) - 1
        assert seen == NOTES[:2]


def test_lines_taken_out_or_put_in_another_order_are_noticed(path: Path) -> None:
    first, second, third = path.read_bytes().splitlines(keepends=True)
    for lines in ((second, third), (first, third), (first, third, second), (first, first)):
        path.write_bytes(b"".join(lines))
        with pytest.raises(StorageError, match="was changed after it was written"):
            ChainFile(path, Note)


def test_a_torn_line_is_left_out_and_overwritten(path: Path) -> None:
    whole = path.read_bytes()
    for length in range(1, 60):
        path.write_bytes(whole + whole[:length].replace(b"\n", b" "))
        again = ChainFile(path, Note)
        assert again.items == NOTES
    again.append(NOTES[1])
    assert ChainFile(path, Note).items == (*NOTES, NOTES[1])


def test_a_line_that_cannot_be_written_changes_nothing(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chain = ChainFile(path, Note)

    def disk_full(descriptor: int, content: bytes, offset: int) -> int:
        os.lseek(descriptor, offset, os.SEEK_SET)
        return os.write(descriptor, content[:10])

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", disk_full)
        with pytest.raises(StorageError, match="could not be stored"):
            chain.append(NOTES[0])
    assert chain.items == NOTES
    chain.append(NOTES[2])
    assert ChainFile(path, Note).items == (*NOTES, NOTES[2])

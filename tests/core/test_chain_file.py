"""A chained file keeps every line, notices every change and survives a torn end."""

from __future__ import annotations

import contextlib
import errno
import os
import threading
from pathlib import Path
from typing import Any

import msgspec
import pytest

from ocmm_core.chain_file import ChainFile
from ocmm_core.errors import StorageError


class Note(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Content of the lines in these tests."""

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


def test_reading_on_sees_what_reading_anew_sees(path: Path) -> None:
    known = ChainFile(path, Note)
    ChainFile(path, Note).append(NOTES[1])
    content = path.read_bytes()
    again = ChainFile(path, Note, known=known)
    assert again.items == (*NOTES, NOTES[1])
    # Items read before are reused, and its own additions are recorded.
    assert all(one is other for one, other in zip(known.items, again.items, strict=False))
    again.append(NOTES[2])
    assert ChainFile(path, Note, known=again).links == ChainFile(path, Note).links
    # Any other byte before, within or behind the earlier content.
    for at in range(len(content)):
        path.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
        told = []
        for given in (None, known):
            try:
                told.append(str(ChainFile(path, Note, known=given).items))
            except StorageError as error:
                told.append(error.what)
        assert told[0] == told[1]
    for shorter in range(len(content)):
        path.write_bytes(content[:shorter])
        anew, on = ChainFile(path, Note), ChainFile(path, Note, known=known)
        assert (anew.items, anew.links, anew.torn) == (on.items, on.links, on.torn)


def test_reading_on_decodes_what_came_since(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = ChainFile(path, Note)
    ChainFile(path, Note).append(NOTES[1])
    decoded = []
    decode = msgspec.json.decode

    def counted(text: bytes, **options: Any) -> object:
        decoded.append(text)
        return decode(text, **options)

    monkeypatch.setattr("ocmm_core.chain_file.msgspec.json.decode", counted)
    ChainFile(path, Note, known=known)
    # A line and its content.
    assert len(decoded) == 2


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


def test_a_cut_is_told_from_a_crash_where_the_chain_was_seen(tmp_path: Path) -> None:
    chain = ChainFile(tmp_path / "notes.jsonl", Note, remembered=True)
    for note in NOTES:
        chain.append(note)
    whole = chain.path.read_bytes()
    lines = whole.splitlines(keepends=True)
    # A crash while the fourth line was written: all that was acknowledged is there.
    for length in range(1, len(lines[0]) - 1):
        chain.path.write_bytes(whole + lines[0][:length])
        again = ChainFile(chain.path, Note, remembered=True)
        assert (again.items, again.torn) == (NOTES, True)
    # Anything less was cut, down to the line feed at the end.
    unnoticed = []
    for length in range(len(lines[0]), len(whole)):
        chain.path.write_bytes(whole[:length])
        with contextlib.suppress(StorageError):
            ChainFile(chain.path, Note, remembered=True)
            unnoticed.append(length)
    assert unnoticed == []
    chain.path.write_bytes(whole)
    assert ChainFile(chain.path, Note, remembered=True).items == NOTES


def test_who_read_an_old_end_writes_over_nothing(path: Path) -> None:
    first, second = ChainFile(path, Note), ChainFile(path, Note)
    first.append(NOTES[0])
    with pytest.raises(StorageError, match="another program has written") as caught:
        second.append(NOTES[1])
    assert caught.value.code == "chain.elsewhere"
    assert ChainFile(path, Note).items == (*NOTES, NOTES[0])


def test_after_a_line_that_was_written_in_part_the_next_one_is_whole(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chain = ChainFile(path, Note)
    whole = os.pwrite

    def in_part(descriptor: int, content: bytes, offset: int) -> int:
        return whole(descriptor, content[:10], offset)

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", in_part)
        with pytest.raises(StorageError, match="could not be stored"):
            chain.append(NOTES[0])
    chain.append(NOTES[1])
    assert ChainFile(path, Note).items == (*NOTES, NOTES[1])


def test_a_chain_whose_disk_failed_is_not_written_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.jsonl"
    chain = ChainFile(path, Note)
    chain.append(Note("stored", 1.0))
    synced: list[int] = []

    def fail(descriptor: int) -> None:
        synced.append(descriptor)
        raise OSError(errno.EIO, "Input/output error")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", fail)
        with pytest.raises(StorageError, match="everything before it is"):
            chain.append(Note("lost", 2.0))
    # The disk seems to work again: it may have dropped data meanwhile.
    with pytest.raises(StorageError, match="disk failed"):
        chain.append(Note("lost", 2.0))
    assert len(synced) == 1
    assert [item.text for item in ChainFile(path, Note).items] == ["stored"]


def test_a_chain_that_grows_while_it_is_read_is_no_cut_one(tmp_path: Path) -> None:
    """Another program appends 400 lines while this one reads: 0 of at least 20 readings refused."""
    chain = ChainFile(tmp_path / "notes.jsonl", Note, remembered=True)
    chain.append(NOTES[0])

    def append() -> None:
        for _ in range(400):
            chain.append(NOTES[0])

    writer = threading.Thread(target=append)
    writer.start()
    readings = 0
    while writer.is_alive() or readings < 20:
        readings += 1
        assert ChainFile(chain.path, Note, remembered=True).items
    writer.join()

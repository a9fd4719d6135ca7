"""The key of a station: made once, read by its user only, replaced without a loss, believed."""

from __future__ import annotations

import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import pytest

from ocmm_core.errors import InputError, StorageError
from ocmm_core.seals import (
    THIS_STATION,
    KeyFolder,
    SealWord,
    Signature,
    Signed,
    judge_signature,
    public_from_text,
    public_text,
    sign,
)
from tests.host import on_linux_only

NOW = datetime(2026, 11, 1, 8, 0, tzinfo=UTC)


@pytest.fixture
def keys(tmp_path: Path) -> KeyFolder:
    return KeyFolder(tmp_path / "keys")


def test_the_key_is_made_once_and_for_its_user_only(keys: KeyFolder) -> None:
    made = keys.station_key()
    assert KeyFolder(keys.folder).station_key().public == made.public
    assert [path.name for path in keys.folder.iterdir()] == ["station.key"]
    if os.name == "posix":
        assert (keys.folder / "station.key").stat().st_mode & 0o777 == 0o600
        assert keys.folder.stat().st_mode & 0o777 == 0o700


@on_linux_only
def test_a_key_that_others_can_read_signs_nothing(keys: KeyFolder) -> None:
    keys.station_key()
    (keys.folder / "station.key").chmod(0o640)
    with pytest.raises(StorageError, match="other users can read") as caught:
        keys.station_key()
    assert caught.value.code == "key.open"
    assert keys.own_public() is None


def test_programs_that_start_at_once_make_one_key(tmp_path: Path) -> None:
    script = (
        "import sys, pathlib; from ocmm_core.seals import KeyFolder;"
        "sys.stdin.readline();"
        "print(KeyFolder(pathlib.Path(sys.argv[1])).station_key().fingerprint)"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "keys")]
    running = [
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for _ in range(4)
    ]
    told = [one.communicate("go\n")[0].strip() for one in running]
    assert [one.returncode for one in running] == [0, 0, 0, 0]
    assert len(set(told)) == 1


def test_what_is_no_key_is_one_sentence(keys: KeyFolder) -> None:
    keys.station_key()
    path = keys.folder / "station.key"
    for content in (b"", b"x", b"-----BEGIN PRIVATE KEY-----\n", b"\xff" * 9000):
        path.write_bytes(content)
        with pytest.raises(StorageError, match=r"station\.key: the key of this station is damaged"):
            keys.station_key()
    (keys.folder / "known_keys.json").write_text('{"schema":"ocmm.keys/1","keys":[{}]}')
    with pytest.raises(StorageError, match="list of known keys"):
        keys.known()


def test_a_signature_is_of_one_content_of_one_kind_by_one_key(keys: KeyFolder) -> None:
    key = keys.station_key()
    signature = sign(key, Signed.JOB, b"content")

    def word(what: Signed, content: bytes, one: Signature | None) -> SealWord:
        return judge_signature(keys, what, content, one).word

    good = judge_signature(keys, Signed.JOB, b"content", signature)
    assert (good.word, good.station, good.sound) == (SealWord.SEALED, THIS_STATION, True)
    assert word(Signed.JOB, b"Content", signature) is SealWord.FORGED
    assert word(Signed.REPORT, b"content", signature) is SealWord.FORGED
    assert word(Signed.JOB, b"content", None) is SealWord.NOT_SIGNED
    for place in range(len(signature.value)):
        other = "A" if signature.value[place] != "A" else "B"
        value = signature.value[:place] + other + signature.value[place + 1 :]
        assert word(Signed.JOB, b"content", Signature(signature.key, value)) is SealWord.FORGED
    for key_text in ("", "x", signature.key[:-1], signature.key + "\n", "ÿ" * 44):
        found = word(Signed.JOB, b"content", Signature(key_text, signature.value))
        assert found is SealWord.FORGED


def test_what_a_replaced_key_signed_still_verifies(keys: KeyFolder) -> None:
    old = sign(keys.station_key(), Signed.JOB, b"content")
    new = keys.replace("Ada", "every two years", NOW)
    assert keys.station_key().public == new.public != public_from_text(old.key)
    again = judge_signature(keys, Signed.JOB, b"content", old)
    assert (again.word, again.station) == (SealWord.SEALED, THIS_STATION)
    (kept,) = keys.known()
    assert (kept.public, kept.until_utc, kept.who) == (old.key, "2026-11-01T08:00:00+00:00", "Ada")


def test_the_key_of_another_station_is_believed_once_somebody_says_so(
    keys: KeyFolder, tmp_path: Path
) -> None:
    other = KeyFolder(tmp_path / "other").station_key()
    signature = sign(other, Signed.JOB, b"content")
    stranger = judge_signature(keys, Signed.JOB, b"content", signature)
    assert (stranger.word, stranger.station) == (SealWord.UNKNOWN_KEY, "")
    assert stranger.fingerprint == other.fingerprint
    # Whoever only reads needs no key of his own.
    assert not keys.folder.exists()
    keys.trust(other.public, "Cell 3", "Ada", "compared by telephone", NOW)
    known = judge_signature(keys, Signed.JOB, b"content", signature)
    assert (known.word, known.station) == (SealWord.SEALED, "Cell 3")


def test_only_another_key_with_a_name_is_trusted(keys: KeyFolder) -> None:
    own = keys.station_key().public
    with pytest.raises(InputError, match="key of this station"):
        keys.trust(own, "Cell 1", "Ada", "", NOW)
    with pytest.raises(InputError, match="name of the station"):
        keys.trust(bytes(32), " ", "Ada", "", NOW)
    for text in ("", "zz", public_text(own)[:-4], public_text(bytes(31))):
        with pytest.raises(InputError, match="is not a public key"):
            public_from_text(text)

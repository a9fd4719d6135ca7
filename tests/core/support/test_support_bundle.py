"""A support bundle: planted secrets stay out, names are replaced on request, the list is true."""

from __future__ import annotations

import io
import json
import re
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from ocmm_core.acquisition.frames import FrameBlock, SourceDescription
from ocmm_core.acquisition.recording import FrameHistory, ReplaySource
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.settings import SettingsFile, SettingsStore
from ocmm_core.support import MASKED, PARTS, Cleaner, SupportSite, draft_bundle, write_bundle
from ocmm_core.wording import load_translation

KEY = (
    "-----BEGIN PRIVATE KEY-----\nMC4CAQAwBQYDK2VwBCIEIPlantedKeyLineNumberOne0123456789\n"
    "-----END PRIVATE KEY-----\n"
)
PLANTED = {
    "token file": "tok-4f81-planted-in-a-file",
    "key file": "MC4CAQAwBQYDK2VwBCIEIPlantedKeyLineNumberOne0123456789",
    "password file": "pa ss-planted äöü",
    "environment": "env-planted-77",
    "address": "url-planted-p4ss",
    "address with @": "url-pl@nted",
    "log word": "log-planted-1",
    "log colon": "log-planted-2",
    "log JSON": "log planted 3",
    "log quoted": "log-planted-4",
    "option": "opt-planted-5",
    "bearer": "bearer-planted-6",
    "key in a log": "bG9nZ2VkS2V5UGxhbnRlZDc",
    "cut key": "Y3V0S2V5UGxhbnRlZDg",
    "percent": "pa%20ss-planted%20%C3%A4%C3%B6%C3%BC",
    "record": "record-planted-9",
    "window log": "window-planted-10",
    "libpq": "libpq-planted-11",
    "short": "x7!",
    "German": "kennwort-planted-12",
}
LOG = f"""starting with --archive-password {PLANTED["option"]} and no more
connecting to postgresql://ocmm:{PLANTED["address"]}@server/shop
connecting to https://me:{PLANTED["address with @"]}@server
password={PLANTED["log word"]} and archive.password: {PLANTED["log colon"]}
{{"api_key": "{PLANTED["log JSON"]}", "n": 3}}
token = '{PLANTED["log quoted"]}'
Authorization: Bearer {PLANTED["bearer"]}
host=a user=b password={PLANTED["libpq"]} dbname=c
the file said {PLANTED["token file"]} and {PLANTED["password file"]}
in an address {PLANTED["percent"]}
environment {PLANTED["environment"]}
PIN: {PLANTED["short"]}
Kennwort: {PLANTED["German"]}
-----BEGIN RSA PRIVATE KEY-----
{PLANTED["key in a log"]}
-----END RSA PRIVATE KEY-----
the identity of the rig is 0123abcd
-----BEGIN EC PRIVATE KEY-----
{PLANTED["cut key"]}
"""
PEOPLE = (
    "Erika Mustermann", "Jonas Feldkamp", "Wanda Ostrowska", "Ilse Brandner", "Karim Osmani",
)  # fmt: skip


@pytest.fixture
def site(tmp_path: Path) -> SupportSite:
    for name, content in (
        ("token", PLANTED["token file"] + "\n"),
        ("key.pem", KEY),
        ("password", PLANTED["password file"]),
    ):
        (tmp_path / name).write_text(content, encoding="utf-8")
    # Settings refuse it; a hand-written file causes a warning.
    (tmp_path / "station.toml").write_text(
        'schema = "ocmm.settings/1"\n[archive]\n'
        f'address = "postgresql://ocmm:{PLANTED["address"]}@server/shop"\n',
        encoding="utf-8",
    )
    store = SettingsStore(
        SettingsFile(tmp_path / "station.toml"), SettingsFile(tmp_path / "user.toml")
    )
    store.change(
        {
            "stream.token": tmp_path / "token",
            "stream.key": tmp_path / "key.pem",
            "archive.password": tmp_path / "password",
            "job.operator": PEOPLE[0],
            "job.operators": PEOPLE[:2],
        }
    )
    logs, records = tmp_path / "logs", tmp_path / "calibrations"
    logs.mkdir()
    (records / "rig").mkdir(parents=True)
    (logs / "failure-1.log").write_text(LOG + f"job of {PEOPLE[0].upper()}", encoding="utf-8")
    (logs / "failure-2.log").write_bytes(b"\xff\xfe binary \x00 password=" + b"log-planted-1")
    (logs / "endless.log").write_bytes(b"a" * (1 << 20))
    (logs / "elsewhere.log").symlink_to(tmp_path / "key.pem")
    record = {
        "schema": "ocmm.calibration/1", "operator": PEOPLE[2], "coordinates": [1.0, 2.0],
        "note": f"secret: {PLANTED['record']}", "made_by": {"operator": PEOPLE[1], "age": 3},
    }  # fmt: skip
    (records / "rig" / "record-1.json").write_text(json.dumps(record), encoding="utf-8")
    # As records of calibrations, verifications and tips name who made them, and practised ones.
    made = {"schema": "ocmm.verification/1", "made_by": f"PRACTICE: {PEOPLE[3]}"}
    (records / "rig" / "record-2.json").write_text(json.dumps(made), encoding="utf-8")
    (logs / "failure-3.log").write_text(f"the job of {PEOPLE[4]}", encoding="utf-8")
    (records / "rig" / "damaged.json").write_text("{", encoding="utf-8")
    return SupportSite(
        store,
        logs,
        (records,),
        history(3.0),
        {"window.log": f"connecting, password={PLANTED['window log']}"},
        doctor=lambda: f"doctor of {PEOPLE[0]}",
        environment={"ARCHIVE_PASSWORD": PLANTED["environment"], "USER": "efeldkamp"},
        people=(PEOPLE[4],),
    )


def history(seconds: float, rate_hz: float = 800.0, most_bytes: int = 96 << 20) -> FrameHistory:
    rig = load_rig(resource("rigs", "recommended.toml"))
    description = SourceDescription("simulated", (1, 2), round(1e9 / rate_hz), 10**7, False, True)
    kept = FrameHistory(description, rig, most_bytes=most_bytes)
    count = 8 * round(rate_hz / 80.0)
    for first in range(0, round(seconds * rate_hz), count):
        kept.append(block(first, count, rate_hz))
    return kept


def block(first: int, count: int, rate_hz: float) -> FrameBlock:
    counter = np.arange(first, first + count, dtype=np.int64)
    time_ns = np.round(counter * (1e9 / rate_hz)).astype(np.int64) + 1
    uv = np.full((count, 2, 8, 2), np.nan)
    uv[:, :, 0] = counter[:, None, None] / 65536.0
    valid = np.ones((count, 2), dtype=np.uint64)
    return FrameBlock(counter, time_ns, np.zeros(count, dtype=np.uint32), valid, uv)


@pytest.mark.parametrize("mask", [False, True])
def test_no_planted_secret_is_in_any_file_or_name(site: SupportSite, mask: bool) -> None:
    draft = draft_bundle(site, mask_names=mask)
    with zipfile.ZipFile(io.BytesIO(draft.packed())) as archive:
        everything = "\n".join(
            [
                *archive.namelist(),
                *(archive.read(name).decode("latin1") for name in archive.namelist()),
            ]
        )
        text = "\n".join(
            archive.read(name).decode() for name in archive.namelist() if not name.endswith(".ocmr")
        )
    assert len(PLANTED) == 20
    for place, secret in PLANTED.items():
        assert secret not in text, place
        assert secret.encode().decode("latin1") not in everything, place
    # Public content stays.
    assert "the identity of the rig is 0123abcd" in text
    assert "endless.log" in everything
    assert "elsewhere.log" not in everything
    assert text.count(MASKED) >= 15


def test_names_are_masked_where_asked_and_kept_otherwise(site: SupportSite) -> None:
    def text(mask: bool) -> str:
        draft = draft_bundle(site, mask_names=mask)
        return "\n".join(item.preview() for item in draft.items) + draft.contents()

    kept, masked = text(False), text(True)
    for name in PEOPLE:
        assert name in kept
        for part in (name, *name.split()):
            assert part.casefold() not in masked.casefold(), part
    assert "[person 1]" in masked
    assert "(2 values)" in masked


def test_the_list_says_exactly_what_is_inside(site: SupportSite, tmp_path: Path) -> None:
    draft = draft_bundle(site, mask_names=True)
    path = tmp_path / "support.zip"
    write_bundle(draft, path, ["recording", "doctor"])
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        listed = archive.read("CONTENTS.txt").decode()
        for item in draft.items:
            if item.part not in ("recording", "doctor"):
                assert archive.read(item.name) == item.content
    assert names == {"CONTENTS.txt"} | {
        item.name for item in draft.items if item.part not in ("recording", "doctor")
    }
    for name in names - {"CONTENTS.txt"}:
        assert f"  {name}  " in listed
    assert listed.count("Left out.") == 2
    assert all(spec.title in listed for spec in PARTS)


def test_whoever_reads_the_list_gets_it_in_his_language_and_support_in_english(
    site: SupportSite,
) -> None:
    draft = draft_bundle(site, mask_names=True)
    speech = load_translation("de")

    def say(text: str) -> str:
        return speech.translate(text) if speech.translate(text) != text else speech.word(text)

    shown = draft.contents((), say)
    for words in ("OCMM-Supportpaket", "Passwörter, Tokens", "Rechnerprüfung: ", "Einstellungen: "):
        assert words in shown
    assert not re.search(r"\b(the|and|of|names|taken)\b", shown), shown
    with zipfile.ZipFile(io.BytesIO(draft.packed())) as archive:
        listed = archive.read("CONTENTS.txt").decode()
    assert "Passwords, tokens and private keys were taken out." in listed


def test_a_part_that_cannot_be_gathered_is_told_and_the_rest_is_packed(site: SupportSite) -> None:
    def broken() -> str:
        raise RuntimeError("nobody foresaw it, password=log-planted-1")

    bare = SupportSite(site.store, site.logs / "none", (), None, {}, broken, {})
    draft = draft_bundle(bare, mask_names=True)
    assert "RuntimeError" in draft.missing["doctor"]
    assert "planted" not in draft.contents()
    assert draft.missing["recording"] == "Nothing there."
    assert {item.part for item in draft.items} == {"versions", "settings"}


def test_wrong_parts_and_names_are_refused(site: SupportSite, tmp_path: Path) -> None:
    draft = draft_bundle(site, mask_names=False)
    with pytest.raises(InputError, match="no part 'keys'"):
        draft.packed(["keys"])
    with pytest.raises(InputError, match=r"\.zip"):
        write_bundle(draft, tmp_path / "support.txt")


def test_a_short_secret_of_a_file_does_not_eat_the_text() -> None:
    assert Cleaner(("a",)).clean("a banana") == "a banana"
    assert Cleaner((), ("demo", "Al", "Ann")).clean("demo: Ann planned, Al") == (
        "demo: [person 3] planned, Al"
    )


def test_the_history_is_bounded_in_time_and_memory_and_can_be_replayed(tmp_path: Path) -> None:
    kept = history(42.0)
    assert 29.9 < kept.seconds < 30.3
    small = history(42.0, most_bytes=1 << 20)
    assert small.size_bytes <= 1 << 20
    whole = np.concatenate([one.counter for one in kept.blocks()])
    newest = np.concatenate([one.counter for one in small.blocks()])
    assert np.array_equal(whole, np.arange(whole[0], 42 * 800))
    assert np.array_equal(newest, whole[-len(newest) :])
    assert small.size_bytes > 1 << 19
    path = tmp_path / "last.ocmr"
    assert kept.write(path) == sum(map(len, kept.blocks()))
    source = ReplaySource(path)
    source.open()
    first = source.read().frames
    assert first is not None
    assert np.array_equal(first.uv, kept.blocks()[0].uv[: len(first)], equal_nan=True) or len(
        first
    ) > len(kept.blocks()[0])
    source.close()


def test_the_history_forgets_what_is_old_what_another_clock_saw_and_all_at_the_end() -> None:
    kept = history(10.0)
    count = sum(map(len, kept.blocks()))
    # Frames were lost: there is room for older ones, but they are too old.
    kept.append(block(35 * 800, 80, 800.0))
    assert kept.seconds < 30.001
    assert kept.blocks()[0].counter[0] > 0
    assert sum(map(len, kept.blocks())) < count
    kept.append(block(800, 80, 800.0))
    assert np.array_equal(kept.blocks()[0].counter, np.arange(800, 880))
    # A block longer than all that may be kept leaves its newest frames.
    small = history(1.0, most_bytes=280 * 50)
    small.append(block(10_000, 333, 800.0))
    assert np.array_equal(small.blocks()[0].counter, np.arange(10_283, 10_333))
    kept.clear()
    kept.append(block(5000, 80, 800.0))
    assert not kept.blocks()
    assert not kept.seconds
    assert not kept.size_bytes


def test_a_bus_clock_that_is_set_anew_starts_another_history() -> None:
    kept = history(5.0)
    kept.append(block(0, 10, 800.0))
    assert sum(map(len, kept.blocks())) == 10


def test_a_block_is_kept_without_a_copy() -> None:
    kept = history(1.0)
    one = block(10_000, 800, 800.0)
    tracemalloc.start()
    kept.append(one)
    size = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert size < 10_000 < one.uv.nbytes

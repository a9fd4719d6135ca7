"""A key that lies in a token: made there, signs there, is missed, is replaced."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.asymmetric.ec import ECDSA, SECP256R1, generate_private_key
from cryptography.hazmat.primitives.asymmetric.utils import decode_dss_signature
from cryptography.hazmat.primitives.hashes import SHA256
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_core.documents import resource
from ocmm_core.errors import StorageError
from ocmm_core.seals import (
    THIS_STATION,
    KeyFolder,
    SealWord,
    Signed,
    TokenPlace,
    judge_signature,
    public_from_text,
    public_text,
    sign,
)
from ocmm_core.seals._public import compressed_p256, low_s, verifies
from ocmm_core.storage import JobFile, make_head
from tests.host import HANG_S, needs_package, needs_tools, not_run
from tests.other_station import other_station

NOW = datetime(2026, 11, 1, 8, 0, tzinfo=UTC)
_MODULES = ("/usr/lib/softhsm/libsofthsm2.so", "/usr/lib64/pkcs11/libsofthsm2.so")
_P256_ORDER = 0xFFFFFFFF00000000FFFFFFFFFFFFFFFFBCE6FAADA7179E84F3B9CAC2FC632551


@dataclass(frozen=True)
class Softhsm:
    """A token in software, in a separate folder."""

    place: TokenPlace
    folder: Path


@pytest.fixture(scope="module")
def softhsm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Softhsm]:
    # One a process: a module of PKCS #11 reads where its tokens are when it is loaded.
    needs_tools("softhsm2-util")
    needs_package("pkcs11", "it reads tokens")
    module = next((name for name in _MODULES if Path(name).exists()), None)
    if module is None:
        not_run("no library of SoftHSM was found")
    folder = tmp_path_factory.mktemp("softhsm")
    (folder / "tokens").mkdir()
    configuration = folder / "softhsm2.conf"
    configuration.write_text(f"directories.tokendir = {folder / 'tokens'}\nlog.level = ERROR\n")
    before = os.environ.get("SOFTHSM2_CONF")
    os.environ["SOFTHSM2_CONF"] = str(configuration)
    subprocess.run(
        ["softhsm2-util", "--init-token", "--free", "--label", "station",
         "--pin", "2468", "--so-pin", "13579"],
        check=True, capture_output=True,
    )  # fmt: skip
    yield Softhsm(TokenPlace(module=module, label="station", pin="2468"), folder)
    if before is None:
        del os.environ["SOFTHSM2_CONF"]
    else:
        os.environ["SOFTHSM2_CONF"] = before


@pytest.fixture
def keys(tmp_path: Path) -> KeyFolder:
    return KeyFolder(tmp_path / "keys")


def test_a_key_moves_into_a_token_and_out_again(softhsm: Softhsm, keys: KeyFolder) -> None:
    in_file = keys.station_key()
    signed = [sign(in_file, Signed.JOB, b"before")]
    in_token = keys.replace("Ada", "safer", NOW, softhsm.place)
    assert in_token.public != in_file.public
    assert in_token.kept_in == f"token station ({softhsm.place.module})"
    assert keys.token_place() == softhsm.place
    signed.append(sign(keys.station_key(), Signed.JOB, b"before"))
    # The folder contains no private key, and the PIN is not readable by others.
    assert not (keys.folder / "station.key").exists()
    assert (keys.folder / "token.json").stat().st_mode & 0o777 == 0o600
    back = keys.replace("Ada", "the token is needed elsewhere", NOW)
    assert keys.token_place() is None
    assert not (keys.folder / "token.json").exists()
    signed.append(sign(back, Signed.JOB, b"before"))
    for signature in signed:
        found = judge_signature(keys, Signed.JOB, b"before", signature)
        assert (found.word, found.station) == (SealWord.SEALED, THIS_STATION)
        other = judge_signature(keys, Signed.JOB, b"after", signature)
        assert other.word is SealWord.FORGED
    assert [key.public for key in keys.known()] == [
        public_text(in_file.public),
        public_text(in_token.public),
    ]


_AS_A_TPM = """
import pathlib, sys
from datetime import UTC, datetime
from ocmm_core.seals import *
from ocmm_core.seals._public import public_text
keys = KeyFolder(pathlib.Path(sys.argv[1]))
place = TokenPlace(module=sys.argv[2], label="station", pin="2468")
key = keys.replace("Ada", "a TPM", datetime.now(UTC), place)
print(public_text(key.public))
for number in range(20):
    content = b"%d" % number
    print(judge_signature(keys, Signed.HISTORY, content, sign(key, Signed.HISTORY, content)).word)
"""


def test_a_token_that_knows_no_ed25519_signs_with_p256(softhsm: Softhsm, tmp_path: Path) -> None:
    configuration = tmp_path / "tpm.conf"
    configuration.write_text(
        f"directories.tokendir = {softhsm.folder / 'tokens'}\nlog.level = ERROR\n"
        "slots.mechanisms = -CKM_EDDSA,CKM_EC_EDWARDS_KEY_PAIR_GEN\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", _AS_A_TPM, str(tmp_path / "keys"), softhsm.place.module],
        env={**os.environ, "SOFTHSM2_CONF": str(configuration)},
        capture_output=True, text=True, check=False, timeout=HANG_S,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    public, *words = done.stdout.splitlines()
    assert len(public_from_text(public)) == 33
    assert words == ["SEALED"] * 20


def test_a_token_that_is_gone_signs_nothing_and_is_replaced(
    softhsm: Softhsm, keys: KeyFolder
) -> None:
    key = keys.replace("Ada", "safer", NOW, softhsm.place)
    signature = sign(key, Signed.JOB, b"job")
    content = (keys.folder / "token.json").read_text()
    (keys.folder / "token.json").write_text(content.replace('"label":"station"', '"label":"gone"'))
    gone = keys.station_key()
    with pytest.raises(StorageError, match=r"token gone .*\(it is not there\)") as caught:
        gone.sign(b"job")
    assert caught.value.code == "key.token"
    # Its signatures can be verified without it, and the station continues with another key.
    assert judge_signature(keys, Signed.JOB, b"job", signature).sound
    assert keys.replace("Ada", "lost", NOW).sign(b"job")
    assert judge_signature(keys, Signed.JOB, b"job", signature).station == THIS_STATION


def test_a_wrong_pin_is_tried_once(softhsm: Softhsm, keys: KeyFolder) -> None:
    wrong = TokenPlace(module=softhsm.place.module, label="station", pin="0000")
    before = keys.station_key().public
    for _ in range(20):
        with pytest.raises(StorageError, match="refuses the PIN") as caught:
            keys.replace("Ada", "typed wrong", NOW, wrong)
        assert caught.value.code == "key.token_pin"
    # Nothing has changed, and the token has not closed.
    assert keys.station_key().public == before
    assert keys.known() == ()
    assert keys.replace("Ada", "typed right", NOW, softhsm.place).sign(b"job")


def test_another_key_under_the_same_name_is_noticed(softhsm: Softhsm, keys: KeyFolder) -> None:
    first = keys.replace("Ada", "first", NOW, softhsm.place)
    content = (keys.folder / "token.json").read_text()
    second = keys.replace("Ada", "second", NOW, softhsm.place)
    first_text, second_text = public_text(first.public), public_text(second.public)
    assert first_text in content
    (keys.folder / "token.json").write_text(content.replace(first_text, second_text))
    with pytest.raises(StorageError, match="its key is another one"):
        keys.station_key().sign(b"job")


@pytest.mark.parametrize(
    "content",
    ["", "{}", "[" * 9999, '{"schema":"ocmm.token/1","place":{},"key_id":"","public":""}',
     '{"schema":"ocmm.token/1","place":{"module":"m","label":"t","pin":"p"},'
     '"key_id":"xx","public":"AAAA"}'],
)  # fmt: skip
def test_a_damaged_token_file_is_told(keys: KeyFolder, content: str) -> None:
    keys.folder.mkdir(mode=0o700)
    (keys.folder / "token.json").write_text(content)
    (keys.folder / "token.json").chmod(0o600)
    with pytest.raises(StorageError) as caught:
        keys.station_key()
    assert caught.value.code == "key.damaged"


def test_a_module_that_is_none_is_told(keys: KeyFolder, tmp_path: Path) -> None:
    needs_package("pkcs11", "it reads tokens")
    for module in (tmp_path / "missing.so", Path("/usr/bin/env")):
        place = TokenPlace(module=str(module), label="t", pin="1")
        with pytest.raises(StorageError) as caught:
            keys.replace("Ada", "typed wrong", NOW, place)
        assert caught.value.code == "key.token"


def test_the_command_moves_the_key(softhsm: Softhsm, tmp_path: Path) -> None:
    with other_station(tmp_path / "home"):
        _move_by_command(softhsm, tmp_path)


def _move_by_command(softhsm: Softhsm, tmp_path: Path) -> None:
    pin = tmp_path / "pin"
    pin.write_text("2468\n")
    common = ["key", "replace", "--who", "Ada", "--reason", "safer"]
    place = ["--token", "station", "--module", softhsm.place.module]
    done = CliRunner().invoke(app, [*common, "--token", "station", "--pin-file", str(pin)])
    assert done.exit_code != 0
    assert "--token LABEL --module LIBRARY" in str(done.exception)
    done = CliRunner().invoke(app, [*common, *place, "--pin-file", str(pin)])
    assert done.exit_code == 0, done.output
    assert "Kept in     token station" in done.output
    # A new token replaces the old one; the PIN is requested if no file holds it.
    done = CliRunner().invoke(app, common)
    assert "Kept in     token station" in done.output
    done = CliRunner().invoke(app, [*common, *place], input="2468\n")
    assert done.exit_code == 0, done.output
    assert "2468" not in done.output
    done = CliRunner().invoke(app, [*common, "--in-file"])
    assert f"Kept in     {KeyFolder().folder}" in done.output


def test_a_job_stores_nothing_without_its_token_and_goes_on_with_it(
    softhsm: Softhsm, tmp_path: Path
) -> None:
    with other_station(tmp_path / "home"):
        _measure_without_and_with(softhsm, tmp_path / "JOB-001.ocmm")


def _measure_without_and_with(softhsm: Softhsm, path: Path) -> None:
    KeyFolder().replace("Ada", "safer", NOW, softhsm.place)
    head = make_head(
        plan=resource("plans", "quick.toml"), rig=resource("rigs", "recommended.toml"),
        probe=resource("probes", "standard.toml"), operator="Ada", part="PART", serial="1",
    )  # fmt: skip
    tokens = softhsm.folder / "tokens"
    with JobFile.create(path, head) as job:
        job.append_event("note", "first")
        tokens.rename(softhsm.folder / "taken out")
        with pytest.raises(StorageError, match="token station") as caught:
            job.append_event("note", "second")
        assert caught.value.code == "key.token"
        (softhsm.folder / "taken out").rename(tokens)
        job.append_event("note", "third")
    with JobFile.open(path) as job:
        assert job.seal().state.sound
        texts = [event.text for event in job.events()]
    assert [text for text in texts if text in ("first", "second", "third")] == ["first", "third"]


def test_one_of_the_two_values_of_an_ecdsa_signature_counts() -> None:
    private = generate_private_key(SECP256R1())
    numbers = private.public_key().public_numbers()
    point = b"\x04" + numbers.x.to_bytes(32, "big") + numbers.y.to_bytes(32, "big")
    public = compressed_p256(point)
    for number in range(20):
        content = hashlib.sha256(b"%d" % number).digest()
        r, s = decode_dss_signature(private.sign(content, ECDSA(SHA256())))
        both = [r.to_bytes(32, "big") + v.to_bytes(32, "big") for v in (s, _P256_ORDER - s)]
        assert sorted(verifies(public, content, one) for one in both) == [False, True]
        assert verifies(public, content, low_s(both[0]))
        assert low_s(both[0]) == low_s(both[1])
        assert not verifies(public, content + b"x", low_s(both[0]))

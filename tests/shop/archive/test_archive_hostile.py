"""Messages that lie, names that attack, passwords that others read: nothing of it has an effect."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.settings import spec_of, value_of_text
from ocmm_shop.archive.records import Delivery
from ocmm_shop.archive.stores import Acknowledgement, check_address, open_archive, parse_server
from ocmm_shop.archive.stores._address import read_password
from tests.host import amount
from tests.shop.archive.conftest import Place, by_hand
from tests.shop.archive.made_jobs import made_delivery

MESSAGES = amount(500, 10_000)

NASTY: tuple[Any, ...] = (
    "'; DROP TABLE job; --", "\0", "a\0b", "\ud800", "x" * 100_000, "\u202egnp.exe", "a\nb", "",
    None, True,
    -1, 0, 1 << 70, float("nan"), float("inf"), -float("inf"), b"bytes", [], {}, "2026-13-45",
    "NaN", "%s%n", "${jndi:x}", "../../etc/passwd", "0" * 64, "g" * 64, 1e308, "CONFORM ",
)  # fmt: skip


def malformed(rng: np.random.Generator) -> Delivery:
    """Return a message of which one to three fields are something else."""
    made = made_delivery(int(rng.integers(1000, 2000)))
    for _ in range(int(rng.integers(1, 4))):
        value = NASTY[int(rng.integers(len(NASTY)))]
        where = int(rng.integers(5))
        if where == 0:
            field = str(rng.choice(made.sender.__struct_fields__))
            sender = msgspec.structs.replace(made.sender, **{field: value})
            made = msgspec.structs.replace(made, sender=sender)
        elif where == 1:
            field = str(rng.choice(["sequence", "sent_utc", "content"]))
            made = msgspec.structs.replace(made, **{field: value})
        else:
            record = made.record
            if where == 2:
                part = msgspec.structs.replace(
                    record.job, **{str(rng.choice(record.job.__struct_fields__)): value}
                )
                record = msgspec.structs.replace(record, job=part)
            elif where == 3:
                row = record.results[0]
                changed = msgspec.structs.replace(
                    row, **{str(rng.choice(row.__struct_fields__)): value}
                )
                record = msgspec.structs.replace(record, results=(changed, *record.results[1:]))
            else:
                use = record.uses[0]
                changed_use = msgspec.structs.replace(
                    use, **{str(rng.choice(use.__struct_fields__)): value}
                )
                record = msgspec.structs.replace(record, uses=(changed_use, *record.uses[1:]))
            made = msgspec.structs.replace(made, record=record)
    return made


def test_malformed_messages_have_no_effect(
    place: Place, record_property: Callable[[str, object], None]
) -> None:
    rng = np.random.default_rng(22)
    refused = kept = 0
    with place.open() as archive:
        archive.put(made_delivery(1))
        before = archive.record(1)
        for _ in range(MESSAGES):
            message = malformed(rng)
            try:
                receipt = archive.put(message)
            except OcmmError:
                refused += 1
            else:
                # The drawn value happened to be valid there: it is stored unchanged.
                kept += 1
                if receipt.answer is Acknowledgement.STORED:
                    assert archive.record(receipt.job) == message.record
        assert archive.record(1) == before
        (count,) = archive.query("SELECT count(*) FROM job").rows[0]
        assert isinstance(count, int)
        assert count <= 1 + kept
        for table in ("result", "used", "file", "delivery"):
            assert archive.query(f"SELECT count(*) FROM {table}").rows  # noqa: S608 - names above
        assert archive.query("SELECT count(*) FROM result WHERE value IS NULL").rows == ((0,),)
        archive.put(made_delivery(2))
    record_property(place.store, f"{refused} of {MESSAGES} refused, {kept} allowed, 0 effects")
    assert refused > MESSAGES // 2


def test_a_server_refuses_by_itself_what_a_station_writes_beside_the_program(
    new_database: Callable[[], Place],
) -> None:
    shop = new_database()
    assert shop.server is not None
    with open_archive(shop.server.address(shop.database, "station1")) as archive:
        archive.put(made_delivery(1))
        copy = "INSERT INTO result (job, position, part, created_utc, characteristic, kind, unit,"
        for values in (
            "'mm', 1.0, 'GOOD', '', 1.0, 0.1",
            "'inch', 1.0, 'CONFORM', '', 1.0, 0.1",
            "'mm', 1.0, 'CONFORM', '', NULL, NULL",
            "'mm', 1.0, 'CONFORM', '', 1.0, NULL",
            "'mm', 1.0, 'CONFORM', '', 1.0, -1.0",
        ):
            with pytest.raises(OcmmError):
                by_hand(
                    archive,
                    f"{copy} nominal, verdict, why_not, value, uncertainty) SELECT 1, 77, 'P',"
                    f" '2026-03-02T06:07:00.000+00:00', 'D', 'diameter', {values}",
                )
        with pytest.raises(OcmmError):
            by_hand(
                archive, "INSERT INTO file (sha256, size, content) VALUES (repeat('0', 64), 1, 'x')"
            )


@pytest.mark.parametrize(
    "address",
    [
        "postgresql://me:secret@db/ocmm",
        "postgresql://me@db/ocmm?password=secret",
        "postgresql://me@db/ocmm?passfile=/tmp/x",
        "postgresql://me@db/ocmm?sslmode=prefer",
        "postgresql://me@db/ocmm?sslmode=allow",
        "postgresql://me@db/ocmm?options=-c%20x",
        "postgresql://me@db/ocmm?service=x",
        "postgresql://me@db/",
        "postgresql://me@db:port/ocmm",
        "http://db/ocmm",
        "postgresql://me@db/ocmm?host=a%00b",
    ],
)
def test_addresses_that_are_refused(address: str) -> None:
    with pytest.raises(InputError) as caught:
        check_address(address)
    assert "secret" not in str(caught.value)


def test_a_password_is_refused_in_the_settings_and_not_shown() -> None:
    for text in ("postgresql://me:secret@db/ocmm", "postgresql://me@db/ocmm?password=secret"):
        with pytest.raises(InputError, match="must hold no password") as caught:
            value_of_text(spec_of("archive.address"), text)
        assert "secret" not in str(caught.value)
    good = "postgresql://me@db.shop:5432/ocmm?sslmode=verify-full"
    assert value_of_text(spec_of("archive.address"), good) == good


def test_a_server_on_the_network_is_reached_with_a_checked_certificate_unless_told() -> None:
    assert parse_server("postgresql://me@db.shop/ocmm").options["sslmode"] == "verify-full"
    assert parse_server("postgresql://me@10.0.0.7/ocmm").options["sslrootcert"] == "system"
    told = parse_server("postgresql://me@db.shop/ocmm?sslmode=disable")
    assert told.is_open
    for local in ("localhost", "127.0.0.1", "[::1]"):
        assert "sslmode" not in parse_server(f"postgresql://me@{local}/ocmm").options


def test_a_password_comes_from_a_file_that_nobody_else_reads(tmp_path: Path) -> None:
    file = tmp_path / "password"
    file.write_text("s3cret\n")
    file.chmod(0o600)
    assert read_password(file) == "s3cret"
    for mode in (0o640, 0o604, 0o660):
        file.chmod(mode)
        with pytest.raises(StorageError, match=f"can be read by others.*chmod 600 {file}"):
            read_password(file)
    file.chmod(0o600)
    link = tmp_path / "link"
    link.symlink_to(file)
    with pytest.raises(StorageError):
        read_password(link)
    for content in (b"", b"two\nlines", b"\xff\xfe", b"x" * 5000):
        file.write_bytes(content)
        with pytest.raises(StorageError):
            read_password(file)
    with pytest.raises(StorageError, match="cannot be read"):
        read_password(tmp_path / "none")


def test_a_file_of_something_else_is_left_alone(tmp_path: Path) -> None:
    for name, content in (("text", b"hello" * 1000), ("empty", b"")):
        path = tmp_path / name
        path.write_bytes(content)
        if content:
            with pytest.raises(StorageError):
                open_archive(str(path))
            assert path.read_bytes() == content


def test_an_archive_file_that_runs_something_of_its_own_is_harmless(tmp_path: Path) -> None:
    path = tmp_path / "archive.sqlite"
    with open_archive(str(path)) as archive:
        archive.put(made_delivery(1))
        by_hand(
            archive,
            "CREATE TRIGGER evil AFTER INSERT ON delivery BEGIN"
            " SELECT load_extension('/tmp/evil.so'); END",
        )
        with pytest.raises(OcmmError):
            archive.put(made_delivery(2))
        assert archive.query("SELECT count(*) FROM job").rows == ((1,),)

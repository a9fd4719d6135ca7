"""Every report format provides all fields required by command line, window and documentation."""

from __future__ import annotations

import dataclasses
import re
from importlib.util import find_spec
from pathlib import Path

import msgspec
import pytest

from ocmm_core.errors import InputError
from ocmm_core.export import (
    ALL,
    DEFAULT_FORMAT,
    EXPORTERS,
    FORMATS,
    PDF,
    chosen_formats,
    preview,
    write_report,
)
from ocmm_core.export.report import Exporter, ReportFormat, polyworks_profile
from tests.core.export.sample_report import sample_report

_OTHER = msgspec.structs.replace(polyworks_profile(), lengths="inch", length_decimals=6)


@pytest.mark.parametrize("name", list(FORMATS))
def test_an_entry_lacks_nothing(name: str) -> None:
    entry = FORMATS[name]
    assert entry.name == name
    assert re.fullmatch(r"[a-z]+", name)
    assert name != ALL
    assert entry.title.strip()
    assert entry.purpose.strip()
    assert entry.suffixes
    assert all(re.fullmatch(r"[a-z_]*\.[a-z]+", suffix) for suffix in entry.suffixes)
    assert {field.name for field in dataclasses.fields(ReportFormat)} == {
        "name", "title", "purpose", "suffixes", "profile",
    }, "a new field of an entry needs a check here"  # fmt: skip
    assert isinstance(entry, Exporter) is (entry is not PDF)


@pytest.mark.parametrize("name", list(EXPORTERS))
def test_files_end_as_the_entry_says(name: str) -> None:
    data = sample_report()
    profile = msgspec.structs.replace(polyworks_profile(), centres=True)
    made = EXPORTERS[name].contents((data,), profile)
    left_out = {"_points.parquet"} if find_spec("pyarrow") is None else set()
    assert {file.removeprefix(data.stem) for file in made} == {*EXPORTERS[name].suffixes} - left_out
    assert EXPORTERS[name].differences((data,), profile, made) == []
    assert EXPORTERS[name].preview((data,), profile)


@pytest.mark.parametrize("name", list(EXPORTERS))
def test_a_format_takes_of_the_profile_what_the_entry_says(name: str) -> None:
    contents = EXPORTERS[name].contents
    data = sample_report()
    taken = contents((data,), polyworks_profile()) != contents((data,), _OTHER)
    assert taken is bool(EXPORTERS[name].profile)


def test_all_formats_are_chosen_once() -> None:
    assert DEFAULT_FORMAT in EXPORTERS
    assert chosen_formats([DEFAULT_FORMAT, ALL]) == (DEFAULT_FORMAT, *_without(DEFAULT_FORMAT))
    assert chosen_formats([PDF.name, PDF.name]) == (PDF.name,)


def _without(name: str) -> tuple[str, ...]:
    return tuple(other for other in FORMATS if other != name)


def test_an_unknown_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="Unknown report format 'word'") as caught:
        chosen_formats(["word"])
    assert all(name in caught.value.remedy for name in (*FORMATS, ALL))
    for use in (
        lambda: write_report(sample_report(), ["word"], tmp_path / "out", incomplete=True),
        lambda: preview(sample_report(), "word"),
    ):
        with pytest.raises(InputError, match="Unknown report format 'word'"):
            use()
    assert not (tmp_path / "out").exists()

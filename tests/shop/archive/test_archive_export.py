"""Tables as files: reading them returns the answers."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from ocmm_cli import app
from ocmm_shop.archive.questions import (
    ArchiveAnswer,
    Query,
    cpk_by_month,
    export_answer,
    passed,
    today,
    trend,
)
from tests.host import needs_package
from tests.shop.archive.conftest import Place
from tests.shop.archive.made_jobs import START, made_delivery


def read_back(path: Path) -> tuple[list[str], list[tuple[object, ...]]]:
    needs_package("pyarrow", "extra `shop`")
    import pyarrow.parquet

    table = pyarrow.parquet.read_table(path)
    columns = [one.to_pylist() for one in table.columns]
    return list(table.column_names), list(zip(*columns, strict=True))


@pytest.mark.parametrize("question", [today, trend, cpk_by_month, passed])
def test_a_table_in_parquet_is_read_back_to_the_digit(
    place: Place, tmp_path: Path, question: object
) -> None:
    needs_package("pyarrow", "extra `shop`")
    asked = Query(part="FLANGE", characteristic="D1", first=START.astimezone().date())
    with place.open() as archive:
        archive.put_all([made_delivery(seed) for seed in range(40)])
        answer: ArchiveAnswer = question(archive, asked)  # type: ignore[operator]
    export_answer(answer, tmp_path / "table.parquet")
    columns, rows = read_back(tmp_path / "table.parquet")
    assert columns == list(answer.columns)
    assert rows == list(answer.rows)


@pytest.mark.parametrize("view", ["archived_result", "archived_job", "archive_month"])
def test_a_whole_view_in_parquet_is_read_back(place: Place, tmp_path: Path, view: str) -> None:
    needs_package("pyarrow", "extra `shop`")
    with place.open() as archive:
        archive.put_all([made_delivery(seed) for seed in range(40)])
        table = archive.query(f"SELECT * FROM {view}")  # noqa: S608 - a name above
    file = tmp_path / "view.parquet"
    done = CliRunner().invoke(
        app, ["archive", "export", view, str(file), "--archive", place.address]
    )
    assert done.exit_code == 0, done.output
    columns, rows = read_back(file)
    assert columns == list(table.columns)
    assert sorted(map(repr, rows)) == sorted(map(repr, table.rows))


def test_a_column_with_nothing_in_it_and_names_of_any_script_survive(tmp_path: Path) -> None:
    needs_package("pyarrow", "extra `shop`")
    rows = ((None, "Größe = 1", 1.0), (None, "直径", None))
    export_answer(ArchiveAnswer("x", ("a", "b", "c"), rows), tmp_path / "odd.parquet")
    assert read_back(tmp_path / "odd.parquet") == (["a", "b", "c"], list(rows))

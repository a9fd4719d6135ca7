"""The CAD model of a plan: stored next to it, used with it, and never in place of measuring."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import platformdirs
import pytest

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import (
    CadModel,
    Plan,
    carry_model,
    load_plan,
    part_of_plan,
    save_plan,
    with_model,
)
from ocmm_core.inspection.plan._file_beside import FOLDER, MOST_FILES, cached_part, keep_part
from ocmm_core.part_model import PartModel
from tests.part_models import block_part


def demo_plan() -> Plan:
    return load_plan(resource("plans", "demo.toml"))


TEXT = b"ISO-10303-21;\n"


def beside(tmp_path: Path) -> tuple[Plan, Path, PartModel]:
    """Return a plan with a model whose part is kept, and its file."""
    source = tmp_path / "elsewhere" / "a part.STEP"
    source.parent.mkdir()
    source.write_bytes(TEXT)
    part = replace(block_part(), source_sha256=hashlib.sha256(TEXT).hexdigest())
    file = tmp_path / "plans" / "p.toml"
    file.parent.mkdir()
    plan = with_model(demo_plan(), file, source, part)
    save_plan(plan, file)
    return plan, file, part


def test_a_model_is_copied_beside_the_plan_and_named_with_its_hash(tmp_path: Path) -> None:
    plan, file, part = beside(tmp_path)
    assert load_plan(file).model == CadModel(file="a_part.step", sha256=part.source_sha256)
    assert (file.parent / "a_part.step").read_bytes() == TEXT
    # Again it is the same copy; another file of that name stays.
    assert with_model(plan, file, tmp_path / "elsewhere" / "a part.STEP") == plan
    (tmp_path / "elsewhere" / "a part.STEP").write_bytes(TEXT + b"other")
    other = with_model(plan, file, tmp_path / "elsewhere" / "a part.STEP")
    assert other.model is not None
    assert other.model.file == "a_part-2.step"
    assert msgspec.structs.replace(plan, model=None).model is None
    # One that lies there is named as it is.
    there = with_model(plan, file, file.parent / "a_part.step")
    assert there.model == plan.model


def test_a_plan_in_another_folder_takes_its_model_along(tmp_path: Path) -> None:
    plan, file, _ = beside(tmp_path)
    carry_model(plan, file.parent, tmp_path / "new")
    assert (tmp_path / "new" / "a_part.step").read_bytes() == TEXT


@pytest.mark.parametrize(
    "name",
    [
        "../a.step",
        "/etc/a.step",
        "C:\\a.step",
        "C:a.step",
        "a.txt",
        "",
        "a\x00.step",
        "b/../../a.stp",
    ],
)
def test_a_model_never_leads_out_of_the_folder_of_the_plan(name: str, tmp_path: Path) -> None:
    plan = msgspec.structs.replace(demo_plan(), model=CadModel(file=name, sha256="0" * 64))
    with pytest.raises(InputError, match=r"model\.file"):
        save_plan(plan, tmp_path / "p.toml")


def test_a_hash_that_is_none_is_refused(tmp_path: Path) -> None:
    plan = msgspec.structs.replace(demo_plan(), model=CadModel(file="a.step", sha256="0"))
    with pytest.raises(InputError, match=r"model\.sha256"):
        save_plan(plan, tmp_path / "p.toml")


def test_what_is_no_model_is_not_taken(tmp_path: Path) -> None:
    for name, content in (("a.step", b"no"), ("a.txt", TEXT)):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match="not a STEP file"):
            with_model(demo_plan(), tmp_path / "p.toml", tmp_path / name)
    with pytest.raises(InputError, match="Save the plan first"):
        with_model(demo_plan(), None, tmp_path / "a.step")


def test_the_part_of_a_plan_comes_from_where_it_is_kept(tmp_path: Path) -> None:
    plan, file, part = beside(tmp_path)
    found = part_of_plan(plan, file.parent)
    assert found.doubt is None
    assert found.model is not None
    np.testing.assert_array_equal(found.model.vertices, part.vertices)
    assert part_of_plan(msgspec.structs.replace(plan, model=None), file.parent).model is None
    assert part_of_plan(plan, None).model is None


@pytest.mark.parametrize("content", [TEXT + b"changed", None])
def test_a_model_that_was_changed_or_is_gone_is_not_shown(
    content: bytes | None, tmp_path: Path
) -> None:
    plan, file, _ = beside(tmp_path)
    model = file.parent / "a_part.step"
    if content is None:
        model.unlink()
    else:
        model.write_bytes(content)
    found = part_of_plan(plan, file.parent)
    assert found.model is None
    assert found.doubt is not None
    assert "the part is not shown" in found.doubt.what


def test_what_is_kept_and_damaged_is_made_anew(tmp_path: Path) -> None:
    plan, file, part = beside(tmp_path)
    (kept,) = (file.parent / FOLDER).iterdir()
    kept.write_bytes(kept.read_bytes()[:-1])
    assert cached_part(file.parent, part.source_sha256) is None
    # The text is not a model: the reader, or its absence, is reported.
    assert part_of_plan(plan, file.parent).doubt is not None
    # Of another model under this name it is not taken either.
    keep_part(file.parent, block_part())
    (file.parent / FOLDER / f"{'0' * 64}.ocmm-part").rename(kept)
    assert cached_part(file.parent, part.source_sha256) is None


def test_a_folder_that_nobody_can_look_into_keeps_no_part_and_shows_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a folder of another user without read access; an impossible name stops root as well."""
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda _: tmp_path / "cache")
    plan, _, part = beside(tmp_path)
    closed = tmp_path / ("x" * 300)
    assert cached_part(closed, part.source_sha256) is None
    keep_part(closed, part)
    assert cached_part(closed, part.source_sha256) is not None
    found = part_of_plan(plan, closed)
    assert found.model is None
    assert found.doubt is not None
    assert "cannot be read" in found.doubt.what


def test_only_so_many_parts_are_kept(tmp_path: Path) -> None:
    for number in range(MOST_FILES + 5):
        keep_part(tmp_path, replace(block_part(), source_sha256=f"{number:064x}"))
    assert len(list((tmp_path / FOLDER).iterdir())) == MOST_FILES
    assert cached_part(tmp_path, f"{MOST_FILES + 4:064x}") is not None
    assert cached_part(tmp_path, f"{0:064x}") is None


def test_where_the_folder_cannot_be_written_parts_are_kept_for_the_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda _: tmp_path / "cache")
    # A file in place of the folder: nothing can be written into it, even by root.
    (tmp_path / FOLDER).write_bytes(b"")
    keep_part(tmp_path, block_part())
    assert cached_part(tmp_path, "0" * 64) is not None
    assert (tmp_path / "cache" / "parts").is_dir()

"""Pictures of steps are next to their plan; plans in a folder are found."""

from __future__ import annotations

import shutil
from pathlib import Path

import msgspec
import pytest

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.inspection.plan import (
    Plan,
    carry_pictures,
    list_plans,
    load_plan,
    save_plan,
    with_alignment,
    with_head,
    with_picture,
    without_file,
)

PNG = b"\x89PNG\r\n\x1a\n" + b"\0" * 40
JPEG = b"\xff\xd8\xff\xe0" + b"\0" * 40


@pytest.fixture
def plan() -> Plan:
    return load_plan(resource("plans", "gauge.toml"))


@pytest.fixture
def file(plan: Plan, tmp_path: Path) -> Path:
    """Return a plan in a separate folder."""
    path = tmp_path / "plans" / "gauge.toml"
    path.parent.mkdir()
    save_plan(plan, path)
    return path


def _picture(plan: Plan, feature: str) -> str:
    return plan.feature(feature).picture


def test_a_picture_is_copied_beside_the_plan_and_nothing_is_written_over(
    plan: Plan, file: Path, tmp_path: Path
) -> None:
    source = tmp_path / "Bohrung links (1).PNG"
    source.write_bytes(PNG)
    once = with_picture(plan, file, "BORE_A", source)
    assert _picture(once, "BORE_A") == "Bohrung_links_1.png"
    assert (file.parent / "Bohrung_links_1.png").read_bytes() == PNG
    # The same bytes are the same file, others get a number.
    assert _picture(with_picture(once, file, "BORE_B", source), "BORE_B") == "Bohrung_links_1.png"
    source.write_bytes(PNG + b"other")
    other = with_picture(once, file, "BORE_B", source)
    assert _picture(other, "BORE_B") == "Bohrung_links_1-2.png"
    assert (file.parent / "Bohrung_links_1.png").read_bytes() == PNG
    save_plan(other, file)
    assert without_file(load_plan(file), file.parent) == []
    # What lies there already is named as it is.
    inner = file.parent / "steps" / "b.jpeg"
    inner.parent.mkdir()
    inner.write_bytes(JPEG)
    assert _picture(with_picture(other, file, "BED", inner), "BED") == "steps/b.jpeg"


@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("a.png", JPEG, "plan.no_picture"),
        ("a.svg", b"<svg/>", "plan.no_picture"),
        ("a.png", PNG + b"\0" * 20_000_001, "plan.large_picture"),
        ("a.png", None, "document.missing"),
    ],
)
def test_what_is_no_picture_is_refused(
    plan: Plan, file: Path, tmp_path: Path, name: str, content: bytes | None, code: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as caught:
        with_picture(plan, file, "BED", tmp_path / name)
    assert caught.value.code == code
    assert [path.name for path in file.parent.iterdir()] == ["gauge.toml"]


def test_a_picture_needs_a_file_of_the_plan_and_a_step(
    plan: Plan, file: Path, tmp_path: Path
) -> None:
    source = tmp_path / "a.png"
    source.write_bytes(PNG)
    with pytest.raises(InputError, match="Save the plan first"):
        with_picture(plan, None, "BED", source)
    with pytest.raises(InputError, match="Select the feature"):
        with_picture(plan, file, "Bore A diameter", source)


def test_pictures_go_with_a_plan_to_another_folder(plan: Plan, file: Path, tmp_path: Path) -> None:
    bed = msgspec.structs.replace(plan.features[0], picture="steps/bed.png")
    ball = msgspec.structs.replace(plan.features[1], picture="gone.png")
    plan = msgspec.structs.replace(plan, features=[bed, ball, *plan.features[2:]])
    (file.parent / "steps").mkdir()
    (file.parent / "steps" / "bed.png").write_bytes(PNG)
    carry_pictures(plan, file.parent, tmp_path)
    assert (tmp_path / "steps" / "bed.png").read_bytes() == PNG
    assert without_file(plan, tmp_path) == [ball.name]
    assert without_file(plan, None) == [bed.name, ball.name]


def test_plans_of_a_folder_are_listed_and_the_rest_is_left_out(file: Path) -> None:
    (file.parent / "rig.toml").write_text('schema = "ocmm.rig/1"\n')
    (file.parent / "a.toml").write_bytes(resource("plans", "demo.toml").read_bytes())
    cards = list_plans(file.parent)
    assert [(card.name, card.path.name) for card in cards] == [
        ("DEMO", "a.toml"), ("GAUGE", "gauge.toml"),
    ]  # fmt: skip
    assert list_plans(file.parent / "nowhere") == ()
    for number in range(220):
        shutil.copy(file, file.with_name(f"many-{number:03d}.toml"))
    assert len(list_plans(file.parent)) == len(cards) + 220


def test_head_and_alignment_are_changed_and_checked(plan: Plan) -> None:
    changed = with_head(plan, msgspec.structs.replace(plan, name="P", rule="simple", features=[]))
    assert (changed.name, changed.rule, changed.features) == ("P", "simple", plan.features)
    with pytest.raises(InputError, match="invisible format"):
        with_head(plan, msgspec.structs.replace(plan, part="a\u202eb"))
    assert plan.alignment is not None
    wrong = msgspec.structs.replace(plan.alignment, primary="NOWHERE")
    with pytest.raises(InputError, match=r"alignment\.primary"):
        with_alignment(plan, wrong)

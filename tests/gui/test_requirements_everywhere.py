"""A verdict on the part is never shown without the requirements that its plan lacks."""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QApplication, QWidget

from benchmarks.house_tree import ROOTS
from ocmm_cli.measure import print_verdict
from ocmm_cli.terminal import PlainConsole
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.export import EXPORTERS
from ocmm_core.export.report import load_profile, polyworks_profile
from ocmm_core.inspection.evaluation import PARTIAL_PLAN, JobView, part_line, state_lines
from ocmm_core.station.stream import verdict_line
from ocmm_core.tolerances.decisions import PartWord, RequirementCount
from ocmm_core.tracking import load_probe
from ocmm_gui.kit import counted_line, make_actions
from ocmm_gui.operator import DeskView, FarView
from tests.core.export.sample_report import sample_report
from tests.generated_jobs import generated_job
from tests.gui.pdf_texts import pages
from tests.host import amount

CASES, CHUNKS = amount(20, 500), 10
ROOT = Path(__file__).resolve().parents[2]
_STATED = re.compile(r"(\d+) of (\d+) requirements of the (model|QIF document|table|sources)")
_WORDS = tuple(one.value for one in PartWord if one is not PartWord.NOT_PROVEN)
"""Words of parts alone: characteristics can be NOT PROVEN as well."""
_TAGS = re.compile(r"<[^>]+>")


@pytest.fixture(scope="module")
def screens(qapp: QApplication) -> Iterator[tuple[FarView, DeskView]]:
    """Return the views that show a verdict while a job is measured."""
    rig = load_rig(resource("rigs", "recommended.toml"))
    body = load_probe(resource("probes", "standard.toml"))
    parent = QWidget()
    actions = make_actions(parent)
    far, desk = FarView(actions), DeskView(rig, body, actions)
    far.resize(1280, 720)
    desk.resize(1280, 720)
    yield far, desk
    for widget in (far, desk, parent):
        widget.close()
        widget.deleteLater()


def counted_job(seed: int) -> tuple[JobView, RequirementCount | None]:
    """Return a job in any state, by a plan without a source, with all, or with less than all."""
    rng = np.random.default_rng(seed)
    job, _ = generated_job(seed)
    total = int(rng.integers(1, 100))
    present = total if rng.random() < 0.3 else int(rng.integers(0, total))
    notes = int(rng.integers(0, 3))
    origin = str(rng.choice(["model", "QIF document", "table", "sources"]))
    count = None if rng.random() < 0.2 else RequirementCount(present, total, notes, origin)
    return replace(job, requirements=count), count


def shown_by_screens(screens: tuple[FarView, DeskView], job: JobView) -> dict[str, str]:
    found = {"results": counted_line(job)}
    views: dict[str, FarView | DeskView] = {"far view": screens[0], "measure panel": screens[1]}
    for name, view in views.items():
        view.show_job(job)
        found[name] = f"{view.part.word()} {' '.join(view.part.lines())}"
        found[f"{name}, read aloud"] = view.part.accessibleDescription()
    return found


def printed(job: JobView) -> str:
    stream = io.StringIO()
    print_verdict(PlainConsole(file=stream, width=60), job)
    return stream.getvalue()


def plain(content: bytes) -> str:
    """Return the text of a file, also of a workbook."""
    if content.startswith(b"PK"):
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            parts = [archive.read(name) for name in archive.namelist() if name.endswith(".xml")]
        return _TAGS.sub(" ", " ".join(part.decode() for part in parts))
    return content.decode("utf-16" if content.startswith(b"\xff\xfe") else "utf-8", "replace")


def says(text: str, count: RequirementCount) -> bool:
    """Return whether a text states the count, in lines of any width."""
    found = _STATED.findall(" ".join(text.split()))
    return found != [] and set(found) == {(str(count.present), str(count.total), count.origin)}


def check(where: str, text: str, job: JobView, count: RequirementCount | None, seed: int) -> None:
    flat = " ".join(text.split())
    if count is None:
        assert "requirements of the" not in flat, (seed, where)
        return
    has_verdict = any(word in flat for word in _WORDS)
    if has_verdict and not count.is_whole:
        assert says(flat, count), (seed, where, flat[:300])


def test_every_verdict_on_a_screen_states_what_its_plan_lacks(
    screens: tuple[FarView, DeskView],
) -> None:
    partial = 0
    for seed in range(CASES):
        job, count = counted_job(seed)
        told = shown_by_screens(screens, job)
        told |= {"compare": part_line(job), "stream": verdict_line(job, 1).decode()}
        told["terminal"] = printed(job)
        for where, text in told.items():
            check(where, text, job, count, seed)
        is_partial = count is not None and not count.is_whole
        assert any(PARTIAL_PLAN in line for line in state_lines(job)) == is_partial
        last = told["terminal"].strip().splitlines()[-1]
        # A script that reads the last line alone must not find the bare word.
        assert (last == job.part_verdict.word.value) == (not is_partial), seed
        partial += is_partial
    assert partial > CASES // 3


@pytest.mark.usefixtures("qapp")
@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_every_file_with_a_verdict_states_what_the_plan_lacks(chunk: int) -> None:
    profiles = [polyworks_profile(), load_profile(resource("profiles", "european.toml"))]
    for seed in range(chunk, CASES, CHUNKS):
        job, count = counted_job(seed)
        data = sample_report(job, nominals=generated_job(seed)[1])
        files: dict[str, bytes] = {}
        for exporter in EXPORTERS.values():
            if job.characteristics or exporter.name != "dfq":
                files |= exporter.contents((data,), profiles[seed % 2])
        is_partial = count is not None and not count.is_whole
        for name, content in files.items():
            assert ("PARTIAL_PLAN" in name) == is_partial, (seed, name)
            check(name, plain(content), job, count, seed)
            if b"PASS" in content and name.endswith(".qif") and is_partial:
                assert b"<InspectionStatusEnum>PASS" not in content, seed
        first, *others = pages(data)
        check("page 1", first, job, count, seed)
        if is_partial:
            assert count is not None
            assert says(first, count), seed
            assert all(PARTIAL_PLAN in page for page in others), seed


def test_the_bare_word_is_used_in_known_places_only() -> None:
    """Each place shows the count next to the word, or fills a column with a fixed set of words."""
    known = {
        "ocmm_core/export/report/_xlsx.py", "ocmm_shop/archive/records/_extract.py",
        "ocmm_gui/kit/_messages.py", "ocmm_gui/reports/_sections.py",
        "ocmm_serve/screen/_snapshot.py",
    }  # fmt: skip
    used = re.compile(r"(?:\bpart|part_verdict)\.word\.value")
    found = {
        path.relative_to(ROOT).as_posix()
        for folder in ROOTS
        for path in (ROOT / folder).rglob("*.py")
        if used.search(path.read_text(encoding="utf-8"))
    }
    assert found == known

"""Every wizard provides all fields for start page, sessions, runner and window."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from typing import Any

import pytest
from pytestqt.qtbot import QtBot

from ocmm_core.calibration.guided import ProcedureKind
from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_gui.kit import ACTIONS, Mode
from ocmm_gui.wizards import _registry as registry
from ocmm_gui.wizards import _wizard as _sessions
from ocmm_gui.wizards._registry import WIZARDS, WizardSpec, wizard_of
from ocmm_gui.wizards._site import OpenSession
from ocmm_gui.wizards._wizard_parts import WIZARD_ACTIONS
from ocmm_gui.wizards.pages import WHO, StepPage
from tests.core.calibration.test_procedure_tip import TIP, Tips
from tests.gui.wizard_bench import WizardBench

_POINTS = (
    "# ocmm reference points\n# unit: mm\n# uncertainty: 0.002\n# frame: CMM\n"
    "name;x;y;z\nP1;0;0;0\nP2;50;0;0\n"
)


def _kind_of(spec: WizardSpec[Any]) -> str:
    return spec.kind.value


@pytest.fixture
def bench(qtbot: QtBot, tmp_path: Path) -> Iterator[WizardBench]:
    """Return a bench on which every wizard can begin."""
    made = WizardBench(qtbot, tmp_path, TIP)
    made.bench.calibrated(120)
    Tips.at(tmp_path, qualified=True)
    (tmp_path / "points.csv").write_text(_POINTS)
    yield made
    made.wizard.close_runner()
    made.wizard.close()
    made.wizard.deleteLater()


def _of_kind(bench: WizardBench, spec: WizardSpec[Any]) -> None:
    """Put a tracker on the bench if the wizard is for trackers."""
    if not spec.applies(bench.site.rig):
        rig = load_rig(resource("rigs", "tracker.toml"))
        bench.site = dataclasses.replace(bench.site, rig=rig, store=bench.bench.folder / "tracker")
        assert spec.applies(rig)


def _begun(bench: WizardBench, spec: WizardSpec[Any]) -> OpenSession:
    """Return a session started with the proposed fields."""
    _of_kind(bench, spec)
    values = {
        one.key: one.choices[0][0] if one.choices else one.proposal
        for one in _sessions.fields(bench.site, spec)
    }
    if "points" in values:
        values["points"] = str(bench.bench.folder / "points.csv")
    return _sessions.start_session(bench.site, spec, values, bench.bench.now())


def test_each_kind_of_procedure_has_one_wizard() -> None:
    assert sorted(spec.kind for spec in WIZARDS) == sorted(ProcedureKind)
    assert all(wizard_of(spec.kind) is spec for spec in WIZARDS)
    assert len({spec.action for spec in WIZARDS}) == len(WIZARDS)
    assert len({spec.texts.title for spec in WIZARDS}) == len(WIZARDS)
    actions = {info.key for info in ACTIONS if info.opens_wizard}
    assert {spec.action for spec in WIZARDS} == actions


@pytest.mark.parametrize("spec", WIZARDS, ids=_kind_of)
def test_an_entry_lacks_nothing(spec: WizardSpec[Any]) -> None:
    texts = spec.texts
    for words in (texts.purpose, texts.accepted):
        assert words[0].isupper()
        assert words.endswith((".", "?"))
    for words in (texts.title, texts.ends.accept, texts.ends.keep):
        assert words[0].isupper()
        assert not words.endswith(".")
    assert texts.ends.accepts.endswith("?")
    assert texts.ends.keeps.endswith("?")
    assert [info.mode for info in ACTIONS if info.key == spec.action] == [Mode.MAINTAIN]
    assert set(spec.commands) <= {info.key for info in WIZARD_ACTIONS}
    assert {one.name for one in dataclasses.fields(WizardSpec)} == {
        "procedure", "action", "texts", "fields", "setup", "pages", "is_slow", "predict",
        "commands",
    }, "a new field of an entry needs a check here"  # fmt: skip


@pytest.mark.parametrize("spec", WIZARDS, ids=_kind_of)
def test_a_session_begins_goes_on_and_has_its_pages(
    bench: WizardBench, spec: WizardSpec[Any]
) -> None:
    _of_kind(bench, spec)
    asked = _sessions.fields(bench.site, spec)
    assert next(one for one in asked if one.key == WHO.key).proposal == bench.site.who
    assert all(one.label and one.tip for one in asked)
    opened = _begun(bench, spec)
    base = opened.procedure.base
    # As sent to the process that calculates.
    assert ForkingPickler.dumps((spec.procedure.resume, opened.site, base.session))
    assert base.kind is spec.kind
    again = _sessions.resume(bench.site, spec, base.session)
    assert again.procedure.base.begun_utc == base.begun_utc
    assert [offer.path for offer in _sessions.offers(bench.site, spec)] == [base.session]
    pages = spec.pages(opened.site, opened.procedure)
    for page in pages.values():
        bench.qtbot.addWidget(page)
    # Every step has its page, and no page is without a step.
    assert set(pages) == {step.name for step in base.steps}
    assert all(isinstance(page, StepPage) for page in pages.values())
    keys = {key for page in pages.values() for key in page.keys}
    assert set(spec.commands) == keys & {"skip", "repeat", "anew"}
    assert all(callable(command(opened.procedure)) for command in spec.commands.values())
    assert (opened.predict is None) is (spec.predict is None)


def test_a_kind_without_a_wizard_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "WIZARDS", WIZARDS[1:])
    with pytest.raises(InputError, match="No wizard for known-points") as caught:
        wizard_of(ProcedureKind.KNOWN_POINTS)
    assert caught.value.remedy

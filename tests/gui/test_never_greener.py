"""Over many jobs no screen, sound or paper promises more than the worst characteristic."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import pytest
from PySide6.QtWidgets import QApplication

from ocmm_core.camera import load_rig
from ocmm_core.documents import resource
from ocmm_core.inspection.evaluation import FeatureState, JobView
from ocmm_core.tolerances.decisions import LOWEST_TUR, WORST_FIRST, PartWord, Verdict
from ocmm_core.tracking import load_probe
from ocmm_gui.kit import NoticeCentre, Sound, SoundPlayer, counted_line, make_actions
from ocmm_gui.operator import DeskView, FarView, Feedback
from ocmm_gui.results._result_table import ResultTable
from tests.core.export.sample_report import sample_report
from tests.generated_jobs import generated_job, is_greener
from tests.gui.pdf_texts import pages
from tests.host import amount

JOBS = amount(100, 1000)
CHUNKS = 4
_WORDS = re.compile(
    r"DOES NOT CONFORM|NOT CONFORM|NOT PROVEN|NOT MEASURED|NOT COMPLETE|PROVISIONAL|CONFORMS?|DONE"
)
_PROMISE = {
    "DOES NOT CONFORM": Verdict.NOT_CONFORM,
    "NOT COMPLETE": Verdict.NOT_MEASURED,
    "CONFORMS": Verdict.CONFORM,
    "DONE": Verdict.CONFORM,
}
_HEARD = {
    Sound.FEATURE_COMPLETE: Verdict.CONFORM,
    Sound.IN_DOUBT: Verdict.NOT_PROVEN,
    Sound.OUT_OF_TOLERANCE: Verdict.NOT_CONFORM,
}


def promises(text: str) -> list[Verdict]:
    """Return the verdicts that a text names; DONE counts as the greenest."""
    return [_PROMISE.get(word) or Verdict(word) for word in _WORDS.findall(text)]


def worst(verdicts: list[Verdict]) -> Verdict | None:
    return min(verdicts, key=WORST_FIRST.index, default=None)


def truth(job: JobView, feature: str) -> Verdict | None:
    return worst([item.verdict for item in job.characteristics if feature in item.features])


class _Ear(SoundPlayer):
    """Hears instead of playing: the loudspeaker is the one part that is not there."""

    def __init__(self) -> None:
        super().__init__(enabled=False)
        self.heard: list[Sound] = []

    def play(self, sound: Sound) -> None:
        self.heard.append(sound)


@pytest.fixture(scope="module")
def screens(qapp: QApplication) -> Iterator[tuple[FarView, DeskView, ResultTable]]:
    """Return the far view, the desk view and the table of results."""
    rig = load_rig(resource("rigs", "recommended.toml"))
    body = load_probe(resource("probes", "standard.toml"))
    table = ResultTable()
    actions = make_actions(table)
    far, desk = FarView(actions), DeskView(rig, body, actions)
    for widget in (far, desk, table):
        widget.resize(1280, 720)
    yield far, desk, table
    for widget in (far, desk, table):
        widget.close()
        widget.deleteLater()


@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_no_screen_is_greener_than_the_worst_characteristic(
    screens: tuple[FarView, DeskView, ResultTable], chunk: int
) -> None:
    far, desk, table = screens
    for seed in range(chunk, JOBS, CHUNKS):
        job, _ = generated_job(seed)
        part = job.part_verdict
        everything = worst([item.verdict for item in job.characteristics])
        whole = all(item.state is FeatureState.DONE for item in job.features)
        good = everything is Verdict.CONFORM and whole
        assert (part.word is PartWord.CONFORMS) == good, seed

        for view in (far, desk):
            view.show_job(job)
        table.show_job(job)
        shown = job.shown
        for said in (far.part.word(), desk.part.word(), counted_line(job)):
            assert good or "CONFORMS" not in said, (seed, said)
        # One word for one thing: NOT COMPLETE is not called INCOMPLETE next to it.
        line = counted_line(job)
        assert not ("INCOMPLETE" in line and PartWord.NOT_COMPLETE.value in line), (seed, line)
        if job.shows_part:
            assert far.verdict.text() == "", seed
        elif shown is not None:
            for said in (far.verdict.text(), desk.feature.verdict.text()):
                _expect(truth(job, shown.name), said, seed)
        for row, feature in enumerate(job.features):
            said = desk.plan.item(row).text()
            if feature.state is FeatureState.DONE:
                _expect(truth(job, feature.name), said, seed)
            else:
                assert not promises(said), (seed, said)
        for row, result in enumerate(job.characteristics):
            assert promises(table.cells(row)[-1]) == [result.verdict], seed


def _expect(verdict: Verdict | None, said: str, seed: int) -> None:
    found = promises(said)
    if verdict is None:
        assert "CONFORM" not in said, (seed, said)
    else:
        assert found == [verdict], (seed, said, verdict)


def test_no_sound_is_greener_than_the_worst_characteristic(
    screens: tuple[FarView, DeskView, ResultTable],
) -> None:
    far, _, _ = screens
    ear = _Ear()
    feedback = Feedback(ear, NoticeCentre(), lambda: far.readout)
    heard = 0
    for seed in range(JOBS):
        job, _ = generated_job(seed)
        done = [item for item in job.features if item.state is FeatureState.DONE]
        if not done:
            continue
        last = done[-1].name
        before = replace(
            job,
            features=tuple(
                replace(item, state=FeatureState.ACTIVE) if item.name == last else item
                for item in job.features
            ),
            active=last,
            complete=False,
            looked_at="",
        )
        ear.heard.clear()
        feedback.announce(before, job)
        verdicts = [truth(job, last)]
        if job.complete:
            verdicts += [item.verdict for item in job.characteristics]
        told = worst([verdict for verdict in verdicts if verdict is not None])
        for sound in ear.heard:
            heard += 1
            assert told is None or not is_greener(_HEARD[sound], told), (seed, sound, told)
            assert not (job.complete and not job.part_verdict.complete) or (
                sound is not Sound.FEATURE_COMPLETE
            ), seed
    assert heard >= JOBS // 2
    ear.close()


@pytest.mark.usefixtures("qapp")
@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_no_page_is_greener_than_the_worst_characteristic(chunk: int) -> None:
    for seed in range(chunk, JOBS, CHUNKS):
        job, nominals = generated_job(seed)
        said = pages(sample_report(job, nominals=nominals))[0]
        word = job.part_verdict.word.value
        assert word in said, seed
        for other in PartWord:
            assert other is PartWord.NOT_PROVEN or other.value == word or other.value not in said
        told = Counter(promises(said))
        green = sum(item.verdict is Verdict.CONFORM for item in job.characteristics)
        # The first page may end before the last characteristic, and features repeat theirs.
        greens = green + len(job.features) + (word == PartWord.CONFORMS.value) + 1
        assert told[Verdict.CONFORM] <= greens, seed
        assert ("SIMULATED" in said) == job.simulated, seed
        assert ("INCOMPLETE" in said) == (not job.part_verdict.complete), seed


def test_ratio_and_verdict_never_contradict() -> None:
    found = 0
    for seed in range(JOBS):
        for result in generated_job(seed)[0].characteristics:
            if result.tur is None:
                continue
            found += 1
            assert result.verdict is not Verdict.CONFORM or result.tur >= LOWEST_TUR
            assert "smaller than twice" not in result.note or result.tur < LOWEST_TUR
    assert found > JOBS

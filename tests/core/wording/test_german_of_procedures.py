"""Sentences of every procedure in German, without English words.

An English word is in the English catalogue and not in the German one.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import msgspec
import pytest

from docs.make_core_texts import TEXTS, load_shown
from ocmm_core.acceptance import AcceptanceSession
from ocmm_core.calibration.guided import ProcedureView
from ocmm_core.calibration.verification import VerificationProcedure, VerificationSetup
from ocmm_core.documents import resource
from ocmm_core.wording import Pattern, Speech
from tests.core.acceptance.acceptance_site import BEGIN, ROOM, Machine, stage_of
from tests.core.calibration.pivot_site import PivotBench
from tests.core.calibration.procedure_site import Bench
from tests.core.calibration.test_procedure_relocation import begin as begin_relocation
from tests.core.calibration.test_procedure_tip import Tips

GERMAN = Speech("de")
_WORD = re.compile(r"(?<![\w„'./-])[^\W\d_]{3,}(?![\w'/-])")
PLANNED = sorted(
    path.stem for path in Path(resource("acceptance", "interim.toml")).parent.glob("*.toml")
)


def _words(texts: Iterable[str]) -> set[str]:
    return {word for text in texts for part in Pattern.from_template(text).literals for word in
            _WORD.findall(part)}  # fmt: skip


@cache
def english_words() -> frozenset[str]:
    stored, shown = json.loads((TEXTS / "core.json").read_text("utf-8")), load_shown("de")
    said = _words(stored["sentences"]) | set(stored["words"])
    return frozenset(said - _words(shown.sentences.values()) - set(shown.words.values()))


def english_in(sentence: str) -> list[str]:
    """Return the English words in the German form of a sentence, names in quotes aside."""
    german = re.sub(r"„[^“]*“|'[^']*'", "", GERMAN.text(sentence))
    return [word for word in _WORD.findall(german) if word in english_words()]


def sentences_of(view: ProcedureView) -> Iterator[str]:
    for step in view.steps:
        yield from (step.title, step.instruction, step.gate.reason, step.gate.remedy)
    yield view.live.hint


def check(sentences: Iterable[str]) -> None:
    assert [(one, found) for one in dict.fromkeys(sentences) if (found := english_in(one))] == []


def _plannable() -> list[str]:
    kinds = {path: msgspec.toml.decode(resource("acceptance", f"{path}.toml").read_bytes())
             for path in PLANNED}  # fmt: skip
    return [one["id"] for one in kinds.values() if one["id"] != "PART-U"]


@pytest.mark.parametrize("name", _plannable())
def test_acceptance_tests_have_german_tasks_and_results(name: str, tmp_path: Path) -> None:
    stage, digest = stage_of(name)
    session = AcceptanceSession.start(
        tmp_path / "a.chain", stage, digest, BEGIN, temperature=ROOM, who="tester"
    )
    machine, said = Machine(), [session.view.title, session.view.instruction]
    while session.view.current >= 0:
        assert machine.step(session) == ""
        said.append(session.view.instruction)
    view = session.view
    assert not any(re.search(r"-0\b(?!\.)", one) for one in said)
    assert all(" mm in the world frame" in one for one in said[1:-1])
    check([*said, *(one.name for one in view.values), *(one.quantity for one in view.values),
           *(one.position for one in view.values)])  # fmt: skip


def test_procedures_of_cameras_have_german_steps(tmp_path: Path) -> None:
    bench = Bench.at(tmp_path)
    rig = bench.calibrated()
    verification = VerificationProcedure.start(
        bench.site(rig),
        VerificationSetup(who="technician", spheres=(bench.sphere,), bar=bench.bar),
        bench.now(),
    )
    for procedure in (bench.known_points(), verification, begin_relocation(bench, rig)):
        check(sentences_of(procedure.view.base))


def test_procedures_of_probes_have_german_steps(tmp_path: Path) -> None:
    check(sentences_of(PivotBench(tmp_path / "pivot").begin().base))
    tips = Tips.at(tmp_path, qualified=True)
    check(sentences_of(tips.qualification().base))
    check(sentences_of(tips.check().base))


def test_an_english_word_is_found() -> None:
    assert english_in("sphere 1: touch the point there.") != []

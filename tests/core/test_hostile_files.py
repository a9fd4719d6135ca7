"""Hostile documents, tables, points and recordings, and parsers with damaged input."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.fuzz import run
from ocmm_bench.campaign import Forgery, document_kinds, points_kinds, recording_kinds, table_kinds
from ocmm_core.camera import load_rig
from ocmm_core.documents import LARGEST_DOCUMENT, read_bytes, read_text, resource
from ocmm_core.errors import InputError, OcmmError
from ocmm_core.export.report import load_profile
from ocmm_core.features.shapes import read_points_file
from ocmm_core.inspection.plan import feature_table, load_plan
from ocmm_core.tracking import load_probe, load_reference
from ocmm_sim.scene import load_part
from tests.core.acquisition.recording_samples import read_recording, sample_recording
from tests.core.fuzz_targets import PARSERS

LONGEST_S = 5.0
"""Processor time of one file; a key of 20,000 parts took as long with the parser alone."""
EXECUTIONS, SECONDS = 150, 2.0
CORPUS = Path(__file__).resolve().parents[1] / "corpus"
LOADERS: dict[str, tuple[Path, Callable[[Path], object]]] = {
    "plan": (resource("plans", "demo.toml"), load_plan),
    "rig": (resource("rigs", "recommended.toml"), load_rig),
    "probe": (resource("probes", "standard.toml"), load_probe),
    "part": (resource("parts", "demo.toml"), load_part),
    "reference": (next(resource("references").glob("*.toml")), load_reference),
    "profile": (resource("profiles", "polyworks.toml"), load_profile),
}


SLOW = ("many tables", "a million rows", "5 MB")
"""Kinds that take seconds; of documents only the plan is given them."""
KINDS: list[tuple[Forgery, Callable[[Path], object]]] = [
    *((kind, load) for word, (good, load) in LOADERS.items()
      for kind in document_kinds(word, good.read_text("utf-8"), 25, seed=2)
      if word == "plan" or not kind.name.endswith(SLOW)),
    *((kind, read_points_file) for kind in points_kinds() if not kind.name.endswith(SLOW)),
    *((kind, feature_table) for kind in table_kinds()),
    *((kind, read_recording) for kind in recording_kinds(sample_recording())),
]  # fmt: skip
SHAPES = ("one point", "the same point", "a line", "1e9", "serials", "a text", "tiny")
"""Accepted by the reader of a file, and refused by a fit or a rig."""


@pytest.mark.parametrize(("kind", "load"), KINDS, ids=lambda one: getattr(one, "name", ""))
def test_a_hostile_file_is_refused_in_one_sentence(
    tmp_path: Path, kind: Forgery, load: Callable[[Path], object]
) -> None:
    path = tmp_path / "file"
    kind.make(path, path)
    begun = time.thread_time()
    told = None
    try:
        load(path)
    except OcmmError as error:
        told = error.what
    assert time.thread_time() - begun < LONGEST_S
    if told is None:
        assert kind.harmless or any(word in kind.name for word in SHAPES)
    else:
        assert str(path) in told
        assert len(told) < 2500


@pytest.mark.parametrize("name", sorted(PARSERS))
def test_damaged_samples_end_in_our_own_words(name: str) -> None:
    told: list[str] = []
    found = run(
        PARSERS[name](), EXECUTIONS, SECONDS, seed=5, tell=lambda words, _: told.append(words)
    )
    assert found.done > 0
    assert found.refused > 0
    assert found.faults == {}
    assert told == []


@pytest.mark.parametrize("path", sorted(CORPUS.iterdir()), ids=lambda path: path.name)
def test_what_broke_a_parser_once_does_so_no_more(path: Path, tmp_path: Path) -> None:
    parse = PARSERS[path.name.partition("-")[0]]().opened(tmp_path)
    with pytest.raises(OcmmError):
        parse(path.read_bytes())


def test_a_file_is_read_up_to_a_size(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(b"x" * 11)
    assert read_bytes(path, 11) == b"x" * 11
    with pytest.raises(InputError, match="11 bytes, and at most 10"):
        read_bytes(path, 10)
    assert 10 * resource("plans", "demo.toml").stat().st_size < LARGEST_DOCUMENT


def test_a_text_that_is_none_is_named_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes("a\nb\nZoë".encode("latin-1"))
    with pytest.raises(InputError, match="byte 6, in line 3, is not UTF-8"):
        read_text(path)

"""What the registry of sources names is there to be called."""

from __future__ import annotations

from importlib import import_module

from ocmm_core.composition import SOURCES


def test_every_source_names_makers_that_there_are() -> None:
    made_in = import_module("ocmm_core.composition._feed_makers")
    makers = [
        getattr(maker, "__name__", "")
        for spec in SOURCES
        for maker in (spec.make, spec.segment, spec.scenes)
        if maker is not None
    ]
    assert len(makers) >= len(SOURCES)
    assert [name for name in makers if not callable(getattr(made_in, name, None))] == []

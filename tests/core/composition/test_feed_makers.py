"""Every name in the registry of sources can be called."""

from __future__ import annotations

from importlib import import_module

from ocmm_core.composition import sources


def test_every_source_names_makers_that_there_are() -> None:
    makers = [
        (maker.__module__, maker.__name__)
        for spec in sources()
        for maker in (spec.make, spec.segment, spec.scenes, spec.hand)
        if maker is not None
    ]
    assert len(makers) >= len(sources())
    missing = [
        (home, name)
        for home, name in makers
        if not callable(getattr(import_module(home), name, None))
    ]
    assert missing == []

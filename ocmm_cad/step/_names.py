"""Names of features: from the model if it has some, else shape and place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from ocmm_core.features.shapes import NominalFeature, Shape
from ocmm_core.names import LONGEST_NAME, usable_name

_ROOM_FOR_NUMBER = 5
_ALONG = 1.0 - 1e-9
_WORDS = {Shape.PLANE: "PLANE", Shape.CONE: "CONE", Shape.SPHERE: "SPHERE", Shape.TORUS: "TORUS"}


def feature_names(features: Sequence[NominalFeature], said: Sequence[str]) -> list[str]:
    """Return a unique valid name for each feature, from its name in the model if any."""
    own = [_usable(word) for word in said]
    short = [name or _what(one, fully=False) for name, one in zip(own, features, strict=True)]
    often = Counter(short)
    wanted = [
        name if own[place] or often[name] == 1 else _what(features[place], fully=True)
        for place, name in enumerate(short)
    ]
    taken: set[str] = set()
    names = []
    for name in wanted:
        number, free = 1, name
        while free in taken:
            number += 1
            free = f"{name[: LONGEST_NAME - _ROOM_FOR_NUMBER]} {number}"
        taken.add(free)
        names.append(free)
    return names


def _usable(word: str) -> str:
    return usable_name(word, LONGEST_NAME - _ROOM_FOR_NUMBER)


def _what(feature: NominalFeature, *, fully: bool) -> str:
    """Return shape and place, such as ``BORE 12.5 X40 Y20``; `fully`: all coordinates."""
    shape = feature.shape
    size = feature.angle_deg if shape is Shape.CONE else feature.diameter
    word = _WORDS.get(shape) or ("BORE" if feature.side == "inner" else "SHAFT")
    told = [word] if shape is Shape.PLANE else [word, _number(size, 2)]
    along = np.abs(np.array(feature.direction))
    axis = int(np.argmax(along)) if along.max() >= _ALONG else -1
    # A plane is located along its normal; round shapes where their axis passes.
    kept = [0, 1, 2]
    if not fully and axis >= 0 and shape is not Shape.SPHERE:
        kept = [axis] if shape is Shape.PLANE else [place for place in kept if place != axis]
    told += [f"{'XYZ'[place]}{_number(feature.point[place], 1)}" for place in kept]
    return " ".join(told)


def _number(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".") or "0"
    return "0" if text == "-0" else text

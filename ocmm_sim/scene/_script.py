from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import msgspec

from ocmm_core.calibration.probe_design import leds_behind_body, load_design, shipped_design
from ocmm_core.camera import load_rig
from ocmm_core.errors import InputError
from ocmm_core.tracking import load_probe, load_reference
from ocmm_sim.scene._artefacts import load_part
from ocmm_sim.scene._rig import VirtualRig
from ocmm_sim.scene._world import WorldOptions

S = TypeVar("S", bound=msgspec.Struct)
"""Kinds of scripts."""


class RigScript(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Serialisable description of a `VirtualRig`, with the paths of its documents."""

    rig: str
    probe: str
    part: str
    touches: tuple[tuple[str, int], ...]
    seed: int
    options: WorldOptions = WorldOptions()
    frame_rate_hz: int = 0
    """`seed`, `options`, `frame_rate_hz`: as in `VirtualRig`; rate 0: as in the rig document."""
    reference: str = ""

    def to_json(self) -> str:
        return msgspec.json.encode(self).decode("utf-8")

    def build(self) -> VirtualRig:
        """Load the documents and return the rig."""
        body = load_probe(Path(self.probe))
        return VirtualRig(
            load_rig(Path(self.rig)),
            body,
            load_part(Path(self.part)),
            self.touches,
            self.seed,
            self.options,
            self.frame_rate_hz or None,
            load_reference(Path(self.reference)) if self.reference else None,
            _behind_body(self.probe, body.identity),
        )


@lru_cache(maxsize=8)
def _behind_body(probe: str, identity: str) -> tuple[int, ...]:
    """Return the LEDs hidden by the body of a probe, by its shipped design, if any.

    Tests half a million directions, so it is cached per probe document by its ``identity``.
    """
    body = load_probe(Path(probe))
    design = shipped_design(body)
    return () if design is None else leds_behind_body(body, load_design(design, body))


def decode_script(text: str | bytes, kind: type[S]) -> S:
    """Return the script in `text`; raise InputError if it is invalid."""
    try:
        return msgspec.json.decode(text, type=kind)
    except msgspec.DecodeError as error:
        raise InputError(
            "simulation.script",
            f"The script of the virtual rig cannot be read: {error}.",
            "Start the virtual rig again with the ocmm command.",
        ) from error

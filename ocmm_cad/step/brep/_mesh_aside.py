"""Meshes of a model, by a fork parallel to the reading of faces, else here; needs OCP."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ocmm_cad.step.brep._document import StepDocument
from ocmm_cad.step.brep._part import part_of
from ocmm_cad.step.brep._solid_mesh import make_mesh, raw_meshes, triangles_of
from ocmm_core.geometry import Float
from ocmm_core.part_model import model_to_bytes
from ocmm_core.processes import Aside


@dataclass(frozen=True, slots=True, eq=False)
class SolidMesh:
    triangles: Float
    """(n, 3, 3), mm."""
    owners: NDArray[np.int64]
    """(n,): face of each, from 0."""
    deflection_mm: float
    """Bound of the distance from the faces."""


class MeshAside:
    """Meshes of a model, to be requested in order: for targets, then the part.

    `source`: name and hash of the file; None without a part. `limit_s`: CPU time of the fork.
    """

    def __init__(
        self,
        document: StepDocument,
        faces: Sequence[Any],
        source: tuple[str, str] | None,
        limit_s: float,
    ) -> None:
        self._document, self._faces, self._source = document, faces, source
        self._limit_s = limit_s
        self._aside = Aside(self._work)

    def mesh(self) -> SolidMesh:
        """Return the mesh for targets."""
        triangles, owners, deflection = [self._aside.next(self._limit_s) for _ in range(3)]
        if triangles is None or owners is None or deflection is None:
            return self._made()
        return SolidMesh(
            np.frombuffer(triangles).reshape(-1, 3, 3),
            np.frombuffer(owners, dtype=np.int64),
            float(np.frombuffer(deflection)[0]),
        )

    def part(self, doing: Callable[[str], None]) -> bytes:
        """Return the displayed part as bytes; empty if not requested."""
        if self._source is None:
            return b""
        doing("the part")
        sent = self._aside.next(self._limit_s)
        if sent is None:
            return model_to_bytes(part_of(self._document, self._source, doing))
        return sent

    def end(self) -> None:
        self._aside.end()

    def _made(self) -> SolidMesh:
        deflection = make_mesh(self._document.shape, self._faces)
        return SolidMesh(*triangles_of(raw_meshes(self._faces)), deflection)

    def _work(self, send: Callable[[bytes], None]) -> None:
        mesh = self._made()
        send(mesh.triangles.tobytes())
        send(mesh.owners.tobytes())
        send(np.array([mesh.deflection_mm]).tobytes())
        del mesh
        if self._source is not None:
            send(model_to_bytes(part_of(self._document, self._source, lambda _: None)))

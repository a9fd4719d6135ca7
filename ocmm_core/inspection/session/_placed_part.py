"""The nominal part of a job: what it is, and where it is thought to be."""

from __future__ import annotations

import numpy as np

from ocmm_core.camera import Rig
from ocmm_core.geometry import RigidTransform, rotation_from_vector
from ocmm_core.inspection.evaluation import Whereabouts
from ocmm_core.inspection.session._ledger import JobLedger
from ocmm_core.part_model import PartModel, PlacedPart


class JobPart:
    """Keep the nominal part of a job, as its CAD model has it.

    Parameters
    ----------
    ledger
        Of the job. What its file holds is the part from the beginning.
    """

    def __init__(self, ledger: JobLedger) -> None:
        self._ledger = ledger
        self._model = ledger.job.part()

    @property
    def model(self) -> PartModel | None:
        """Return the part; None where the job has none."""
        return self._model

    def show(self, model: PartModel) -> None:
        """Make a part durable and show it from now on; the first one counts.

        Raises
        ------
        StorageError
            It could not be made durable, and is not shown.
        """
        with self._ledger.lock:
            if self._model is None:
                self._ledger.job.store_part(model)
                self._model = model
                self._ledger.view = None


def placed(model: PartModel | None, place: Whereabouts | None, rig: Rig) -> PlacedPart | None:
    """Return a part where it is thought to be; None where there is none.

    As long as nothing tells where it is, it stands upright in the middle of the volume.
    """
    if model is None:
        return None
    if place is None:
        return PlacedPart(model, _in_the_middle(model, rig), is_rough=True)
    return PlacedPart(model, place.T_nominal_from_world.inverse(), is_rough=place.approximate)


def _in_the_middle(model: PartModel, rig: Rig) -> RigidTransform:
    """Return the motion that puts a part, its z upwards, into the middle of the volume."""
    # Upright is opposite to the columns of the sensors.
    columns = np.mean([camera.T_camera_from_world.rotation[1] for camera in rig.cameras], axis=0)
    axis = int(np.argmax(np.abs(columns)))
    up = -np.sign(columns[axis]) * np.eye(3)[axis]
    turn = np.cross([0.0, 0.0, 1.0], up)
    length = float(np.linalg.norm(turn))
    if length > 0.0:
        rotation = rotation_from_vector(turn / length * np.arctan2(length, up[2]))
    else:
        rotation = np.diag([1.0, np.sign(up[2]), np.sign(up[2])])
    middle = rig.volume_world.mean(axis=0)
    return RigidTransform(rotation, middle - rotation @ model.box.mean(axis=0))

"""Frames stored beyond a job: of a machine, or of a part before it is moved.

The document is TOML (``ocmm.frame/1``) with the hash of its content. A plan copies the required
data (`saved_frame`, `relocation`) with the hash, and does not need the file. The uncertainty of a
saved frame follows from its document.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec
import numpy as np

from ocmm_core.alignment import _rules as rules
from ocmm_core.camera import Vector3
from ocmm_core.documents import Document, load_document, write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.geometry import Float, RigidTransform, triple
from ocmm_core.measuring import FrameDoubt

SCHEMA = "ocmm.frame/1"

_ROTATION_FAULT = 1e-9
_ASYMMETRY = 1e-9
"""Of a covariance, relative to its diagonal; also the allowed rounding below zero."""


class FrameDocument(Document, frozen=True, kw_only=True):
    """Document of a frame; lengths in mm."""

    name: str
    made: str
    """Time of measurement, ISO 8601 with its offset from UTC."""
    source: str
    """Origin: part, serial number, job."""
    rotation: tuple[Vector3, Vector3, Vector3]
    """Rows of the rotation from the world to the frame."""
    translation: Vector3
    """mm, frame."""
    control: tuple[rules.ControlPoint, ...] = ()
    """Points with their places in the frame, to recover it after the part moved; may be empty."""
    covariance: tuple[tuple[float, ...], ...] = ()
    """6 x 6: small rotation, rad, about the frame's axes, shift, mm; empty in older documents."""
    simulated: bool = False
    """Measured on a virtual rig. Omitted if False, to preserve the hashes of older documents."""
    sha256: str = ""
    """Hash of the rest (`content_hash`)."""
    schema: str = SCHEMA
    unit: str = "mm"

    @property
    def T_frame_from_world(self) -> RigidTransform:
        """Return the motion from the world to the frame."""
        return RigidTransform(np.array(self.rotation), np.array(self.translation))


def frame_document(
    name: str,
    made: str,
    source: str,
    T_frame_from_world: RigidTransform,
    control_world: Mapping[str, Float],
    covariance: Float | None = None,
    *,
    simulated: bool = False,
) -> FrameDocument:
    """Return its document; `control_world`: (3,), mm; `covariance`: (6, 6), rad and mm, or None."""
    rows = [triple(row) for row in T_frame_from_world.rotation]
    document = FrameDocument(
        name=name,
        made=made,
        source=source,
        rotation=(rows[0], rows[1], rows[2]),
        translation=triple(T_frame_from_world.translation),
        control=tuple(
            rules.ControlPoint(feature=feature, place=triple(T_frame_from_world.apply(centre)))
            for feature, centre in control_world.items()
        ),
        covariance=() if covariance is None else tuple(map(tuple, covariance.tolist())),
        simulated=simulated,
    )
    return msgspec.structs.replace(document, sha256=content_hash(document))


def content_hash(document: FrameDocument) -> str:
    """Return the SHA-256 of a document without its stored hash."""
    content = msgspec.to_builtins(msgspec.structs.replace(document, sha256=""))
    if not document.covariance:
        # Omit fields newer than older documents: their hashes stay valid.
        del content["covariance"]
    if not document.simulated:
        del content["simulated"]
    return hashlib.sha256(msgspec.json.encode(content, order="sorted")).hexdigest()


def save_frame(path: Path, document: FrameDocument) -> None:
    """Write the document of a frame; StorageError if the file exists or is not writable."""
    if path.exists():
        raise StorageError(
            "frame.exists",
            f"{path}: this file already exists; a frame is never overwritten.",
            "Give another name.",
        )
    try:
        write_atomic(path, _text(document).encode("utf-8"))
    except OSError as error:
        raise StorageError(
            "frame.unwritable",
            f"{path}: the frame cannot be written ({error.strerror}).",
            "Free disk space or give a writable folder.",
        ) from error


def load_frame(path: Path) -> FrameDocument:
    """Return the frame at ``path``; InputError: malformed, no rotation, or changed after saving."""
    document = load_document(path, FrameDocument, SCHEMA)
    rotation = document.T_frame_from_world.rotation
    skewed = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if content_hash(document) != document.sha256:
        raise InputError(
            "frame.changed",
            f"{path}: the content does not match its hash: the file was changed after saving.",
            "Restore the file from a good copy, or save the frame again.",
        )
    if skewed > _ROTATION_FAULT or np.linalg.det(rotation) < 0.0:
        raise InputError(
            "frame.no_rotation",
            f"{path}: field 'rotation' is not a rotation.",
            "Save the frame again.",
        )
    if document.covariance and (
        any(len(row) != len(document.covariance) for row in document.covariance)
        or not is_covariance(np.array(document.covariance))
    ):
        raise InputError(
            "frame.no_covariance",
            f"{path}: field 'covariance' is not a covariance of rotation and translation.",
            "Save the frame again.",
        )
    return document


def is_covariance(matrix: Float) -> bool:
    """Return whether a matrix is a covariance of rotation and shift, (6, 6)."""
    if matrix.shape != (6, 6) or not np.all(np.isfinite(matrix)):
        return False
    scale = np.sqrt(np.diagonal(matrix).clip(min=0.0))
    # Rotation and shift have different units: normalise by their sizes.
    seen = matrix / np.outer(*[np.where(scale > 0.0, scale, 1.0)] * 2)
    if np.abs(seen - seen.T).max() > _ASYMMETRY:
        return False
    return bool(np.linalg.eigvalsh(seen)[0] > -_ASYMMETRY)


def saved_frame(document: FrameDocument) -> rules.SavedFrame:
    """Return the alignment that uses a stored frame."""
    return rules.SavedFrame(
        name=document.name,
        digest=document.sha256,
        rotation=document.rotation,
        translation=document.translation,
        covariance=document.covariance,
        simulated=document.simulated,
    )


def relocation(document: FrameDocument, limit: float) -> rules.Relocation:
    """Return the alignment that recovers a frame from control points; InputError below three."""
    if len(document.control) < 3:
        raise InputError(
            "frame.no_control",
            f"Frame {document.name} has {len(document.control)} control point(s); relocation "
            "needs three.",
            "Save it with at least three features that can be probed after the part is moved.",
        )
    return rules.Relocation(
        name=document.name,
        digest=document.sha256,
        control=document.control,
        limit=limit,
        simulated=document.simulated,
    )


def _text(document: FrameDocument) -> str:
    lines = [f"{field} = {_quoted(getattr(document, field))}" for field in _TEXTS]
    if document.simulated:
        lines.append("simulated = true")
    rows = ", ".join(_numbers(row) for row in document.rotation)
    lines += [f"rotation = [{rows}]", f"translation = {_numbers(document.translation)}"]
    if document.covariance:
        lines += ["covariance = [", *(f"  {_numbers(row)}," for row in document.covariance), "]"]
    for item in document.control:
        lines += ["", "[[control]]", f"feature = {_quoted(item.feature)}"]
        lines.append(f"place = {_numbers(item.place)}")
    return "\n".join(lines) + "\n"


_TEXTS = ("schema", "unit", "name", "made", "source", "sha256")


def _quoted(text: str) -> str:
    # A JSON string is a TOML string: same escapes, and control characters by their number.
    return msgspec.json.encode(text).decode("utf-8").replace("\x7f", "\\u007f")


def _numbers(values: Sequence[float]) -> str:
    return "[" + ", ".join(repr(float(value)) for value in values) + "]"


def saved_frame_in(rule: rules.AnyAlignment | None) -> rules.SavedFrame | None:
    """Return the saved frame of an alignment, as rule or start."""
    kind = rule.rule if isinstance(rule, rules.BoundAlignment) else rule
    if isinstance(kind, (rules.BestFit, rules.ReferencePoints)):
        kind = kind.start
    return kind if isinstance(kind, rules.SavedFrame) else None


def doubt_of(rule: rules.AnyAlignment | None) -> FrameDoubt | None:
    """Return the uncertainty of a saved frame; None without one (see `unknown_frame`)."""
    saved = saved_frame_in(rule)
    if saved is None or not saved.covariance:
        return None
    T_frame_from_world = RigidTransform(np.array(saved.rotation), np.array(saved.translation))
    return FrameDoubt(T_frame_from_world, np.array(saved.covariance))


def unknown_frame(rule: rules.AnyAlignment | None) -> str:
    """Return why a frame of unknown uncertainty proves nothing, or empty text."""
    saved = saved_frame_in(rule)
    if saved is None or saved.covariance:
        return ""
    return (
        f"The saved frame {saved.name} has no uncertainty: save it again (ocmm "
        "align), from a job that measured its features."
    )

"""Boundary of a STEP file's part in numbers; needs the extra ``step``.

In: a STEP file.
Out: faces, each with its surface, its edges and places inside them; the part as mesh and splines;
the face of the file of each.

Read `_document` (the file as the library has it) with `_library` (calls), `_raw_faces` (faces in
numbers) with `_recognised` (planes, cylinders, cones, spheres, tori, also among splines).
`_edge_steps` reads the library for `_surface_kernel`. `_part` is the nominal part, of
`_surface_splines` and `_solid_mesh`, which `_mesh_aside` makes in parallel. `_face_order` assigns
tolerances to faces and verifies that targets lie on faces. It must not know balls, probes or
targets.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_cad.step.brep._document import StepDocument, read_document
    from ocmm_cad.step.brep._face_order import FaceCheck, tolerances_of
    from ocmm_cad.step.brep._library import static
    from ocmm_cad.step.brep._mesh_aside import MeshAside
    from ocmm_cad.step.brep._part import model_face, part_of
    from ocmm_cad.step.brep._raw_faces import (
        ENDLESS, FoundFaces, RawFace, Rim, UnusableModelError, as_numbers, box_size, faces_of,
        faces_with_surface, stretches_of,
    )  # fmt: skip
    from ocmm_cad.step.brep._recognised import LESS, RECOGNISED_MM, StepFace, Triple, normals_of
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ENDLESS", "LESS", "RECOGNISED_MM", "FaceCheck", "FoundFaces", "MeshAside", "RawFace", "Rim",
    "StepDocument", "StepFace", "Triple", "UnusableModelError", "as_numbers", "box_size",
    "faces_of", "faces_with_surface", "model_face", "normals_of", "part_of", "read_document",
    "static", "stretches_of", "tolerances_of",
]  # fmt: skip

"""Software rendering of the nominal part, without graphics card or window.

In: a `PartModel`, a view, and the colours of its vertices. Out: a `Canvas`: pixel colours, depths
towards the eye, and visible faces.

Start with `_mesh` (geometry, whole and coarser, and surfaces with hidden backs); then
`_canvas` (image buffers), `_rendering` (incremental painting), `_field` (measured values as
colours; choice of view direction). Compiled: `_raster_kernel` (triangles), `_line_kernel`
(edges, outlines, polygons) and `_rendering` (whole image); `_canvas` has their types.
It must not import plans, features or the window.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.rendering._canvas import NO_FACE, Canvas, Colours
    from ocmm_gui.rendering._field import ValueField, choose_side, value_field
    from ocmm_gui.rendering._mesh import RenderMesh, coarser, face_colours, mesh_of, with_closed
    from ocmm_gui.rendering._rendering import (
        RenderMode, RenderStyle, Rendering, Wires, blend_flat, is_hidden,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "NO_FACE", "Canvas", "Colours", "RenderMesh", "RenderMode", "RenderStyle", "Rendering",
    "ValueField", "Wires", "blend_flat", "choose_side", "coarser", "face_colours", "is_hidden",
    "mesh_of", "value_field", "with_closed",
]  # fmt: skip

"""The reader of points, as a part of the public API of features (docs/integrator/python.md)."""

from ocmm_core.tables import PointsFile, read_points_file

__all__ = ["PointsFile", "read_points_file"]

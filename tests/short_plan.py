"""A plan of one ball, six touches: the shortest job that has a result."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.documents import resource
from tests.host import long_form

TOUCHES = 6
_PLAN = """
schema = "ocmm.plan/1"
unit = "mm"
name = "BALL"
part = "DEMO_PART"

[[features]]
name = "SPHERE"
shape = "Sphere"
points = 6
point = [-140.0, 0.0, 50.0]
direction = [0.0, 0.0, 1.0]
diameter = 19.989
side = "outer"

[[characteristics]]
name = "Ball diameter"
kind = "diameter"
features = ["SPHERE"]
nominal = 19.989
lower = -0.08
upper = 0.08
"""


def ball_plan_in(folder: Path) -> Path:
    """Write the document of that plan and return its place."""
    file = folder / "ball.toml"
    file.write_text(_PLAN, "utf-8")
    return file


def wire_plan_in(folder: Path) -> Path:
    """Return the plan of a job over the wire, in the time of the hand, or of several jobs.

    The ball alone; in the long form the shipped plan with two planes and the same ball, 14 touches.
    """
    return resource("plans", "quick.toml") if long_form() else ball_plan_in(folder)

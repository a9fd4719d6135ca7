"""Practice of guided procedures with a virtual hand, in separate folders.

In: the request that the station was built from, and the practised procedure.
Out: frames of a hand that performs the current step; the results are never valid.

See `_practice` for the folders, the frames and one entry per procedure.
It must not import a window or command.
"""

from ocmm_core.door import TYPE_CHECKING, door

if TYPE_CHECKING:
    from ocmm_sim.practice._practice import PRACTICE_TIP, Practice, practice_folder
else:
    __getattr__ = door(__name__)

__all__ = ["PRACTICE_TIP", "Practice", "practice_folder"]

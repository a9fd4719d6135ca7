"""Judgement of cycles over a virtual cable, driven by `ocmm_core.composition`."""

from __future__ import annotations

import msgspec

from ocmm_core.doctor._result import Answer, amber, green, red
from ocmm_core.doctor._wake import BAD_MISSED, ENOUGH_CYCLES, GOOD_MISSED, too_short


class LoopTimes(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    cycles: int
    """Frames sent, one per millisecond."""
    late: int
    lost: int
    """`late`, `lost`: answered after their cycle, and never."""
    p50_us: float
    p999_us: float
    max_us: float
    """`p50_us`, `p999_us`, `max_us`: from sending a frame to its answer, us."""
    real_time: bool


def judge_loop(times: LoopTimes) -> Answer:
    """Judge the transit of frames through the kernel, without adapter and cable."""
    share = (times.late + times.lost) / times.cycles
    how = "" if times.real_time else ", without real-time priority"
    what = (
        f"A frame is back after {times.p50_us:.0f} us in the median, 99.9 % within "
        f"{times.p999_us:.0f} us, worst of {times.cycles:,}: {times.max_us:.0f} us; "
        f"{100.0 * share:.2f} % not in their cycle, {times.lost} lost{how}."
    )
    figures = {
        "p50_us": times.p50_us, "p999_us": times.p999_us, "max_us": times.max_us,
        "late": float(times.late), "lost": float(times.lost), "cycles": float(times.cycles),
        "real_time": float(times.real_time),
    }  # fmt: skip
    remedy = "See the lines on kernel, processor and wake-up jitter; end other programs."
    # A virtual cable loses nothing; losses are due to this computer.
    if share > BAD_MISSED:
        return red("loop.very_late", what, remedy, **figures)
    if share > GOOD_MISSED:
        return amber("loop.late", what, remedy, **figures)
    if times.cycles < ENOUGH_CYCLES:
        return too_short("loop.short", what, **figures)
    return green(what, **figures)

"""``ocmm environment``: ambient readings kept in a job."""

from __future__ import annotations

from pathlib import Path

from ocmm_cli.terminal import make_console


def environment_command(*, job: Path, room: str, humidity: str, pressure: str, who: str) -> None:
    """Record ambient readings in a job, and print those it contains.

    Readings before the first point apply to the start, those after the last point to the end. The
    report prints them, and a plan may require them ([environment] of the plan). Of several readings
    without a point in between the last one applies; the report lists all. Without a reading, the
    command prints those of the job.
    """
    from ocmm_core.inspection.plan import environment_words, note_room_in, noted_rooms
    from ocmm_core.storage import JobFile
    from ocmm_core.surroundings import TypedRoom

    read = TypedRoom(room, humidity, pressure)
    read.check()
    with JobFile.read(job) if read.empty else JobFile.open(job) as opened:
        if not read.empty:
            note_room_in(opened, read, who)
        last = max((point.number for point in opened.points()), default=0)
        told = environment_words(noted_rooms(opened.events()), last)
    console = make_console(soft_wrap=True)
    if not told:
        console.say("Nothing was read off in the room.")
    for _, sentence in told:
        console.say(sentence)

"""``ocmm environment``: ambient readings kept in a job."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ocmm_core.cli.terminal import HumidityOption, PressureOption, RoomOption, make_console, say


def environment_command(
    *,
    job: Annotated[Path, typer.Argument(help="Job file (.ocmm) that is not being measured.")],
    room: RoomOption = "",
    humidity: HumidityOption = "",
    pressure: PressureOption = "",
    who: Annotated[str, typer.Option("--who", help="That reads it off.")] = "",
) -> None:
    """Keep in a job what was read off in the room now, and print what it keeps.

    Before the first point it is the begin, after the last one the end; nobody says which. The
    report says what the job keeps, and a plan may demand it ([environment] of the plan). Typed
    again with no point between, the last one counts, and the report says both. Without a reading
    what the job keeps is printed.
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
        console.print(say("Nothing was read off in the room."), highlight=False)
    for _, sentence in told:
        console.print(say(sentence), highlight=False, markup=False)

"""``ocmm settings``: the settings of the window, for scripts."""

from __future__ import annotations

from typing import Any

import msgspec
import typer

from ocmm_cli.terminal import make_console, print_notes, tr
from ocmm_core import settings
from ocmm_core.errors import InputError

settings_app = typer.Typer(
    name="settings",
    no_args_is_help=True,
    help="Settings of the window: of this station and of this user. Commands that measure on the "
    "terminal do not read them.",
)


@settings_app.command()
def show(key: str, *, json: bool) -> None:
    """Show all settings, where each comes from, and what differs from the default."""
    store = settings.SettingsStore.of_this_user()
    loaded = store.load()
    specs = settings.SETTINGS if not key else (settings.spec_of(key),)
    if json:
        content: dict[str, Any] = {
            "schema": "ocmm.settings-shown/1",
            "station": str(store.station.path),
            "user": str(store.user.path),
            "settings": [
                {
                    "key": spec.key,
                    "value": settings.text_of(loaded.values[spec.key]),
                    "default": settings.text_of(spec.default),
                    "differs": loaded.differs(spec.key),
                    "origin": loaded.origins[spec.key].value,
                }
                for spec in specs
            ],
            "notes": [{"what": note.what, "remedy": note.remedy} for note in loaded.notes],
        }
        typer.echo(msgspec.json.format(msgspec.json.encode(content), indent=2).decode())
        return
    console = make_console(soft_wrap=True)
    for spec in specs:
        origin = loaded.origins[spec.key]
        mark = "*" if loaded.differs(spec.key) else " "
        told = "" if origin is settings.SettingOrigin.DEFAULT else f"  ({origin.value})"
        value = settings.text_of(loaded.values[spec.key]) or "-"
        console.print(f"{mark} {spec.key:34} {value}{told}")
    console.show(
        f"* differs from the default. Station: {store.station.path}  User: {store.user.path}",
    )  # fmt: skip
    print_notes(loaded.notes)


@settings_app.command(name="set")
def set_command(key: str, value: str, *, station: bool) -> None:
    """Change one setting; a window that is open takes it at its next start."""
    spec = settings.spec_of(key)
    given = settings.value_of_text(spec, value)
    store = settings.SettingsStore.of_this_user()
    if not station:
        make_console(soft_wrap=True, stderr=True).print(tr(store.places()), style="dim")
    print_notes(store.change({key: given}, settings.Scope.STATION if station else None))
    if spec.section == "report":
        from ocmm_core.export.template import use_head

        use_head(store.load().settings, store.user.path.parent)
    make_console(soft_wrap=True).print(f"{key} = {settings.text_of(given) or '-'}")


@settings_app.command()
def confirm(who: str, *, station: bool) -> None:
    """Sign the settings that change verdicts, after they were edited outside the program."""
    if not who.strip():
        raise InputError("settings.name", "No name given.", "Give it with --by.")
    store = settings.SettingsStore.of_this_user()
    file = store.station if station else store.user
    file.confirm(who.strip())
    make_console(soft_wrap=True).print(tr(f"{file.path}: confirmed by {who.strip()}."))


@settings_app.command()
def check() -> None:
    """Check the documents and the files that they name; exit code 2 where something is wrong."""
    loaded = settings.SettingsStore.of_this_user().load()
    print_notes(loaded.notes)
    wrong = _print_unusable(loaded)
    if loaded.notes or wrong:
        raise typer.Exit(2)
    make_console().print(tr("All settings can be used."))


def _print_unusable(loaded: settings.LoadedSettings) -> bool:
    found = False
    for spec in settings.SETTINGS:
        if loaded.origins[spec.key] is settings.SettingOrigin.DEFAULT or spec.key == "window.keys":
            continue
        try:
            settings.value_of_text(spec, settings.text_of(loaded.values[spec.key]))
        except InputError as error:
            found = True
            print_notes((settings.Note(error.what, error.remedy),))
    return found

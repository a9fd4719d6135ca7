"""``ocmm key``: the signing key of this station, and trusted keys of others."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ocmm_cli.terminal import lead, say

if TYPE_CHECKING:
    from ocmm_core.seals import TokenPlace

key_app = typer.Typer(
    no_args_is_help=True,
    help="The key of this station, and the keys of other stations whose files are believed here.",
)

WhoOption = Annotated[str, typer.Option("--who", help="Name of the person who decides.")]
ReasonOption = Annotated[str, typer.Option("--reason", help="Why.")]


@key_app.command()
def show(
    *,
    x509: Annotated[
        Path | None,
        typer.Option(
            "--x509",
            help="Also write the X.509 certificate of this station (PEM), by which other programs "
            "verify its calibration certificates.",
        ),
    ] = None,
) -> None:
    """Print the public key of this station, making the key if there is none, and all known ones."""
    from ocmm_core.seals import KeyFolder, public_text, shown_key, write_station_certificate

    keys = KeyFolder()
    own = keys.station_key()
    typer.echo(f"{lead('This station  ')}{shown_key(own.fingerprint)}")
    typer.echo(f"{lead('  Public key  ')}{public_text(own.public)}")
    typer.echo(f"{lead('  Kept in     ')}{own.kept_in}")
    if x509 is not None:
        write_station_certificate(x509, keys)
        typer.echo(f"{lead('  X.509       ')}{x509}")
    for key in keys.known():
        until = f", replaced {key.until_utc[:10]}" if key.until_utc else ""
        typer.echo(
            say(f"{key.name}  {shown_key(key.fingerprint)}, since {key.since_utc[:10]}{until}")
        )
        typer.echo(f"{lead('  By ')}{key.who}: {key.reason}")


@key_app.command()
def trust(
    *,
    public: Annotated[
        str, typer.Argument(help="Public key that `ocmm key show` prints on the other station.")
    ],
    name: Annotated[str, typer.Option("--name", help="What the other station is called.")],
    who: WhoOption,
    reason: ReasonOption,
) -> None:
    """Believe what another station signs. First compare its key by another way, e.g. a call."""
    from ocmm_core.seals import KeyFolder, public_from_text, shown_key

    keys = KeyFolder()
    key = keys.trust(public_from_text(public.strip()), name, who, reason, datetime.now(UTC))
    typer.echo(say(f"{key.name} is believed from now on: key {shown_key(key.fingerprint)}."))


@key_app.command()
def replace(
    *,
    who: WhoOption,
    reason: ReasonOption,
    token: Annotated[
        str,
        typer.Option("--token", help="Label of a PKCS #11 token or TPM that the key is made in."),
    ] = "",
    module: Annotated[
        Path | None,
        typer.Option("--module", help="PKCS #11 library of its maker, e.g. libtpm2_pkcs11.so."),
    ] = None,
    pin_file: Annotated[
        Path | None,
        typer.Option("--pin-file", help="File with the PIN of its user; else it is asked for."),
    ] = None,
    in_file: Annotated[
        bool, typer.Option("--in-file", help="Take the key out of use that is in a token.")
    ] = False,
) -> None:
    """Sign with a new key from now on. What the old one signed still verifies on this computer.

    The new key is made where the old one is: in a file, or in a token that never gives it away.
    """
    from ocmm_core.seals import KeyFolder, shown_key

    keys = KeyFolder()
    place = None if in_file else _place(token, module, pin_file) or keys.token_place()
    key = keys.replace(who, reason, datetime.now(UTC), place)
    typer.echo(say(f"This station signs with key {shown_key(key.fingerprint)} from now on."))
    typer.echo(f"{lead('  Kept in     ')}{key.kept_in}")
    typer.echo(say("Tell those who trust this station: ocmm key show prints the new public key."))


@key_app.command()
def restored(*, who: WhoOption, reason: ReasonOption) -> None:
    """Accept the files that this key signed up to now without the memory of the station.

    After the key was brought to another computer or user, or the memory was lost. An end that was
    removed from such a file before is not noticed: check the last step of each on its report.
    """
    from ocmm_core.seals import KeyFolder, start_memory

    utc = start_memory(KeyFolder(), who, reason, datetime.now(UTC))
    typer.echo(say(f"The memory of this station starts at {utc[:19]} UTC, by {who}."))


def _place(token: str, module: Path | None, pin_file: Path | None) -> TokenPlace | None:
    from ocmm_core.documents import read_bytes
    from ocmm_core.errors import InputError
    from ocmm_core.seals import TokenPlace

    if not token and module is None and pin_file is None:
        return None
    if not token or module is None:
        raise InputError(
            "key.place",
            "A token is named by its label and by the library of its maker.",
            "Give both: --token LABEL --module LIBRARY",
        )
    if pin_file is None:
        pin: str = typer.prompt(say(f"PIN of token {token}"), hide_input=True)
    else:
        pin = read_bytes(pin_file).decode("utf-8", "replace").strip()
    return TokenPlace(module=str(module.absolute()), label=token, pin=pin)

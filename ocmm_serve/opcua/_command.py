"""``ocmm serve opcua``: an entry point of the group `ocmm.commands`."""

from __future__ import annotations

from pathlib import Path

from ocmm_cli.terminal import lead, make_console
from ocmm_core.errors import InputError
from ocmm_serve.site import PublishedPlaces, ServedAddress, require_package


def serve_opcua(
    *,
    address: ServedAddress,
    trusted: Path | None,
    anonymous: bool,
    machine: str,
    machine_serial: str,
    places: PublishedPlaces,
) -> None:
    """Serve state, results, calibrations and corrections of a station by OPC UA, read-only.

    Clients need a certificate in the folder --trusted. The station measures in another process and
    needs the option --stream alone. See docs/integrator/opcua.md. Ends by Ctrl-C.
    """
    require_package("asyncua", "opcua")
    from ocmm_serve.opcua._server import OpcUaServer, TrustedClients
    from ocmm_serve.published import publish_until_end

    if address.certificate is None and not anonymous:
        raise InputError(
            "opcua.certificate_missing",
            "OPC UA needs a certificate of this server, and its key.",
            "Make them (docs/integrator/opcua.md), then give --cert and --key.",
        )
    console = make_console(soft_wrap=True)
    clients = TrustedClients(trusted, anonymous=anonymous)
    server = OpcUaServer(clients, address.options(4840), machine, machine_serial)
    try:
        server.start()
        console.print(f"{lead('Server  ')}{server.address}")
        publish_until_end(places, lambda words: console.show(words, style="yellow"), server.show)
    finally:
        server.close()
    refused, missed = clients.refused, server.missed
    console.show(f"{refused} clients refused, {missed} changes skipped.")

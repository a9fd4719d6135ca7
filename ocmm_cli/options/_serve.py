"""Options of the servers for measuring programs of other makers."""

from __future__ import annotations

from pathlib import Path

from ocmm_core.options import Option

TABLE = {
    "serve": (
        Option("host", "127.0.0.1", "Address to listen on; others than local need --allow."),
        Option("allow", None, "Address or network of a client; can be repeated."),
        Option("certificate", None, "Certificate (PEM): the server speaks TLS.", flags="--cert"),
        Option("private_key", None, "Private key of the certificate (PEM).", flags="--key"),
    ),
    "serve ippdme": (
        Option("port", 1294, "TCP port; 0: any free port.", "port"),
        Option("dialect", "1.4", "Edition that the measuring program speaks."),
        Option("shift_sign", "origin", "Meaning of X0, Y0, Z0 in SetCsyTransformation: origin of "
               "the part in the machine, or offset added after the rotation."),
        Option("any_place", False, "Accept touches away from the nominal, such as before the part "
               "is aligned."),
        Option("patience", 600.0, "Longest wait for a touch, s.", "seconds"),
        Option("tries", 3, "Refused touches before the program gets an error.", "touches"),
        Option("out", Path("ocmm-out"), ""),
    ),
}  # fmt: skip

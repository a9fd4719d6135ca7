"""Options of the servers for measuring programs of other makers."""

from pathlib import Path

from ocmm_core.options import DEFAULT_OPERATOR, OF_SERVER, Option

_DME = {one.name: one for one in OF_SERVER}
_POINTS = (
    Option("unit", "mm", "Unit of positions and radius in the lines."),
    Option("point", "ball", "ball: centre of the probe ball, the program compensates its radius; "
           "surface: compensated along the direction of the touch."),
    Option("decimal", "point", "Decimal sign."),
    Option("plan", None, "Plan that the touches belong to. Default: a list of points; for a "
           "virtual source the demonstration."),
    Option("speed", 1.0, ""),
)  # fmt: skip
"""Of both faces that send points as text."""

TABLE = {
    "serve": (
        Option("operator", DEFAULT_OPERATOR, ""),
        Option("out", Path("ocmm-out"), ""),
        _DME["host"],
        _DME["allow"],
        Option("certificate", None, "Certificate (PEM): the server speaks TLS.", flags="--cert"),
        Option("private_key", None, "Private key of the certificate (PEM).", flags="--key"),
    ),
    "serve ippdme": (
        _DME["port"],
        _DME["dialect"],
        _DME["shift_sign"],
        _DME["point"],
        Option("any_place", False, "Accept touches away from the nominal, such as before the part "
               "is aligned."),
        Option("patience", 600.0, "Longest wait for a touch, s.", "seconds"),
        Option("tries", 3, "Refused touches before the program gets an error.", "touches"),
    ),
    "serve lines": (
        *_POINTS,
        Option("template", "{x:.4f},{y:.4f},{z:.4f}", "Format of a line: {x} {y} {z} position, "
               "{i} {j} {k} direction, {r} radius of the ball, {n} number of the point; digits as "
               "in {x:.4f}; \\t is a tabulator."),
        Option("end", "crlf", "End of a line.", choices=("crlf", "lf", "cr")),
        Option("port", None, "TCP port; 0: any free port. Default: 1390.", "port"),
        Option("device", "", "Serial line in place of TCP, such as /dev/ttyUSB0."),
        Option("baud", 9600, "Speed of the serial line.", "baud"),
    ),
    "serve keyboard": (
        *_POINTS,
        Option("template", "{x:.4f}\\t{y:.4f}\\t{z:.4f}", "As of ocmm serve lines; \\t presses "
               "Tab."),
        Option("end", "enter", "Key behind a line.", choices=("enter", "tab", "none")),
        Option("window", "", "Type only if the title of the active window contains these words "
               "(X11)."),
    ),
}  # fmt: skip

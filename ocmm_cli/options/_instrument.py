"""Options of the commands for cameras, calibrations, acceptance tests and studies."""

from pathlib import Path

from ocmm_core.calibration import tip
from ocmm_core.calibration.relocation import RelocationRequest
from ocmm_core.calibration.sweeping import PivotRequest
from ocmm_core.calibration.verification import Limits
from ocmm_core.composition import source_help, sources
from ocmm_core.documents import resource
from ocmm_core.options import DEFAULT_OPERATOR, Option, argument

BUS_SOURCES = source_help([one for one in sources() if one.on_bus])
_WAVE_S = 60.0
"""One minute of waving samples the pattern of a 400 mm volume to a sixth (`benchmarks/bump.py`)."""
_LIMITS, _RELOCATION, _PIVOT = Limits(), RelocationRequest(), PivotRequest()

TABLE = {
    "bus snapshot": (
        argument("file", ..., "New picture, .png or .pgm, 16 bits."),
        Option("region", None, "LEFT,TOP,WIDTH,HEIGHT in pixels; default: the whole sensor."),
    ),
    "bus": (
        Option("source", ..., BUS_SOURCES),
        argument("address", ..., "Object, hexadecimal, e.g. 1018:04.", metavar="INDEX[:SUB]"),
    ),
    "bus history": (Option("clear", False, "Then clear them in the camera."),),
    "bus record": (
        argument("file", ..., "New file, .pcapng."),
        Option("seconds", 10.0, "How long.", "seconds-of-a-capture"),
        Option("megabytes", 256, "End at this size.", "megabytes"),
    ),
    "bus watch": (
        Option("seconds", 5.0, "Duration of the run.", "seconds-of-frames"),
        Option("every", None, "Also print the report at this interval in "
               "seconds.", "seconds-of-frames"),
        Option("out", None, "Write the report at the end to this file."),
        Option("statistics", None, "Counts and histograms of the cycles, .json or .csv."),
    ),
    "bus decode": (
        argument("file", ..., "Recorded with: tcpdump -i IFACE -s 2048 -w FILE."),
        Option("cameras", 0, "Number of cameras, if their start-up is not in the file.", "cameras"),
        Option("record", None, "Keep the frames in this file, for replay."),
    ),
    "bus object read": (Option("out", None, "Write the bytes to this file instead."),),
    "bus object write": (argument("value", ..., "Hexadecimal bytes in wire order, e.g. e803."),),
    "bus black measure": (
        Option("frames", 256, "Exposures to average.", "frames"),
        Option("store", False, "Store it permanently."),
    ),
    "bus intrinsics write": (Option("note", "", "Text to store with them."),),
    "camera describe": (
        argument("esi", ..., "ESI file of the maker.", metavar="ESI.xml"),
        Option("out", None, "New description, .toml."),
        Option("product", "", "Product code, e.g. 0x1234."),
        Option("revision", "", "Revision, e.g. 0x10000."),
        Option("role", None, "ROLE=INDEX:SUB,... (x, y, intensity, valid, counter, time, button, "
               "heartbeat); entries of spots in the order of the slots."),
        Option("output", None, "INDEX:SUB=VALUE sent in an output."),
        Option("sends", None, "Unit of coordinates."),
        Option("step", None, "Px or mm of one step of a coordinate.", "step"),
        Option("clock", None, "Exposure clock."),
        Option("doubt_ns", None, "Uncertainty of exposure times, ns.", "nanoseconds"),
        Option("cycle_ns", 1000000, "Bus cycle, ns.", "cycle"),
        Option("latency_ns", 0, "End of exposure to new inputs, ns.", "nanoseconds"),
    ),
    "camera alias": (argument("value", ..., "New station alias.", "alias"),),
    "camera": (Option("source", ..., BUS_SOURCES),),
    "camera firmware": (argument("file", ..., "Firmware, signed by the maker of the camera."),),
    "camera identify": (Option("seconds", 20, "Duration of blinking, s.", "seconds-of-a-lamp"),),
    "camera conform": (
        argument("interface", ..., "Network interface with the camera, e.g. enp3s0; or "
                 "ethercat:virtual.", metavar="IFACE"),
        Option("serial", 0, "Its serial number, if there are several cameras.", "serial"),
        Option("firmware", None, "Signed firmware of another version, to try an update."),
        Option("json", None, "New file for the report."),
        Option("page", None, "New HTML page for the report."),
    ),
    "calibrate cameras": (
        Option("points", ..., "List of reference positions (CSV)."),
        Option("spots", None, "Recorded averaged spots (CSV) of the points."),
        Option("evaluation", None, "Points kept for evaluation; default: a quarter.", "points"),
    ),
    "calibrate boards": (
        argument("patterns", ..., "Names of the pictures of each camera, in the order of the rig.",
                 metavar="'*-CAMERA.png'..."),
        Option("board", ..., "Document of the calibration board; a template: "
               "resources/artefacts/board.toml."),
        Option("corners", None, "Table of corners: filename x y level."),
        Option("pictures", None, "Folder of pictures; corners are found by OpenCV."),
        Option("valid_days", 365, ""),
        Option("decision", None, "Accept the result, or keep the active one; if neither is given, "
               "on a terminal you are asked, a script keeps it.", flags="--accept/--keep"),
    ),
    "camera black": (Option("source", ..., "Cameras: genicam:SERIAL,SERIAL."),),
    "camera genicam": (
        Option("gentl", False, "List the cameras of the GenTL producers in GENICAM_GENTL64_PATH."),
    ),
    "calibrate bundle": (
        argument("views", ..., "Kept corners (boards-....json in the folder of sessions), or a "
                 "folder of pictures VIEW-SERIAL.png."),
        Option("board", ..., "Document of the calibration board."),
        Option("bar", None, "Document of the length bar."),
        Option("sweep", None, "Recording of the waved probe."),
        Option("placements", None, "Recording of the bar, which rests at ten places."),
        Option("probes", None, "Folder of records of probes; default: the document of the probe."),
        Option("tip", None, "Mounted tip; default: the last one mounted."),
        Option("valid_days", 365, ""),
        Option("decision", None, "Accept the result, or keep the active one; if neither is given, "
               "on a terminal you are asked, a script keeps it.", flags="--accept/--keep"),
    ),
    "camera expose": (
        Option("source", ..., "Cameras: genicam:SERIAL,SERIAL."),
        Option("exposure", None, "Exposure time, µs; default: found by the brightest LED.",
               "exposure"),
        Option("gain", None, "Gain of all cameras, as their maker counts it; default: unchanged.",
               "gain"),
        Option("keep", False, "Store the settings in the cameras, loaded at power-up.",
               flags="--store"),
    ),
    "calibrate pictures": (
        argument("folder", ..., "Folder for the pictures."),
        Option("source", ..., "Cameras: genicam:SERIAL,SERIAL."),
        Option("views", 40, "Number of views.", "placements"),
        Option("every", 3.0, "Seconds from view to view.", "seconds-of-frames"),
        Option("board", None, "Document of the board; prints the corners in each picture."),
    ),
    "calibrate": (
        Option("spot_columns", "", "Columns of the recorded spots, such as point,serial,u,v."),
        Option("spot_decimal", "", "Decimal sign of the recorded spots: point or comma."),
        Option("spot_skip", "", "Lines of recorded spots that are not read: 3 or 4-9."),
        Option("decision", None, "Accept the result, or keep the active one; if neither is given, "
               "a terminal asks and a script leaves the session waiting.", flags="--accept/--keep"),
        Option("overrule", "", "Reason for overriding the data-quality guards; recorded."),
        Option("new", False, "Start a new session although one can be resumed."),
        Option("move", None, "Virtual rig: move its frame randomly with this seed.", "seed"),
        Option("record", None, "Keep all raw frames in this file; --source replay:FILE."),
        Option("shots", None, "Recorded averaged spots instead of a source."),
        Option("valid_days", tip.VALID_DAYS, "Validity period.", "days"),
        Option("uncalibrated", False, "Use cameras without a usable calibration."),
        Option("cone", "", "Marking on the cone."),
    ),
    "calibrate boards, calibrate bundle, calibrate cameras, calibrate relocate, calibrate verify, "
    "calibrate sensors, calibrate tracker, calibrate scale, "
    "calibrate status, calibrate history, calibrate probe, calibrate tip, calibrate check-tip, "
    "camera black": (
        Option("calibrations", None, "Calibration folder; default: that of this user."),
    ),
    "calibrate relocate": (
        Option("bar", resource("artefacts", "bar.toml"), "Document of the length bar."),
        Option("world", "cameras", "World frame: kept by the cameras, by control points, or "
               "defined by three."),
        Option("control", None, "List of control points (CSV)."),
        Option("lens", "prior", "Lenses: kept, refined from earlier values, or free."),
        Option("geometry", "uncertain", "Source of the LED positions."),
        Option("poses", _RELOCATION.poses, "At least.", "poses"),
        Option("placements", _RELOCATION.placements, "Least number of bar placements.",
               "placements"),
        Option("limit", _RELOCATION.limit,
               "Target: standard uncertainty (U / 2) of a length, mm.", "limit"),
        Option("seats", True, "Skip seats: for recordings without them (--source "
               "replay:).", flags="--seats/--no-seats"),
    ),
    "calibrate verify": (
        # Verification needs a length that did not set the scale.
        Option("bar", resource("artefacts", "verification_bar.toml"),
               "Length bar document; not the bar used to calibrate the cameras."),
        Option("sphere", None, "Sphere document; can be repeated."),
        Option("two_places", False, "Touch each sphere in the near and in the far third of the "
               "volume."),
        Option("excuse", None, "Why a corner of the volume cannot be reached, e.g. 'X- Y+ Z-: a "
               "post stands there'; recorded."),
        Option("constant", _LIMITS.constant, "Permissible error of a length: constant part, "
               "mm.", "limit", flags="--limit"),
        Option("per_length", _LIMITS.per_length, "Permissible error of a length: proportional "
               "part.", "per-length", flags="--limit-per-length"),
        Option("largest", _LIMITS.largest, "Permissible error of a length: maximum, "
               "mm.", "limit", flags="--limit-largest"),
        Option("diameter", _LIMITS.diameter, "Permissible error of a diameter, "
               "mm.", "limit", flags="--limit-diameter"),
        Option("form", _LIMITS.form, "Permissible form of a sphere, "
               "mm.", "limit", flags="--limit-form"),
        Option("rule", "guarded", "Artefact uncertainty: subtracted from the limit, or only "
               "stated."),
    ),
    "calibrate tracker": (Option("valid_days", 365, ""),),
    "calibrate sensors": (
        Option("seconds", _WAVE_S, "Duration of waving the probe.", "seconds-of-rest"),
    ),
    "calibrate write-cameras": (
        Option("source", ..., BUS_SOURCES),
        Option("check", False, "Compare only, write nothing; exit code 0: identical."),
    ),
    "calibrate probe": (
        Option("valid_days", _PIVOT.valid_days, ""),
        Option("tip", ..., "Name of the mounted tip."),
        Option("tip_unknown", False, "The document does not define this tip: another stylus."),
        Option("sweeps", None, "Recorded spots of both sweeps (CSV) instead of a source."),
        Option("poses", _PIVOT.poses, "Least number of poses per sweep.",
               "poses-of-a-probe"),
        Option("slack", 0.0, "Play of the ball in the cone (sigma), mm.", "limit"),
        Option("limit", _PIVOT.limit, "Tip change above which a reason is required, "
               "mm.", "limit"),
        Option("because", "", "Why the tip changed by more than the limit."),
        Option("again", True, "Skip the return to the first cone: for recordings without it "
               "(--source replay:).", flags="--again/--no-again"),
        Option("scene", "good", "Scene on the virtual rig.",
               choices=(
                   "good", "slack", "pushed", "same-place", "narrow", "hidden-led", "other-tip",
                   "other-probe",
               )),
        Option("anew", False, "Discard the current sweep."),
    ),
    "calibrate probe, calibrate tip, calibrate check-tip": (
        Option("probes", None, "Folder of records of probes. Without it that of this user for real "
               "cameras, and one apart from it for virtual ones."),
    ),
    "calibrate tip, calibrate check-tip": (
        Option("tip", None, "Mounted tip; default: the last one mounted."),
        Option("sphere", resource("artefacts", "sphere.toml"), "Document of the sphere."),
        Option("scene", "good", "Tip on the virtual probe.",
               choices=("good", "wrong-diameter", "wrong-length", "worn")),
    ),
    "calibrate tip": (
        Option("diameter", None, "Nominal ball diameter, mm; default: as listed.", "ball"),
    ),
    "calibrate mount-tip": (
        argument("tip", ..., "Name of the newly mounted tip."),
        Option("who", DEFAULT_OPERATOR, "Name of the person confirming."),
    ),
    "calibrate mount-tip, calibrate probe-status, calibrate probe-history": (
        Option("probes", None, "Probe record folder; default: that of this user."),
    ),
    "study probe-calibration": (
        Option("runs", 3000, "Simulated calibrations.", "runs"),
        Option("poses", 10000, "Poses per calibration.", "poses"),
        Option("estimator", "thesis", "'thesis': mean of one sphere for each LED; 'common': one "
               "centre for all LEDs; 'bundle': adjustment on the spots of a rig, as the product "
               "calibrates."),
        Option("ranges", (45.0, 45.0, 10.0), "Angles about X, Y and Z: uniform between - and + "
               "these, °.", "tilt", flags="--range"),
        Option("sigma", (4.6, 22.7, 4.6), "Noise of a target along X, Y and Z, um; not for "
               "'bundle'.", "target-noise"),
        Option("probe", resource("probes", "thesis.toml"), ""),
        Option("rig", resource("rigs", "thesis.toml"), ""),
        Option("spot_sigma", 0.0105, "Noise of a spot, px; for 'bundle'.", "noise"),
        Option("leds", True, "Whether to average the LEDs too (figure "
               "15).", flags="--leds/--tip-only"),
        Option("seed", 1, "Seed of angles and noise.", "seed"),
        Option("processes", None, "Default: one per processor.", "workers"),
        Option("out", Path("ocmm-out"), "Folder for figures and numbers."),
    ),
    "study coverage": (
        Option("runs", 200, "Simulated measurements.", "runs-of-a-study"),
        Option("seed", 0, "Seed of the first run.", "seed"),
    ),
    "probe design": (
        Option("probe_design", None, "Design document: materials and sections. Default: the one in "
               "the resources folder with the probe's name, if any.", flags="--design"),
        Option("tilt", (45.0, 45.0, 10.0), "Tilts about X, Y and Z: uniform between - and + these, "
               "°.", "tilt"),
        Option("spot_sigma", 0.0105, "Noise of an averaged spot, px.", "noise"),
        Option("poses", 4000, "Number of poses.", "poses-of-a-probe"),
        Option("all_seen", False, "Treat LEDs facing away from a camera as visible."),
        Option("seed", 1, "Seed of the poses.", "seed"),
        Option("out", Path("ocmm-out"), "Folder for the figures."),
    ),
    "acceptance plan, acceptance run": (
        argument("procedure", ..., "Id of a shipped procedure, or a TOML file of your own."),
        Option("artefact", None, "Id in the register, or a document; repeat for several. Virtual "
               "rig: shipped ones."),
    ),
    "acceptance run": (
        Option("place", "", "Place of the test."),
        Option("condition", "as found", "State of the machine: before or after an adjustment."),
        Option("retest", True, "Repeat permitted positions.", flags="--retest/--no-retest"),
        Option("new", False, "Start again."),
        Option("record", None, "Keep the frames in this file."),
    ),
    "acceptance run, acceptance status": (
        Option("folder", None, "Of sessions and records; default: that of this user."),
    ),
    "acceptance recompute": (
        argument("file", ..., "Record of a finished test."),
        Option("spots", False, "Also from the spots, with the rig and the "
               "probe.", flags="--spots/--points"),
    ),
    "acceptance interim": (
        Option("artefact", None, "The dumbbell: id or document."),
        Option("procedure", "INTERIM", "Id or TOML file."),
        Option("folder", None, "Of checks; default: that of this user."),
    ),
    "artefact add": (
        argument("file", None, "Document (ocmm.artefact/1); or give the options."),
        Option("id", "", "What commands call it."),
        Option("kind", "", "sphere, bar, gauge block, part, plate, dumbbell, thermometer."),
        Option("name", "", "Of the artefact."),
        Option("maker", "", ""),
        Option("serial", "", "Serial number of the artefact."),
        Option("laboratory", "", "That calibrated it."),
        Option("certificate", "", "Its number."),
        Option("certificate_file", None, "Its file, for the hash."),
        Option("due_utc", "", "It holds until then, like 2027-06-30.", flags="--due"),
        Option("sizes", None, "mm at 20 °C; once for each nest of a bar, from 0.", "size",
               flags="--size"),
        Option("expanded", 0.0, "U (k = 2), mm; K for a thermometer.", "expanded", flags="--U"),
        Option("expanded_per_length", 0.0, "Its part that grows with the "
               "length.", "per-length", flags="--U-per-length"),
        Option("form", 0.0, "Certified form error, mm.", "form"),
        Option("expansion", 1.15e-05, "1/K.", "expansion"),
        Option("expansion_sigma", 1e-06, "Its standard uncertainty, 1/K.", "expansion-sigma",
               flags="--expansion-u"),
        Option("supports", "", "How it is held."),
        Option("replace", False, "A newer certificate of an artefact that is there."),
    ),
    "artefact": (
        Option("who", DEFAULT_OPERATOR, "Name for the register."),
        Option("folder", None, "Of the register; default: that of this user."),
    ),
    "artefact show, artefact remove": (argument("name", ..., "Id of the artefact."),),
    "artefact read": (argument("name", ..., "Id of a thermometer; several with commas."),),
    "msa plan": (
        argument("file", ..., "Plan that is written."),
        Option("name", ..., "Of the study, and batch of its jobs."),
        Option("parts", 10, "How many.", "parts"),
        Option("operators", "A,B,C", "Names, parted by commas."),
        Option("trials", 3, "Of each operator on each part.", "trials"),
    ),
    "msa": (
        argument("study", ..., "Plan of the study (ocmm msa plan)."),
        argument("jobs", ..., "Folder of the jobs."),
        Option("name", ..., "As in the inspection plan.", flags="--characteristic"),
    ),
    "msa run": (
        Option("out", ..., ""),
        Option("most", 10000, "Stop after this number.", "measurements"),
    ),
    "msa report": (Option("level", 0.25, "Interaction pooled above this p-value.", "level"),),
    "msa type1": (
        Option("reference", ..., "Certified value, mm.", "reference"),
        Option("tolerance", None, "Its width; default: of the plan.", "reference"),
    ),
    "msa linearity": (
        Option("reference", ..., "PART=VALUE: certified value, mm; once for every part (5 or "
               "more)."),
        Option("study", None, "Plan whose blind codes the serial numbers are."),
        Option("picture", None, "Write the chart to this SVG file."),
    ),
    "msa part": (
        Option("certified", ..., "Of the certificate, mm.", "certified"),
        Option("u_cal", ..., "Its U (k = 2), mm.", "expanded", flags="--U-cal"),
        Option("u_workpiece", 0.0, "Standard uncertainty of the parts, mm.", "expanded"),
        Option("temperatures", None, "Lowest and highest; default: within 1 K.", "temperature"),
        Option("u_expansion", 0.0, "Standard uncertainty, 1/K.", "expansion-sigma"),
        Option("procedure", "PART-U", "PART-U, or a document of your own."),
        Option("task", None, "Measured part and method (ocmm.part-task/1)."),
        Option("out", None, "Keep the study in this folder; needs --task."),
        Option("certificate", "", "Number."),
    ),
    "msa part-use": (
        argument("study", ..., "Kept study (ocmm msa part --out)."),
        Option("task", ..., "Part measured now, and method."),
    ),
    "selftest reliability": (
        Option("lane", None, "kills: kill -9 of a whole job at any moment; cuts: power cuts on a "
               "disk in a file, as root; faults: every system call that writes fails in every way; "
               "names: files removed, moved, replaced or unmounted while measured; writers: two "
               "programs on one job or store; clock: a clock that jumps; hostile: forged and "
               "damaged files; sides: hostile files in place of trusted ones and next to them; "
               "soak: jobs at 8 kHz, one after the other, for --hours. May be repeated; default: "
               "all."),
        Option("runs", None, "Trials of each lane; default: 100.", "runs"),
        Option("hours", None, "Time in all, shared among the lanes; no limit of trials "
               "then.", "hours"),
        Option("seed", 1, "Seed of all moments.", "seed"),
        Option("state", None, "File of JSON lines, one for each trial: the same command continues "
               "from there."),
    ),
}  # fmt: skip
"""By the commands that take them."""

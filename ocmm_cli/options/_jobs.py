"""Options of the commands for jobs, plans, archives and signatures."""

from math import inf
from pathlib import Path

from ocmm_core.options import DEFAULT_OPERATOR, Option, argument
from ocmm_core.settings import spec_of

FORMAT_WORDS = "polyworks, qif, dfq, xlsx, json, fai, cloud, points, pdf or all"
PROFILED_WORDS = "polyworks, dfq, xlsx, cloud, points"
"""Those of the registry, which is not loaded for help; a test compares them."""
CRITERIA = ("least-squares", "minimum-zone", "inscribed", "circumscribed")

TABLE = {
    "align": (
        argument("job", ..., "Job file (.ocmm), finished or in progress."),
        Option("save", None, "Save the frame as a document, e.g. the machine frame."),
        Option("name", "", "Name of the saved frame. Default: its file name."),
        Option("control", None, "Feature to save as a control point, for relocating the frame "
               "after the part was moved; can be repeated."),
    ),
    "align-plan": (
        argument("plan", ..., "Plan document."),
        Option("frame", ..., "Document of a saved frame."),
        Option("out", ..., "File of the new plan."),
        Option("relocate", None, "Relocate the frame at its control points, within this limit, mm. "
               "Default: use it as saved.", "limit"),
    ),
    "compare": (
        argument("jobs", ..., "Job files of one plan, in any order.", metavar="JOB..."),
        Option("probes", None, "Probe record folder. Default: that of this user."),
        Option("calibrations", None, "Calibration folder. Default: that of this user."),
        Option("feature", "", "Only results of this feature."),
        Option("table", None, "CSV file with every value, its signals and all indices."),
        Option("pages", None, "PDF file: table, charts and signals, on your template."),
    ),
    "environment": (
        argument("job", ..., "Job file (.ocmm) that is not being measured."),
        Option("who", "", "Name of the reader."),
    ),
    "uncertainty": (
        argument("job", ..., "Job file.", metavar="JOB"),
        Option("only", "", "Name of one characteristic; default: all."),
        Option("monte_carlo", False, "Also run Monte Carlo and compare."),
        Option("trials", 1000000, "Maximum number of trials.", "simulated-trials"),
        Option("digits", 2, "Significant digits required for u.", "digits"),
        Option("seed", 1, "Of the simulation.", "seed"),
    ),
    "report": (
        argument("jobs", ..., "Job files (.ocmm), also from other computers."),
        Option("formats", None, f"One of {FORMAT_WORDS}; can be repeated.", flags="--format"),
        Option("profile", None, "Profile document of the text files: delimiter, decimal sign, "
               f"unit, columns. Used by {PROFILED_WORDS}. Default: PolyWorks."),
        Option("section", None, "Also write the points near a plane as CSV, DXF and STEP: "
               "\"x,y,z;nx,ny,nz;distance\" in part coordinates, mm, or \"plan\" for the "
               "sections of the plan; can be repeated."),
        Option("out", None, "Report folder. Default: that of the first job."),
        Option("preview_only", False, "Print the contents of the files without writing "
               "them.", flags="--preview"),
        Option("probes", None, "Probe record folder, searched for later findings on the tip. "
               "Default: that of this user."),
        Option("calibrations", None, "Calibration folder, searched for later findings on the "
               "cameras. Default: that of this user."),
        Option("incomplete", False, "Report an incomplete job too."),
        Option("template", None, "Template of the report: letterhead, machine, sections, "
               "signatures. Default: that of this station, else plain. Copy "
               "resources/reports/standard.toml."),
        Option("remember", False, "Use --template for every report from now on, also of ocmm "
               "measure and of the window; keep these entries with the jobs."),
        Option("number", "", "Report number. Default: made from the job."),
        Option("customer_address", "", "Address of the customer."),
        Option("order", "", "Default: that of the job."),
        Option("drawing", "", "Drawing of the part."),
        Option("revision", "", "Of the drawing."),
        Option("machine", "", "Machine that made the part, for statistics."),
        Option("place", "", "Place of measurement. Default: of the template."),
        Option("received", "", "When the item came, in which condition."),
        Option("deviation", None, "Deviation from the plan; can be repeated."),
        Option("remark", None, "Statement; can be repeated."),
    ),
    "recall": (
        argument("jobs", None, "Job folders (searched with subfolders) or job files. Default: "
                 "ocmm-out.", metavar="[FOLDER]..."),
        Option("calibrations", None, "Calibration folder. Default: that of this user."),
        Option("probes", None, "Probe record folder. Default: that of this user."),
        Option("who", "", "Your name: releases the points whose verdicts hold. Without it, nothing "
               "is stored.", flags="--by"),
        Option("artefact", None, "Serial number of an artefact found wrong: everything based on it "
               "is invalidated first. Needs --since and --by."),
        Option("since", None, "Date since when the artefact was wrong."),
    ),
    "fit": (
        argument("file", ..., "Text file, one row x y z per point, or PLY, OBJ, OFF, STL or PCD.",
                 metavar="FILE"),
        Option("shape", ..., "Shape to fit."),
        Option("criterion", "least-squares", "Association criterion.", choices=CRITERIA),
        Option("free", False, "Circle: fit in space as one problem, not plane first."),
    ),
    "probe pivot": (argument("files", ..., "Tables of poses, one for each place of the tip."),),
    "verify-fits": (
        argument("folder", ..., "Folder with pairs NAME.ds and NAME.fit.", metavar="DIR"),
        Option("convention", "any", "Convention of the certified values: nist has diameters and "
               "circles in the plane of their points; ptb has radii, circles as one problem, and "
               "cones' axes towards the smaller radius; any uses the agreeing one and reports it.",
               choices=("nist", "ptb", "any")),
        Option("criterion", "least-squares", "Association criterion of the certified values.",
               choices=CRITERIA),
    ),
    "demo": (
        Option("headless", False, "Measure on the terminal, without the window."),
        Option("out", Path("ocmm-out"), ""),
        Option("speed", None, "Default: 1 (real time) in the window, 0 (full) else.", "speed"),
        Option("theme", None, "Colours of the window. Default: as in the settings.",
               choices=spec_of("window.theme").choices),
    ),
    "measure": (
        Option("plan", None, ""),
        Option("out", None, "Folder for job file and report; with --continue: that of the job."),
        Option("operator", DEFAULT_OPERATOR, ""),
        Option("order_number", "", "Order number, for the report."),
        Option("batch", "", "Batch that the part belongs to."),
        Option("parts", 1, "Measure this many parts in sequence, one job file each; the serial "
               "number is incremented. Waits for Enter between parts so that the part can be "
               "changed; virtual rigs change it themselves.", "parts"),
        Option("go_on", None, "Resume this job file, with its own plan, instead of starting a new "
               "job.", flags="--continue"),
        Option("order", "plan", "Probe in plan order or in any order.", choices=("plan", "any")),
        Option("record", None, "Keep all raw frames in this file as well."),
        Option("thesis", False, "Compute poses with the method of the thesis, for comparison."),
        Option("thermometer", "", "Id of a registered thermometer with a source (several with "
               "commas): its readings are logged in the job."),
        Option("formats", None, "Of the report, see ocmm report; can be repeated. Default: "
               "polyworks.", flags="--format"),
        Option("archive", None, "local, off, a file or a server. Default: the settings."),
    ),
    "record": (
        Option("out", ..., "File for the recording."),
        Option("seconds", None, "Stop after this much bus time; default: at the end.", "seconds"),
    ),
    "bench": (
        Option("seconds", 2.0, "Duration of each measurement.", "seconds-of-a-bench"),
        Option("memory", 0.0, "Also run the whole chain for this many minutes of bus "
               "time.", "minutes"),
    ),
    "compile": (
        Option("processes", None, "Default: one per core.", "workers"),
    ),
    "plan import": (
        argument("file", ..., "Table (CSV), plan or model in QIF 3.0, or model (STEP, needs an "
                 "extra)."),
        Option("output", None, "Plan document to write.", flags="--output -o"),
        Option("ball", None, "Diameter of the ball, mm; of a model only. Without: the "
               "probe's.", "ball"),
        Option("probe", None, "Probe that touches a model; without: the standard."),
        Option("rig", None, "Cameras that look on; without: the recommended rig."),
        Option("reach", True, "Leave out what stylus and body of the probe cannot reach.",
               flags="--reach/--no-reach"),
        Option("sight", True, "Omit targets at which the cameras see fewer than four LEDs.",
               flags="--sight/--no-sight"),
        Option("only", None, "Of a model: this name (with wildcards * and ?) or face number."),
        Option("without", None, "Of a model: not this name or face number."),
        Option("kind", None, "Of a model: Plane, Cylinder, Cone, 'free form' and so on."),
        Option("least", 0.0, "Smallest diameter, or longer side of a plane, mm.", "size"),
        Option("most", inf, "Largest diameter, or longer side of a plane, mm.", "size"),
        Option("profile", None, "Of a model: its free-form faces too, each with a profile of a "
               "surface against the model; width of the zone, mm.", "zone"),
        Option("as_list", False, "Of a model: print what it offers, and write no "
               "plan.", flags="--list"),
        Option("whole", False, "Of a model: fillets, text and narrow faces too.", flags="--all"),
        Option("tolerances", True, "Of a model (AP242): its tolerances too, with an account of "
               "all.",
               flags="--tolerances/--no-tolerances"),
        Option("general", "", "General tolerance of sizes and distances of a model without their "
               "own: iso2768-f, -m, -c or -v."),
        Option("keep_model", True, "Copy the model beside the plan, so that it is "
               "shown.", flags="--model/--no-model"),
        Option("as_json", False, "Account of the source and findings of the plan as "
               "JSON.", flags="--json"),
    ),
    "plan": (
        Option("name", None, "Name of the plan."),
        Option("part", None, "Name of the part."),
        Option("overwrite", False, "Overwrite an existing document."),
        Option("up", "+z", "Axis of the model that points up: +x, -x, +y, -y, +z or -z."),
        Option("turn", 0.0, "The part is turned about the vertical, degrees.", "turn"),
        argument("plan", ..., "Plan document (TOML)."),
    ),
    "plan account": (
        Option("output", ..., "Inspection plan to write: .csv or .xlsx.", flags="--output -o"),
    ),
    "plan release": (
        Option("who", ..., "Name of the person who answers for the limits.", flags="--by"),
        Option("reason", "", "E.g. the revision of the drawing."),
    ),
    "plan new": (
        Option("output", ..., "Plan document to write.", flags="--output -o"),
    ),
    "plan part": (
        argument("plan_file", ..., "Plan document.", metavar="PLAN"),
        Option("output", ..., "Document of the part to write.", flags="--output -o"),
        Option("rig", None, "Cameras; the recommended ones without."),
    ),
    "archive": (
        Option("archive", None, "local, a file, or postgresql://USER@SERVER/DB. Default: the "
               "settings."),
        Option("outbox", None, "Folder of the outbox. Default: that of this user."),
        Option("station", "", "Only of this station."),
        Option("first", "", "First day, e.g. 2026-11-26.", flags="--from"),
        Option("last", "", "Last day.", flags="--to"),
        Option("most", 500, "Rows at most.", "rows"),
        Option("export", None, "Write the table as .csv or .parquet as well."),
        Option("part", ..., "Name of the part."),
    ),
    "archive send": (
        argument("jobs", None, "Job files, or folders of them, to be put in first."),
        Option("follow", False, "Go on until stopped, as a service does."),
        Option("retry", False, "Try jobs that were set aside again."),
    ),
    "archive set-up": (
        Option("with_roles", True, "Make the three roles as well.", flags="--roles/--no-roles"),
    ),
    "archive admit": (
        argument("login", ..., "Login of the server, e.g. station3."),
        argument("station", ..., "Name of its station, e.g. \"Station 3\"."),
    ),
    "archive replace-computer": (
        argument("station", ..., "Name of the station."),
    ),
    "archive trend, archive rr": (
        Option("characteristic", ..., "Name of the characteristic."),
    ),
    "archive used": (
        argument("kind", ..., "calibration, tip, probe, artefact, rig, plan or reference."),
        argument("what", ..., "Its hash, serial number or name."),
    ),
    "archive cpk": (
        Option("by", "month", "month"),
        Option("characteristic", "", "Name of the characteristic."),
    ),
    "archive passed": (
        Option("operator", "", "Only this one."),
        Option("part", "", "Name of the part."),
    ),
    "archive export": (
        argument("view", ..., "View, e.g. archived_result (docs/quality/archive.md)."),
        argument("file", ..., "Ends in .csv or .parquet."),
        Option("most", 10000000, "Rows at most.", "rows"),
    ),
    "archive rebuild": (
        argument("new", ..., "The new archive: a file, or a set-up database."),
        argument("folders", None, "Folders of job files; default: the old archive."),
        Option("stations", None, "KEY=STATION: name of the station that signs with this "
               "key.", flags="--name"),
    ),
    "archive verify": (
        argument("folders", None, "Job files or folders to hold against the archive."),
        Option("against", "", "Another archive that should hold the same rows."),
        Option("quick", False, "Only whether files are as they were stored."),
        Option("mark", False, "Exclude faulty rows from statistics; needs --by."),
        Option("who", "", "Name for the record.", flags="--by"),
    ),
    "archive recall": (
        Option("calibrations", None, "Calibration folder of a station; repeat it for each. "
               "Default: that of this user."),
        Option("probes", None, "Probe record folder. Default: that of this user."),
        Option("who", "", "Your name: stores the recall; jobs whose verdicts do not hold are held "
               "back at every station. Without it, nothing is stored.", flags="--by"),
        Option("artefact", "", "Serial number of an artefact found wrong."),
        Option("tip", "", "Name or hash of a tip found wrong."),
        Option("calibration", "", "Hash of a calibration found wrong."),
        Option("since", None, "Since when it was wrong."),
    ),
    "audit verify": (
        argument("paths", ..., "Any file or folder of this program: jobs, histories of "
                 "calibrations, acceptance records, studies, the register of artefacts, plans, "
                 "templates, settings, reports, certificates."),
        Option("line", "", "Text of the code on the report of a job."),
        Option("everything", False, "List all steps, not only the last 10.", flags="--all"),
    ),
    "audit release": (
        argument("files", ..., "Templates or other documents (TOML)."),
        Option("who", ..., "Name of the person who answers for them.", flags="--by"),
        Option("reason", "", ""),
    ),
    "audit adopt": (
        argument("jobs", ..., "Job files (.ocmm)."),
        Option("who", ..., "Name of the person who answers for them."),
    ),
    "key show": (
        Option("x509", None, "Also write the X.509 certificate of this station (PEM), by which "
               "other programs verify its calibration certificates."),
    ),
    "key trust": (
        argument("public", ..., "Public key that `ocmm key show` prints on the other station."),
        Option("name", ..., "Name of the other station."),
    ),
    "key": (
        Option("who", ..., "Name of the person who decides."),
    ),
    "key replace": (
        Option("token", "", "Label of a PKCS #11 token or TPM that the key is made in."),
        Option("module", None, "PKCS #11 library of its maker, e.g. libtpm2_pkcs11.so."),
        Option("pin_file", None, "File with the PIN of its user; otherwise it is requested."),
        Option("in_file", False, "Take the key out of use that is in a token."),
    ),
    "certificate make": (
        argument("folder", ..., "Folder of the records of one rig or of one probe, or an "
                 "acceptance record."),
        Option("calibration", False, "Of cameras: their calibration with all parameters, or its "
               "last verification.", flags="--calibration/--verification"),
        Option("as_found", None, "Acceptance record of the state before the adjustment; default: "
               "the one that belongs to it in the same folder."),
        Option("tip", "", "Tip of the probe."),
        Option("out", Path(), "Folder of the files."),
        Option("template", None, "Template of the report: letterhead, machine, place."),
        Option("customer", "", "Default: the laboratory itself."),
        Option("place", "", "Place of the test."),
        Option("humidity", "", "Of the air, %, if no record has it."),
        Option("pressure", "", "Of the air, hPa, if no record has it."),
        Option("pages", True, "Also write a PDF.", flags="--pages/--no-pages"),
    ),
    "certificate check, certificate artefact": (
        argument("file", ..., "Digital calibration certificate (XML)."),
    ),
    "certificate artefact": (
        argument("kind", ..., "Kind of artefact."),
        argument("out", ..., "Artefact document (TOML) to write."),
        Option("due", ..., "Holds until, YYYY-MM-DD: your own rule."),
        Option("quantity", "", "Part of the name, if there are several lengths."),
        Option("expansion", None, "1/K, if the certificate has none.", "expansion"),
        Option("expansion_sigma", None, "Its standard uncertainty, 1/K.", "expansion-sigma"),
    ),
    "certificate trust": (
        argument("file", ..., "X.509 certificate of the laboratory (PEM)."),
    ),
    "correct": (
        argument("job", ..., "Job file.", metavar="JOB"),
        argument("document", ..., "Document of corrections (TOML).", metavar="DOCUMENT"),
        argument("values", ..., "Values that the control shows.", metavar="NAME=NUMBER..."),
        Option("dialect", ..., "Control that reads the file, mtconnect or csv."),
        Option("out", ..., "New file for the control."),
        Option("who", ..., "Your name, for the register.", flags="--by"),
        Option("confirm", "", "Code of the preview that you looked at."),
        Option("practice", False, "Practice with simulated jobs: for no machine; files contain "
               "comments only."),
        Option("recut", False, "The part was cut again after the last change, although its serial "
               "number was used then."),
        Option("json", False, "Print one JSON object instead of the tables."),
        Option("records", None, "Folder of the registers; default: that of this user."),
        Option("probes", None, "Probe record folder. Default: that of this user."),
        Option("calibrations", None, "Calibration folder. Default: that of this user."),
    ),
    "plan rig": (
        argument("document", ..., "Rig plan (TOML).", metavar="RIG_PLAN"),
        Option("out", Path(), "Folder for the prediction."),
        Option("search", 3000, "Placements tried, 0 for none.", "placements-tried"),
        Option("seed", 1, "Seed of the search.", "seed"),
        Option("rig", None, "Rig document: compare its calibration in force with the plan."),
        Option("calibrations", None, "Calibration folder of --rig; default: that of this user."),
        Option("pdf", False, "Also write the sheet as PDF."),
        Option("as_json", False, "Print the prediction as JSON instead.", flags="--json"),
    ),
}  # fmt: skip
"""By the commands that take them."""

"""Options of the commands for acceptance tests, artefacts and gauge studies."""

from ocmm_core.options import DEFAULT_OPERATOR, Option, argument

TABLE = {
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
        Option("name", "", "What commands call it.", flags="--id"),
        Option("kind", "", "sphere, bar, gauge block, part, plate, dumbbell, thermometer."),
        Option("title", "", "Of the artefact.", flags="--name"),
        Option("maker", "", ""),
        Option("serial", "", "Serial number of the artefact."),
        Option("laboratory", "", "That calibrated it."),
        Option("certificate", "", "Its number."),
        Option("certificate_file", None, "Its file, for the hash."),
        Option("due", "", "It holds until then, like 2027-06-30."),
        Option("size", None, "mm at 20 °C; once for each nest of a bar, from 0.", "size"),
        Option("u", 0.0, "U (k = 2), mm; K for a thermometer.", "expanded", flags="--U"),
        Option("u_per_length", 0.0, "Its part that grows with the "
               "length.", "per-length", flags="--U-per-length"),
        Option("form", 0.0, "Certified form error, mm.", "form"),
        Option("expansion", 1.15e-05, "1/K.", "expansion"),
        Option("expansion_u", 1e-06, "Its standard uncertainty, 1/K.", "expansion-sigma"),
        Option("supports", "", "How it is held."),
        Option("replace", False, "A newer certificate of an artefact that is there."),
    ),
    "artefact": (
        Option("who", DEFAULT_OPERATOR, "Name for the register."),
        Option("folder", None, "Of the register; default: that of this user."),
    ),
    "artefact show, artefact remove": (
        argument("name", ..., "Id of the artefact."),
    ),
    "artefact read": (
        argument("name", ..., "Id of a thermometer; several with commas."),
    ),
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
    "msa report": (
        Option("level", 0.25, "Interaction pooled above this p-value.", "level"),
    ),
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

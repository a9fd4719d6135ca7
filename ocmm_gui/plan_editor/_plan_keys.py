"""The keys of the plan editor and what each does, in words."""

from __future__ import annotations

from ocmm_gui.kit import ActionInfo, later

KEYS = (
    ActionInfo("add", later("Feature"), later("Add a feature after the selected one"), ("F6",)),
    ActionInfo(
        "construct", later("Construct"),
        later("Add a construction from the selected feature"), ("Shift+F6",),
    ),
    ActionInfo(
        "tolerance", later("Tolerance"),
        later("Add a characteristic of the selected feature"), ("F7",),
    ),
    ActionInfo("align", later("Alignment"), later("Define the part alignment"), ("F5",)),
    ActionInfo("faces", later("Faces"),
               later("Align by a best fit to faces of the model"), ("Shift+F5",)),
    ActionInfo("remove", later("Remove"), later("Remove the selected item"), ("F9",)),
    ActionInfo("earlier", later("Earlier"), later("Move the selected item up"), ("Ctrl+F6",)),
    ActionInfo("later", later("Later"), later("Move the selected item down"), ("Ctrl+F7",)),
    ActionInfo("undo", later("Undo"), later("Undo the last change"), ("F10",)),
    ActionInfo("redo", later("Redo"), later("Redo the last undone change"), ("Shift+F10",)),
    ActionInfo("picture", later("Picture"), later("Attach a picture to the selected feature"),
               ("Shift+F7",)),
    ActionInfo("teach", later("Teach"), later("Take the nominals from the current part"),
               ("Ctrl+F9",)),
    ActionInfo(
        "import", later("Import"),
        later("Import features from CSV or STEP, or a frame document for the alignment"),
        ("Shift+F9",),
    ),
    ActionInfo("new", later("New"), later("Start a new plan"), ("Ctrl+F10",)),
    ActionInfo("open", later("Open"), later("Open another plan file"), ("Ctrl+F8",)),
    ActionInfo("save", later("Save"), later("Write the plan to a file"), ("F8",)),
    ActionInfo("measure", later("Measure"), later("Start a job with this plan"), ("Shift+F8",)),
)  # fmt: skip

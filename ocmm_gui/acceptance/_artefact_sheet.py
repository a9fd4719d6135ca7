from ocmm_gui.kit import Sheet


class ArtefactSheet(Sheet):
    pass

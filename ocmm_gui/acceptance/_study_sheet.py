from ocmm_gui.kit import Sheet


class StudySheet(Sheet):
    pass

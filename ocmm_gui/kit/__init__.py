"""Building blocks of every screen: themes, texts, widgets, keys, sounds.

In: themes, settings, values of the core. Out: widgets, texts with units, sounds, one log of
notices.

Start with `_texts` (translation, languages, numbers, lengths, dates), `_theme` (three themes from
one table) and `_messages` (sentences); then `_marks` (a shape per outcome, painted widgets),
`_actions` (table of all keys) with `_shortcuts` (texts, changes, buttons), `_sheet` (pages closed
by Esc), `_parts` (also layouts), `_narrow` (fitted texts), `_panels` (non-modal questions, recent
plans, jobs and folders). `_notify` shows errors, `_sound` plays sounds. The package `work` runs
lengthy work. First package of the window: it must not import screens or the station.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_gui.kit._actions import ACTIONS, FINISH_KEYS, TAKE_KEYS, UNDO_KEYS, ActionInfo, Mode
    from ocmm_gui.kit._marks import (
        SCENE_LEAST, SCENE_SIZE, FitText, Mark, PaintedWidget, feature_mark, ink, mark_colour,
        paint_mark, verdict_mark,
    )  # fmt: skip
    from ocmm_gui.kit._messages import (
        DASHES, PAUSED, active_feature, approach_words, basis_words, characteristics_of,
        counted_line, distance_words, feature_title, form_words, has_failed, header_words, is_held,
        kind_value, led_name, limit_words, millimetres, mode_words, named_quantity, next_step,
        outlier_count, outlier_words, progress_word, quantity, reference_led_name, reference_words,
        seen_cameras, seen_targets, shape_word, slot_names, step_text, trouble, verdict_line,
    )  # fmt: skip
    from ocmm_gui.kit._narrow import HintField, NarrowButton, NarrowItems, PlainLabel, is_longer
    from ocmm_gui.kit._notify import (
        PROCEDURE, Banner, ErrorHooks, Level, Notice, NoticeCentre, NoticeWindow,
    )  # fmt: skip
    from ocmm_gui.kit._panels import (
        AnswerPanel, OwnKeysField, PathPanel, ReasonPanel, RecentPlaces, WorkBar, is_shipped,
        list_step,
    )  # fmt: skip
    from ocmm_gui.kit._parts import (
        ColouredRow, DataTable, NumberTable, dressed, fill, hbox, panel, scrolled, sentence_label,
        stacked, value_label, vbox,
    )  # fmt: skip
    from ocmm_gui.kit._sheet import (
        ChoiceBox, FormField, LateParts, Sheet, TableImport, caption, form_field, form_grid,
    )  # fmt: skip
    from ocmm_gui.kit._shortcuts import (
        ARROWS, DEBOUNCE_S, F_KEYS, SHORT, DebouncedCommand, bind_actions, conflict_of, keeps_keys,
        key_words, large_button, make_action, make_actions, make_button, shortcuts_of, show_mode,
        usable_keys, use_shortcuts,
    )  # fmt: skip
    from ocmm_gui.kit._sound import Approach, Sound, SoundPlayer, verdict_sound
    from ocmm_gui.kit._texts import (
        INCH_MM, LANGUAGES, NumberStyle, chosen_language, day_words, field_length, is_ambiguous,
        language_in_use, later, length_number, length_words, literal, localised, numbers_in_use,
        read_number, said, said_word, split_unit, style_of, time_words, to_mm, tr, tr_all,
        typed_value, unit_word, use_language, use_numbers, with_unit,
    )  # fmt: skip
    from ocmm_gui.kit._theme import (
        CAP_HEIGHT, DEFAULT_THEME, LEFT, RIGHT, THEMES, WRAPPED, Theme, Themed, ThemedWidget,
        apply_theme, digit_font, dress, dress_application, far_type, fitted, text_font, use_role,
        verdict_colour, wrapped_pixels,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ACTIONS", "ARROWS", "CAP_HEIGHT", "DASHES", "DEBOUNCE_S", "DEFAULT_THEME", "FINISH_KEYS",
    "F_KEYS", "INCH_MM", "LANGUAGES", "LEFT", "PAUSED", "PROCEDURE", "RIGHT", "SCENE_LEAST",
    "SCENE_SIZE", "SHORT", "TAKE_KEYS", "THEMES", "UNDO_KEYS", "WRAPPED", "ActionInfo",
    "AnswerPanel", "Approach", "Banner", "ChoiceBox", "ColouredRow", "DataTable",
    "DebouncedCommand", "ErrorHooks", "FitText", "FormField", "HintField", "LateParts", "Level",
    "Mark", "Mode", "NarrowButton", "NarrowItems", "Notice", "NoticeCentre", "NoticeWindow",
    "NumberStyle", "NumberTable", "OwnKeysField", "PaintedWidget", "PathPanel", "PlainLabel",
    "ReasonPanel", "RecentPlaces", "Sheet", "Sound", "SoundPlayer", "TableImport", "Theme",
    "Themed", "ThemedWidget", "WorkBar", "active_feature", "apply_theme", "approach_words",
    "basis_words", "bind_actions", "caption", "characteristics_of", "chosen_language",
    "conflict_of", "counted_line", "day_words", "digit_font", "distance_words", "dress",
    "dress_application", "dressed", "far_type", "feature_mark", "feature_title", "field_length",
    "fill", "fitted", "form_field", "form_grid", "form_words", "has_failed", "hbox", "header_words",
    "ink", "is_ambiguous", "is_held", "is_longer", "is_shipped", "keeps_keys", "key_words",
    "kind_value", "language_in_use", "large_button", "later", "led_name", "length_number",
    "length_words", "limit_words", "list_step", "literal", "localised", "make_action",
    "make_actions", "make_button", "mark_colour", "millimetres", "mode_words", "named_quantity",
    "next_step", "numbers_in_use", "outlier_count", "outlier_words", "paint_mark", "panel",
    "progress_word", "quantity", "read_number", "reference_led_name", "reference_words", "said",
    "said_word", "scrolled", "seen_cameras", "seen_targets", "sentence_label", "shape_word",
    "shortcuts_of", "show_mode", "slot_names", "split_unit", "stacked", "step_text", "style_of",
    "text_font", "time_words", "to_mm", "tr", "tr_all", "trouble", "typed_value", "unit_word",
    "usable_keys", "use_language", "use_numbers", "use_role", "use_shortcuts", "value_label",
    "vbox", "verdict_colour", "verdict_line", "verdict_mark", "verdict_sound", "with_unit",
    "wrapped_pixels",
]  # fmt: skip

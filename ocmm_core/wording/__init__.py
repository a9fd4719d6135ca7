"""Messages of the core in the language of the user; the sentences themselves are in the modules.

In: a sentence as it was said, in English, and the language. Out: the sentence in that language, or
as it was where it is not known without doubt.

Read `_pattern` first: a sentence with names for what is filled in, and how it is recognised.
`_translation` finds which sentence was said, and which language is wanted, as a paper
needs both.
It must not know who says what: every other room may say something.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.wording._pattern import Pattern
    from ocmm_core.wording._translation import (
        ENGLISH, LANGUAGES, LANGUAGE_VARIABLE, Speech, Translation, in_language, language_of,
        load_translation,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "ENGLISH", "LANGUAGES", "LANGUAGE_VARIABLE", "Pattern", "Speech", "Translation", "in_language",
    "language_of", "load_translation",
]  # fmt: skip

"""Elements of a QIF document: names, ids, numbers with all their digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from lxml import etree

from ocmm_core.export.qif._check import NAMESPACE
from ocmm_core.export.qif._terms import Pair, Value
from ocmm_core.export.report import Units


class Writer:
    """Make elements and assign ids."""

    def __init__(self) -> None:
        self.last_id = 0
        # The stubs do not know that the default namespace has no name.
        names = {None: NAMESPACE}
        self.root = etree.Element(f"{{{NAMESPACE}}}QIFDocument", nsmap=names)  # type: ignore[arg-type]

    def add(
        self,
        parent: etree._Element,
        name: str,
        content: Value | None = None,
        *,
        own_id: bool = False,
    ) -> etree._Element:
        """Add an element with text or numbers, and optionally an id."""
        element = etree.SubElement(parent, f"{{{NAMESPACE}}}{name}")
        if own_id:
            self.last_id += 1
            element.set("id", str(self.last_id))
        if content is not None:
            element.text = text_of(content)
        return element

    def add_all(self, parent: etree._Element, pairs: Sequence[Pair]) -> None:
        for name, content in pairs:
            if isinstance(content, list):
                self.add_all(self.add(parent, name), content)
            else:
                self.add(parent, name, content)

    def add_ids(self, parent: etree._Element, name: str, ids: Sequence[str]) -> None:
        """Add a list of references unless empty."""
        if ids:
            element = self.add(parent, name)
            element.set("n", str(len(ids)))
            for one in ids:
                self.add(element, "Id", one)

    def add_attributes(self, parent: etree._Element, values: Mapping[str, float | str]) -> None:
        """Add data without an element in QIF; they come first in their parent."""
        if not values:
            return
        element = self.add(parent, "Attributes")
        element.set("n", str(len(values)))
        for name, value in values.items():
            kind = "AttributeStr" if isinstance(value, str) else "AttributeD1"
            one = self.add(element, kind)
            one.set("name", name)
            one.set("value", text_of(value))


class Lists:
    """The four lists of features or characteristics: definitions, nominals, items, measurements."""

    def __init__(self, writer: Writer, parent: etree._Element, word: str) -> None:
        self.definitions = writer.add(parent, f"{word}Definitions")
        self.nominals = writer.add(parent, f"{word}Nominals")
        self.items = writer.add(parent, f"{word}Items")
        self._parent = parent

    def count(self) -> None:
        """Write the counts; empty lists are removed."""
        for element in (self.definitions, self.nominals, self.items):
            count_children(element, self._parent)


def count_children(element: etree._Element, parent: etree._Element) -> None:
    """Write the number of children of an element, or remove an empty one from its parent."""
    if len(element):
        element.set("n", str(len(element)))
    else:
        parent.remove(element)


def text_of(content: Value) -> str:
    """Return text or numbers for the document: all digits, never an exponent."""
    if isinstance(content, str):
        return content
    return " ".join(
        np.format_float_positional(value + 0.0, trim="0") for value in np.atleast_1d(content)
    )


def finite(name: str, value: float) -> float:
    """Return a number; StorageError if it cannot be reported."""
    return Units.finite(name, value, 0).value

"""Numbers and elements of XML files."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement


def numbers(values: Iterable[float]) -> str:
    """Return numbers so that reading them gives the same ones; numpy's own spelling is none that others read."""
    return " ".join(repr(float(value)) for value in values)


Value = str | float | Iterable[float]
"""What an attribute can hold."""


def child(parent: Element, tag: str, text: str | float | None = None, /, **attributes: Value) -> Element:
    """Add a child with attributes, and text or a number inside; return it.

    Attributes may be words, numbers or rows of numbers.
    """
    element = SubElement(parent, tag, {key: _text(value) for key, value in attributes.items()})
    if text is not None:
        element.text = _text(text)
    return element


def document(root: Element) -> str:
    """Return the text of an XML file."""
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _text(value: Value) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, int | float):
        return repr(float(value)) if isinstance(value, float) else str(value)
    return numbers(value)

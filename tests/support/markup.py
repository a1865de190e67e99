"""What a page says, and whether its markup holds together."""

from __future__ import annotations

import re
from html.entities import html5

from lxml import etree

_XML = {"lt", "gt", "amp", "quot"}


def tree(fragment: str) -> etree._Element:
    """A fragment of HTML whose elements are all closed, as XML. Raises XMLSyntaxError for any other."""

    def numeric(match: re.Match[str]) -> str:
        return match[0] if match[1] in _XML else "".join(f"&#{ord(sign)};" for sign in html5[f"{match[1]};"])

    return etree.fromstring(f"<body>{re.sub(r'&([A-Za-z]+);', numeric, fragment)}</body>")


def plain(fragment: str) -> str:
    """Its text, without the invisible signs of MathML."""
    text = "".join(tree(fragment).itertext()).replace("\u2061", "")
    return " ".join(text.split())

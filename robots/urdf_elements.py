"""XML as elements with the line of each, read with the standard library and without following anything."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from robots.errors import RobotFileError

MAX_BYTES = 16_000_000
"""No URDF comes near this size; a mesh given by mistake does."""


@dataclass
class Element:
    """One XML element, the line where it begins, and the text that stands directly in it."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def child(self, tag: str) -> Element | None:
        """The first child of that name."""
        return next((child for child in self.children if child.tag == tag), None)

    def of(self, tag: str) -> list[Element]:
        """All children of that name, in file order."""
        return [child for child in self.children if child.tag == tag]


def parse_elements(content: bytes, file: Path) -> Element:
    """The root element of the XML file ``file`` with these bytes.

    Raises:
        RobotFileError: no XML, or with a document type (with entities of its own two readers see two files);
            with its line.
    """
    top = Element("", {}, 0)
    stack = [top]
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, parser.CurrentLineNumber)
        stack[-1].children.append(element)
        stack.append(element)

    def end(_tag: str) -> None:
        stack.pop()

    def characters(text: str) -> None:
        stack[-1].text += text.strip()

    def document_type(*_declaration: object) -> None:
        line = parser.CurrentLineNumber
        raise RobotFileError(file, "<!DOCTYPE …> is not part of a URDF", line=line, allowed="elements only")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    parser.StartDoctypeDeclHandler = document_type
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        problem = f"not XML: {expat.ErrorString(error.code)} at column {error.offset + 1}"
        raise RobotFileError(file, problem, line=error.lineno, allowed="a URDF file") from None
    except (LookupError, ValueError) as error:  # an encoding that Python does not know, or is none of text
        raise RobotFileError(file, f"not XML: {error}", line=1, allowed="a URDF file in UTF-8") from None
    return top.children[0]

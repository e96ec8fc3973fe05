"""Files that are no programs: told by what they hold, never by their name.

A picture or a machine file that is processed by mistake is read as text that nobody understands,
copied, and left lying under a program's name. This module knows what such files begin with.

Rule: conservative. What may be a program of any dialect is one: comments and names in front of it,
labels, macros, blocks that begin with a bracket. Only what no control could run is refused.
"""

from __future__ import annotations

import re

from gcodejerk.errors import Place, ProgramError

HEAD = 1 << 14
"""Bytes that are looked at."""
_MARKS = {
    b"\x89PNG": "a picture (PNG)",
    b"\xff\xd8\xff": "a picture (JPEG)",
    b"GIF8": "a picture (GIF)",
    b"II*\0": "a picture (TIFF)",
    b"MM\0*": "a picture (TIFF)",
    b"RIFF": "a RIFF file (sound, film or picture)",
    b"%PDF-": "a PDF document",
    b"%!PS": "a PostScript document",
    b"{\\rtf": "a text document (RTF)",
    b"PK\x03\x04": "a ZIP archive or office document",
    b"\xd0\xcf\x11\xe0": "an office document",
    b"\x1f\x8b": "a gzip archive",
    b"7z\xbc\xaf": "a 7z archive",
    b"\x7fELF": "a program for a computer (ELF)",
    b"ISO-10303-21": "a model (STEP)",
    b"#!/": "a script",
}
_MARKUP = re.compile(rb"<(?:!--|!DOCTYPE|\?xml|html[\s>])", re.IGNORECASE)
_ELEMENT = re.compile(rb"<[A-Za-z][\w:.-]*[\s/>]")
_JSON = re.compile(rb"\{\s*(?:\"|\})|\[\s*(?:\"|\{\s*\"|\])")
_YAML_LINE = re.compile(
    rb"\s*(?:#( .*)?|---( .*)?|(?:- )?[\"']?[A-Za-z_][\w.-]*[\"']?\s*:(?:\s.*)?|- .*|[\]}],?)?"
)
_YAML_KEY = re.compile(rb"\s*[\"']?[A-Za-z_][\w.-]*[\"']?\s*:(?:\s|$)")
LEAST_KEYS = 3
"""Lines `key: value`, and nothing else, that make a file YAML: labels stand between blocks."""


def kind_of(head: bytes) -> str | None:
    r"""What a file is that is no program.

    Parameters
    ----------
    head : bytes
        Its beginning.

    Returns
    -------
    str or None
        None where it may be a program.

    Examples
    --------
    >>> kind_of(b'{"gcodejerk": "0.1.0"}')
    'a JSON document'
    >>> kind_of(b"START: G0 X1\nG1 X2\n") is None
    True
    """
    for mark, kind in _MARKS.items():
        if head.startswith(mark):
            return kind
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if _MARKUP.match(text) or (_ELEMENT.match(text) and (b"</" in text or b"/>" in text)):
        return "a web page, a drawing or other markup (HTML, SVG, XML)"
    if _JSON.match(text):
        return "a JSON document"
    lines = text.splitlines()
    if len(head) == HEAD:
        lines = lines[:-1]
    keys = sum(_YAML_KEY.match(line) is not None for line in lines)
    if keys >= LEAST_KEYS and all(_YAML_LINE.fullmatch(line.rstrip()) for line in lines):
        return "a list of keys and values, such as a machine file (YAML)"
    return None


def refuse_foreign(head: bytes, name: str) -> None:
    """Refuse what is no program.

    Raises
    ------
    ProgramError
        It is something else.
    """
    kind = kind_of(head)
    if kind is not None:
        raise ProgramError(
            f"this is no NC program but {kind}", "name the program itself", Place(name)
        )

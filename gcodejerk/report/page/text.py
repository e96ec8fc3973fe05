"""Text from programs and machine files on a page: nothing of it is markup, all of it can be seen.

Rule: whatever a program holds, a page shows it and obeys none of it. Characters without a shape of
their own get one, so that no comment hides anything from the reader.
"""

from __future__ import annotations

import html
import json
import re
from typing import Any

_PICTURES = {k: 0x2400 + k for k in range(32)} | {0x7F: 0x2421}
"""Control characters, and the signs that stand for them."""
_UNSEEN = re.compile("[\x80-\x9f\u00ad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff]")
"""Characters that show nothing, or turn the direction of what follows."""
_CODE = re.compile(r"`([^`]+)`")


def visible(text: str | bytes) -> str:
    r"""Text with a sign for each character that has none.

    Parameters
    ----------
    text : str or bytes
        Bytes are read as UTF-8, or, where they are none, as Latin-1.

    Returns
    -------
    str
        Without blanks around it.

    Examples
    --------
    >>> visible(b"G0 X1 (\x07)\r"), visible(b"(10 \xb5m)"), visible("a\u202eb")
    ('G0 X1 (␇)', '(10 µm)', 'a�b')
    """
    known = _decoded(text) if isinstance(text, bytes) else text
    shown = _UNSEEN.sub("\ufffd", known.strip().translate({**_PICTURES, 9: " "}))
    # A file's name need not be UTF-8.
    return shown.encode("utf-8", "backslashreplace").decode("utf-8")


def _decoded(text: bytes) -> str:
    """Bytes as UTF-8, or, where they are none, as Latin-1."""
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def escaped(text: str | bytes) -> str:
    """Visible text as it stands in HTML.

    Examples
    --------
    >>> escaped("</script>")
    '&lt;/script&gt;'
    """
    return html.escape(visible(text), quote=True)


def with_code(text: str) -> str:
    """Text of ours as HTML, with what stands in backquotes as code.

    Examples
    --------
    >>> with_code("say `wrap` < 1")
    'say <code>wrap</code> &lt; 1'
    """
    return _CODE.sub(r"<code>\1</code>", html.escape(text, quote=True))


def script_data(record: dict[str, Any]) -> str:
    """A record as JSON that can stand within a script element, whatever it holds."""
    text = json.dumps(record, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")

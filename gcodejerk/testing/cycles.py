"""Drawn programs with drilling cycles: every plane, mode and word that a series can have.

Rule: a drawn program is one that the controller accepts, and that tells all that a series needs.
"""

from __future__ import annotations

from hypothesis import strategies as st

from gcodejerk.nc.dialects.dialect import PLANES

Draw = st.DrawFn
_EXTRA = {"G82": "P", "G86": "P", "G89": "P", "G83": "Q", "G73": "Q"}
_CODES = ("G81", "G82", "G83", "G73", "G85", "G86", "G89")


def _number(draw: Draw, low: float, high: float) -> str:
    """Draw a number with up to three decimals, in one of its spellings."""
    places = draw(st.integers(0, 3))
    scale = 10**places
    value = draw(st.integers(int(low * scale), int(high * scale))) / scale
    text = f"{value:.{places}f}"
    if places and draw(st.booleans()):
        text = text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text
    return text if text.strip("+-.") else "0"


def _words(draw: Draw, code: str, plane: tuple[str, str, str], whole: bool, near: bool) -> str:
    """Draw the words of a block: all that a cycle needs, or what changes."""
    words = [f"{axis}{_number(draw, -20, 20)}" for axis in plane[:2] if draw(st.booleans())]
    if whole or draw(st.integers(0, 3)) == 0:
        words.append(f"{plane[2]}{_number(draw, -20, -1)}")
    if whole or draw(st.integers(0, 3)) == 0:
        words.append(f"R{_number(draw, -5 if near else 0, 12)}")
    extra = _EXTRA.get(code)
    if extra and (whole or draw(st.integers(0, 3)) == 0):
        number = _number(draw, 0.1, 0.5) if extra == "P" else _number(draw, 1, 9)
        words.append(extra + (number if float(number) > 0 else "1"))
    if not words or not any(word[0] in "XYZ" for word in words):
        words.append(f"{plane[0]}{_number(draw, -20, 20)}")
    if draw(st.integers(0, 5)) == 0:
        words.append(f"L{draw(st.integers(1, 3))}")
    if draw(st.integers(0, 7)) == 0:
        words.append(f"F{draw(st.integers(50, 900))}")
    return draw(st.sampled_from([" ", " ", ""])).join(words)


def _series(draw: Draw) -> list[str]:
    """Draw a series of holes with the blocks around it."""
    number = draw(st.sampled_from([170, 170, 170, 180, 190]))
    plane = PLANES[number]
    incremental = draw(st.integers(0, 2)) == 0
    lines = [
        f"G90 G{number // 10} G0 X{_number(draw, -20, 20)} Y{_number(draw, -20, 20)} "
        f"Z{_number(draw, -20, 20)}"
    ]
    code = draw(st.sampled_from(_CODES))
    head = [draw(st.sampled_from(["G98", "G99"])), "G91" if incremental else "G90", code]
    lines.append(" ".join([*head, _words(draw, code, plane, True, incremental)]))
    for _ in range(draw(st.integers(0, 4))):
        kind = draw(st.integers(0, 11))
        if kind < 5:
            lines.append(_words(draw, code, plane, False, incremental))
        elif kind < 7:
            code = draw(st.sampled_from(_CODES))
            lines.append(f"{code} {_words(draw, code, plane, True, incremental)}")
        elif kind < 9:
            # R below zero means one thing in G91 and would be below the bottom in G90.
            modes = ["G98", "G99"] if incremental else ["G98", "G99", "G98", "G99", "G90", "G91"]
            mode = draw(st.sampled_from(modes))
            lines.append(f"{mode} {_words(draw, code, plane, False, incremental)}")
        else:
            lines.append(
                draw(st.sampled_from(["M8", "(chips)", "", "G4 P.2", "F333", "G98", "G99"]))
            )
    lines.append(
        draw(st.sampled_from(["G80", "G80", f"G0 {plane[2]}30", f"G1 {plane[2]}30", "G00"]))
    )
    return lines


@st.composite
def cycle_programs(draw: Draw) -> bytes:
    """Draw programs of drilling cycles in the dialect of LinuxCNC.

    Parameters
    ----------
    draw : callable
        Given by hypothesis.

    Returns
    -------
    bytes
        A program that ends with M2.

    Examples
    --------
    >>> isinstance(cycle_programs(), st.SearchStrategy)
    True
    """
    path = draw(st.sampled_from(["G64", "G64 P0.05", "G64 P.1 Q0.02", "G61", "G61.1", "G8"]))
    unit = draw(st.sampled_from(["G21", "G21", "G20"]))
    lines = [f"{unit} G40 {path}", f"M3 S800 F{draw(st.integers(50, 900))}"]
    for _ in range(draw(st.integers(1, 3))):
        lines += _series(draw)
    lines.append("M2")
    if draw(st.booleans()):
        lines = [f"N{10 * k} {line}" if line else line for k, line in enumerate(lines, 1)]
    newline = draw(st.sampled_from(["\n", "\n", "\r\n"]))
    return newline.join(lines).encode() + draw(st.sampled_from([b"", newline.encode()]))

"""The text of one block of a drilling cycle that is written out.

::

    (gcodejerk: N120 G98 G81 X10. Y5. Z-6. R2. M8)   names the original
    N120 G98 M8                                      what else the block says
    G61                                              LinuxCNC runs cycles in exact path mode
    G0 X10. Y5.                                      the moves
    ...
    G64 P0.05                                        the path mode that the program has
    M0                                               what takes effect after motion

Where the program's path mode is not known, so that nothing could return to it, `G4 P0` follows
every move instead: the tool comes to rest where exact path mode would not have rounded the corner.
On a control with a word for that (`G9`), it stands in front of every feed move, and where G0 or G1
holds on behind a cycle, the one that the program has in force stands behind the moves.

Rule: words in the plane are the program's own, everything else is a decimal.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.cycles.drilling import Call, DrillingRules, Kind, drill
from gcodejerk.cycles.numbers import plain, whole
from gcodejerk.cycles.series import EXACT, HARMLESS_LETTERS, STOPS, Moment
from gcodejerk.nc.dialects.dialect import PLANES
from gcodejerk.nc.dialects.gcodes import G0, G1, G17, G91
from gcodejerk.nc.text.block import Block

COMMENT_LENGTH = 69
"""Controllers and senders with short lines choke on longer comments."""


def write_block(
    text: bytes, block: Block, call: Call, moment: Moment, rules: DrillingRules, comments: bool
) -> list[bytes]:
    """The lines that stand for a block, without line ends.

    Parameters
    ----------
    text : bytes
        The block, without its line end.
    block : Block
        Its words.
    call : Call
        What it makes.
    moment : Moment
        In which state.
    rules : DrillingRules
        The control's.
    comments : bool
        Name the block in a comment.

    Returns
    -------
    list of bytes
        Empty where the block says nothing else and the tool is at the bottom already.
    """
    state = moment.state
    kept, stops, rest, begin = [], [], [], 0
    for word in block.words:
        stop = word.letter == "M" and word.value in STOPS
        cycle = word.letter == "G" and round((word.value or 0.0) * 10) == moment.cycle
        if not (stop or cycle or word.letter not in HARMLESS_LETTERS | {"G", "M"}):
            kept.append(word)
            continue
        rest.append(text[begin : word.begin].strip(b" \t"))
        begin = word.end
        if stop:
            stops.append(b"".join(word.text.split()))
    rest.append(text[begin:].strip(b" \t"))
    lines = [_comment(block)] if comments else []
    if kept or block.comments:
        lines.append(b" ".join(part for part in rest if part))
    moves = _moves(block, call, moment, rules)
    if rules.own_group:
        lines += moves
    elif _stops(moment):
        lines += _with_stops(moves)
    elif state.path in EXACT or moment.path is None:
        lines += moves
    else:
        lines += [b"G61", *moves, moment.path.text(state.unit)]
    return lines + ([b" ".join(stops)] if stops else [])


def _stops(moment: Moment) -> bool:
    """Whether the path mode is not known well enough to be stated again."""
    return moment.state.path not in EXACT and (moment.state.path != 64 or moment.path is None)


def _moves(block: Block, call: Call, moment: Moment, rules: DrillingRules) -> list[bytes]:
    """The moves of a call as blocks."""
    incremental = moment.state.distance == G91
    along = PLANES[moment.state.plane or G17][2].encode()
    hole_words, going = _to_hole(block, moment)
    rapid, feed = b"G0", rules.exact_stop + b"G1"
    lines, at, last = [], call.start, moment.state.motion
    for move in drill(call):
        if move.kind is Kind.DWELL:
            number = whole if rules.dwell_form == "whole" else plain
            lines.append(b"G4 P" + number(call.dwell))
        elif move.kind in (Kind.STOP, Kind.START):
            lines.append(b"M5" if move.kind is Kind.STOP else b"M%d" % (moment.spindle or 5))
        else:
            words = list(hole_words) if move.kind is Kind.HOLE and going else []
            if move.to != at:
                words.append(along + plain(move.to - at if incremental else move.to))
            if words:
                last = G1 if move.kind is Kind.FEED else G0
                lines.append(b" ".join([feed if last == G1 else rapid, *words]))
            if move.kind is Kind.HOLE:
                going = going and incremental  # absolute repeats stay where they are
        at = move.to
    if rules.own_group and last != moment.state.motion:
        lines.append(rapid if last == G1 else b"G1")
    return lines


def _to_hole(block: Block, moment: Moment) -> tuple[list[bytes], bool]:
    """The words of a block that lead to its hole, and whether they lead anywhere."""
    plane = PLANES[moment.state.plane or G17]
    hole = [w for w in block.words if w.letter in plane[:2]]
    words = [b"".join(w.text.split()).upper() for w in hole]
    if moment.state.distance == G91:
        return words, any(w.value for w in hole)
    # An unknown position is a NaN, which differs from everything.
    axes = [AXES.index(w.letter) for w in hole]
    return words, any(moment.before[axis] != moment.state.position[axis] for axis in axes)


def _with_stops(moves: list[bytes]) -> list[bytes]:
    """The moves, with a rest behind each that has none."""
    out = []
    for k, line in enumerate(moves):
        out.append(line)
        dwells = moves[k + 1 : k + 2] and moves[k + 1].startswith(b"G4")
        if line.startswith((b"G0", b"G1")) and not dwells:
            out.append(b"G4 P0")
    return out


def _comment(block: Block) -> bytes:
    """`(gcodejerk: ...)` with the words of the block, in at most COMMENT_LENGTH characters."""
    words = b" ".join(b"".join(w.text.split()) for w in block.words)
    shown = bytes(c if 32 <= c < 127 and c not in b"()" else ord("?") for c in words)
    room = COMMENT_LENGTH - len(b"(gcodejerk: )")
    if len(shown) > room:
        shown = shown[: room - 3] + b"..."
    return b"(gcodejerk: " + shown + b")"

"""What LinuxCNC, grbl and Mach read alike: for programs that could be of any of them.

All three grew from NIST RS274/NGC, and a plain program says nothing of which it was written for.
This table holds what the three tables have in common, and is no control's own. Where they differ,
it has what is the more cautious: a code that one of them does not know, or that means something
else there (G28.1, cycles, O words, variables), is not understood, and what it might have changed is
unknown until it is stated again; what would go unseen so (scaling, rotation, diameters, G61) is
named; a code that grbl may refuse is run and not run; M3 may fire a laser, as it may on grbl and
Mach. A program of another control on a PC may be taken for one of these: what the tables of those
say differently of G0 holds here too (`apart`, of Centroid).

`tests/unit/test_nc_common.py` draws programs of all three and holds this reading to each of theirs.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.dialect import Dialect, code_names, grouped
from gcodejerk.nc.dialects.grbl import GRBL, SYSTEMS
from gcodejerk.nc.dialects.linuxcnc import LINUXCNC
from gcodejerk.nc.dialects.mach import MACH
from gcodejerk.nc.dialects.spelling import Text, Writing

MEMBERS = (LINUXCNC, GRBL, MACH)

RS274 = Dialect(
    name="rs274",
    title="what LinuxCNC, grbl and Mach read alike",
    sources=tuple(source for member in MEMBERS for source in member.sources),
    text=Text(
        parentheses="comment",
        semicolon="comment",
        delete="first",
        o_word="error",
        percent="lone",
        variables="none",
        blanks="anywhere",
        line_limit=min(member.text.line_limit for member in MEMBERS),
        inner_semicolon=True,
        long_comments=True,
        characters=GRBL.text.characters,
        digits=GRBL.text.digits,
        number_digits=GRBL.text.number_digits,
        instant=GRBL.text.instant,
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30, 800),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "arc distance": (911,),
            "feed mode": (930, 940),
            "units": (200, 210),
            "compensation": (400, 410, 420),
            "tool length": (430, 490),
            "system": SYSTEMS,
            "path": (610, 611, 640),
            "retract": (980, 990),
            "scaling": (500, 510),
            "rotation": (680, 690),
            "polar": (150, 160),
            "diameter": (70, 80),
            "non-modal": (40, 100, 280, 300, 530, 920, 921),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30),
            "spindle": (3, 4, 5),
            "coolant": (7, 8, 9),
            "override": (48, 49),
            "tool": (6,),
        }
    ),
    defaults={"plane": 170, "feed mode": 940, "compensation": 400, "system": 540},
    effects={
        **dict.fromkeys((280, 300), "return"),
        **dict.fromkeys(SYSTEMS, "system"),
        **dict.fromkeys((430, 490), "length"),
        **dict.fromkeys((70, 80), "either"),
        100: "table",
        530: "machine",
        920: "set",
        921: "frames",
    },
    paths={640: 64},
    # grbl's G61 blends, that of the others stops a stream at its points.
    bars={610: ("exact path", True), 611: ("exact path", True), 640: ("exact path", False)},
    transforms=MACH.transforms,
    letters="FSTXYZABCDEHIJKLPQR",
    uses=GRBL.uses,
    strict=True,
    centres_of_plane=True,
    length_word="H",
    p_selects=frozenset(SYSTEMS),
    # LinuxCNC has G7, which a block that is not understood may hold.
    diameter_codes=True,
    # grbl knows none of these, and behind G61.1 the others may have moved.
    refused=GRBL.refused | code_names("G15", "G16", "G61.1", "G68", "G69"),
    refuses=GRBL.refuses,
    inches_turn=GRBL.inches_turn,
    feed_before_units=True,
    arcs_refused=True,
    feed_needed=True,
    # which motion G80 has ended need not be known, and the spindle's speed and overrides that are
    # let no rapid hangs on; on PCs G80 may not stand beside G0
    left_at_start=code_names("G80", "G97", "M48"),
    limits=GRBL.limits,
    dark_rapids=True,
    # Centroid's control has programs like these, and moves Z apart; nothing may tell it from them.
    apart=frozenset("Z"),
    beam_codes=GRBL.beam_codes,
    harmless=frozenset({0, 40, 170, 180, 190, 200, 210, 400, 900, 910, 911, 930, 940}),
    before_m=frozenset({3, 4, 5, 7, 8, 9}),
    after_m=frozenset({0, 1, 2, 30}),
    writing=Writing((b"(", b")"), b"G4 P0", line_limit=79, digits=8),
)

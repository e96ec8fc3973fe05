"""Rapids that look certain and are not, one class after another; each was rewritten once."""

import io
import math
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk.axes import AXES
from gcodejerk.errors import ProgramError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import CERTAIN, DIALECTS, Start, read_program, trace
from gcodejerk.nc.interpreter.modal import FIELDS, State, agree, join, same
from gcodejerk.nc.reader import Reader
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm
from gcodejerk.verification.second_reading.known import KINDS, Facts, Known

WRITTEN, NO_DISTANCE = Reason.SYSTEM_WRITTEN, Reason.DISTANCE_MODE_UNKNOWN
START, PATH = Reason.START_UNKNOWN, Reason.PATH_UNKNOWN
NO_BLOCK = Reason.NOT_UNDERSTOOD
CALLED = Reason.NOT_FOLLOWED
HEADS = {
    "siemens": b"G71 G90 G94 G17 G40 G64 F100\nG0 X0 Y0 Z50\n",
    "marlin": b"G21\nG90\nG0 X0 Y0 Z50 F6000\n",
    "klipper": b"G90\nG0 X0 Y0 Z50 F6000\n",
    "duet": b"M453\nG90 G94 G17\nG21\nG0 X0 Y0 Z50\nG1 X1 F200\n",
    "fanuc": b"G21 G90 G94 G17 G40 G49 G80 G54 G64 F100.\nG0 X0. Y0. Z50.\n",
    "fanuc-lathe-a": b"G21 G98 G40 G18 F100.\nG0 X0. Z50.\n",
    "haas": b"G21 G90 G94 G17 G40 G49 G80 G54 G64 F100.\nG0 X0. Y0. Z50.\n",
    "mach": b"G21 G90 G94 G17 G40 G49 G80 G54 G64 F100.\nG0 X0. Y0. Z50.\n",
    "grbl": b"G21 G90 G94 G17 G54 F100\nG0 X0 Y0 Z50\n",
    "linuxcnc": b"G21 G90 G94 G17 G40 G49 G54 G64 F100\nG0 X0 Y0 Z50 A10\n",
    "fagor": b"G71 G90 G94 G17 G40 G44 G5 F100\nG0 X0 Y0 Z50\n",
    "klartext": b"0 BEGIN PGM P MM\n1 L X+0 Y+0 Z+50 R0 FMAX\n",
    "heidenhain-iso": b"%P G71 *\nN1 G17 G90 G40*\nN2 G00 X0 Y0 Z50*\n",
}
_LIKE_FANUC = ("mitsubishi", "syntec", "mazatrol-eia", "iso-mill", "centroid")
HEADS.update(dict.fromkeys(_LIKE_FANUC, HEADS["fanuc"]))


def start_of(dialect, **facts):
    return Start(startup="G71" if dialect == "siemens" else "", **facts)


def read(text, dialect, head=None, **facts):
    """Reasons of the rapids behind the head, None where certain; both readings have to agree."""
    head = HEADS[dialect] if head is None else head
    start = start_of(dialect, **facts)
    rapids = read_program(io.BytesIO(head + text), dialect=dialect, start=start).rapids
    certain = [k for k, r in enumerate(rapids.reason.tolist()) if r == CERTAIN]
    found = Findings(100)
    confirm(io.BytesIO(head + text), dialect, start, rapids, certain, found)
    assert not found.violations
    behind = rapids.line > head.count(b"\n")
    return [None if r == CERTAIN else REASONS[r] for r in rapids.reason[behind].tolist()]


def also_noticed(text, dialect, **facts):
    """Whether the second reading refuses, or at least does not confirm, the last rapid."""
    start = start_of(dialect, **facts)
    data = HEADS[dialect] + text
    rapids = read_program(io.BytesIO(data), dialect=dialect, start=start).rapids
    found = Findings(100)
    confirmed = confirm(io.BytesIO(data), dialect, start, rapids, [len(rapids) - 1], found)
    return bool(found.violations) or confirmed == 0


# What stands in front of the last rapid, and the reason for which that one is left alone.
NOT_CERTAIN = {
    "a work offset is written": ("fanuc", b"#5221=#5021\nG0 X5.\nX6.\n", WRITTEN),
    "so on a Haas": ("haas", b"#5221=#5021\nG0 X5.\nX6.\n", WRITTEN),
    "the external offset": ("fanuc", b"#2501=5.\nG0 X5.\nX6.\n", WRITTEN),
    "a tool offset": ("fanuc", b"#2001=5.\nG54 G0 X5.\nX6.\n", WRITTEN),
    "a computed variable": ("fanuc", b"#[#1]=5.\nG0 X5.\nX6.\n", WRITTEN),
    "and a doubly indirect one": ("fanuc", b"##1=5.\nG0 X5.\nX6.\n", WRITTEN),
    "a stop with a message": ("fanuc", b"#3006=1\nG0 X5.\nX6.\n", WRITTEN),
    "a variable of Mach": ("mach", b"#5221=4\nG0 X5.\nX6.\n", WRITTEN),
    "G10 of an offset": ("fanuc", b"G10 L2 P1 X5.\nG0 X5.\nX6.\n", WRITTEN),
    "G10 of a tool": ("fanuc", b"G10 L10 P1 R5.\nG54\nG0 X5.\nX6.\n", WRITTEN),
    "G10 of a parameter": (
        "fanuc", b"G10 L50\nN1401 P1 R0\nG11\nG90 G21 G94 G17 G40 G54 G49 F9.\nG0 X5.\nX6.\n",
        WRITTEN,
    ),
    "a frame of Siemens": ("siemens", b"$P_UIFR[1]=CTRANS(X,5)\nG0 X5\nX6\n", WRITTEN),
    "tool data of Siemens": ("siemens", b"N5 $TC_DP3[1,1]=5\nG54 G0 X5\nX6\n", WRITTEN),
    "an axis variable": ("siemens", b"$AA_OFF[X]=5 ; shift\nG0 X5\nX6\n", WRITTEN),
    "G43 that may move": ("fanuc", b"G43 H1\nG0 Z9.\n", Reason.START_UNKNOWN),
    "G49 that may move": ("haas", b"G49\nG0 Z9.\n", Reason.START_UNKNOWN),
    "a length across another plane": (
        "fanuc", b"G18 G43 H1\nG17 G0 X1. Y1. Z1.\nG49\nG0 X5. Y7.\n", Reason.START_UNKNOWN
    ),
    "the same of Haas": (
        "haas", b"G19 G43 H1\nG17 G0 X1. Y1. Z1.\nG49\nG0 X5.\n", Reason.START_UNKNOWN
    ),
    "the same of Mach": (
        "mach", b"G18 G43 H1\nG17 G0 X1. Y1. Z1.\nG49\nG0 Y5.\n", Reason.START_UNKNOWN
    ),
    "H without G43": ("fanuc", b"G43 H1 Z5.\nH2\nG0 Z9.\n", Reason.START_UNKNOWN),
    "another program": ("fanuc", b"M198 P1000\nG90 G40 G0 X5.\nX6.\n", Reason.UNITS_UNKNOWN),
    "an interrupt": ("fanuc", b"M96 P1000\nG90 G40 G0 X5.\nX6.\n", Reason.UNITS_UNKNOWN),
    # RepRapFirmware's SetPositions leaves the offset of the work system out.
    "G92 beside an offset of a Duet": ("duet", b"G92 X3\nG0 X7\n", START),
    "a tool that M109 may change": ("duet", b"M109 S200\nG0 X7\n", NO_BLOCK),
    "an exponent, which runs feed moves": (
        "duet", b"G1 X1 Y1\nG1 X2 Y2\n" * 9 + b"G1 X1.E1 Y3\nG1 Y4\nG0 X7\n", NO_BLOCK
    ),
    "a command that a blank takes apart": ("duet", b"G 91\nG0 X7\n", NO_BLOCK),
    "a comment and a blank in front of it": ("duet", b"(rapids)\n(a) G91\nG0 X7\n", NO_BLOCK),
    "two of them, behind N": ("duet", b"N5 (a)(b) G91\nG0 X7\n", NO_BLOCK),
    "a checksum, which may be wrong": ("duet", b"N5 G91*9\nG0 X7\n", NO_BLOCK),
    "an exponent": ("duet", b"G1 X1E3 F100\nG0 X7\n", NO_BLOCK),
    # Fanuc tells macro statements from NC statements: a block is one or the other.
    "words beside an assignment": ("fanuc", b"G1 X2.\n#1=2 G91\nG0 X5.\n", NO_DISTANCE),
    "words behind a sum": ("haas", b"#1=2.+#3 G91\nG0 X5.\n", NO_DISTANCE),
    "words in front of an assignment": ("haas", b"G91 #1=2.\nG0 X5.\n", NO_DISTANCE),
    "a hexadecimal number": ("marlin", b"G0Y0X10\n", Reason.NOT_UNDERSTOOD),
    "no look-ahead": ("haas", b"G103 P1\nG0 X5.\n", Reason.LOOK_AHEAD),
    "inches with F in mm": ("siemens", b"G70\nG0 X5\nX6\n", Reason.FEED_UNIT),
    "F of some axes": ("siemens", b"FGROUP(X,Y)\nG0 X5 Z9\n", Reason.FEED_GROUP),
    "somebody jogs at M0": ("fanuc", b"M0\nG0 X9.\n", Reason.START_UNKNOWN),
    "at M1 of grbl": ("grbl", b"M1\nG0 X9.\n", Reason.START_UNKNOWN),
    "at M0 of Siemens": ("siemens", b"M0\nG0 X9\n", Reason.START_UNKNOWN),
    "G54 P3": ("fanuc", b"G54 P3\nG91 G0 X9.\nG90 X9.\n", Reason.START_UNKNOWN),
    "G54 P3 of Mach": ("mach", b"G54 P3\nG0 X9.\n", Reason.START_UNKNOWN),
    "a shift by increments": ("fanuc-lathe-a", b"G50 U5.\nG0 X9.\n", Reason.START_UNKNOWN),
    "the same along Z": ("fanuc-lathe-a", b"G50 W5.\nG0 Z9.\n", Reason.START_UNKNOWN),
    "G92 in G91": ("fanuc", b"G91 G92 X5.\nG90 G0 X9.\n", Reason.START_UNKNOWN),
    "a bare G92": ("fanuc", b"G92\nG0 X9.\n", Reason.START_UNKNOWN),
    "a tool change ends in G90": ("fanuc", b"G91 G0 X1.\nM6\nG0 X9.\n", NO_DISTANCE),
    "a laser of grbl": ("grbl", b"M3 S100\nG0 X9\n", Reason.BEAM),
    "a laser of Marlin": ("marlin", b"M3 I\nG0 X8 F6000\nG0 X9\n", Reason.BEAM),
    "a plasma torch of Mach": ("mach", b"M3\nG0 X9.\n", Reason.BEAM),
    "T that may call O9000": ("fanuc", b"T5\nG0 X9.\n", Reason.START_UNKNOWN),
    "limits of travel are no move": ("fanuc", b"G22 X9. Y9. Z9.\nG0 X9.\n", None),
    "a mirror of Haas": ("haas", b"G101 X0.\nG0 X9.\n", Reason.ROTATION),
    "an offset that turns": ("haas", b"G254\nG0 X9.\n", Reason.ROTATION),
    "adaptive feed": ("linuxcnc", b"M52 P1\nG0 X9\n", Reason.FEED_SCALED),
    "a programmed override": ("siemens", b"OVR=50\nG0 X9\nX8\n", Reason.FEED_SCALED),
    "the other language": ("siemens", b"G291\nG0 X9\nX8\n", Reason.NOT_UNDERSTOOD),
    "the way of a rotary axis": ("linuxcnc", b"G0 A5\n", Reason.ROTARY_WAY),
    "a tool across another plane": (
        "siemens", b"T1 D1\nG0 X0 Y0 Z50\nG18\nG0 Y9\n", Reason.START_UNKNOWN
    ),
    "words in parentheses": ("marlin", b"G0 X5 (Z9)\nG0 Z5\n", Reason.START_UNKNOWN),
    "small letters": ("marlin", b"G0 x5\nG0 X9 F6000\n", Reason.START_UNKNOWN),
    "a small command": ("marlin", b"g0 X5\nG21\nG90\nG0 X9 F6000\n", Reason.START_UNKNOWN),
    "inches that a build may lack": ("marlin", b"G20\nG0 X1\n", Reason.UNITS_UNKNOWN),
    "settings that are loaded": ("marlin", b"M501\nG0 X9\n", Reason.START_UNKNOWN),
    "a place in the file": ("marlin", b"M26 S0\nG0 X9\n", Reason.START_UNKNOWN),
    "F in percent": ("marlin", b"M220 S50\nG0 X9\n", Reason.FEED_SCALED),
    "so of Klipper": ("klipper", b"M220 S50\nG0 X9\n", Reason.FEED_SCALED),
    "a padded code of Klipper": (
        "klipper", b"G00 X5\nG90\nG0 X9 F6000\n", Reason.START_UNKNOWN
    ),
    "F0": ("klipper", b"G0 X5 F0\nG0 X9 F6000\n", Reason.START_UNKNOWN),
    "F0 in a run of lines": (
        "klipper", b"G1 X5\nG1 X6\nG1 X7\nG1 Y1\nG1 X5 F0\nG1 Z3\nG1 X8 F90\nG0 Y9\n",
        Reason.START_UNKNOWN
    ),
    "G92 with an axis that it passes over": (
        "klipper", b"G92 A5\nG0 X9\n", Reason.START_UNKNOWN
    ),
    "a bare G92 leaves A where it was": ("klipper", b"G92\nG0 A9\n", Reason.START_UNKNOWN),
    "a code behind T": ("klipper", b"T0 G91\nG0 X0 Y0 Z0 F600\nG0 X9\n", NO_DISTANCE),
    "a code behind an axis": ("marlin", b"X5 G91\nG0 X0 Y0 Z0 F600\nG0 X9\n", NO_DISTANCE),
    "a move behind an axis": (
        "marlin", b"G0 Y1\nG1 X1\nG1 X2\nG1 X3\nX5 G1\nG1 Y9\nG1 Y8\nG1 Y7\nG0 X9\n",
        Reason.START_UNKNOWN
    ),
    "an arc that Klipper may lack": ("klipper", b"G2 X5 I3\nG0 X9\n", Reason.START_UNKNOWN),
    "an object that is left out": (
        "klipper", b"EXCLUDE_OBJECT_END NAME=A\nG0 X9\n", Reason.START_UNKNOWN
    ),
    "an increment behind a shift": (
        "siemens", b"TRANS\nG0 X0 Y0 Z50\nTRANS X10\nG91 G0 X5\nX6\n", Reason.START_UNKNOWN
    ),
    "the same by IC": (
        "siemens", b"TRANS\nG0 X0 Y0 Z50\nTRANS X10\nG0 X=IC(5)\nX6\n", Reason.START_UNKNOWN
    ),
    "ATRANS alone": (
        "siemens", b"TRANS\nG0 X0 Y0 Z50\nTRANS X10\nATRANS\nG0 X5\n", Reason.START_UNKNOWN
    ),
    "AROT alone": (
        "siemens", b"TRANS\nG0 X0 Y0 Z50\nATRANS X10\nAROT\nG0 X5\n", Reason.ROTATION
    ),
    "TRANS behind ATRANS": (
        "siemens", b"TRANS\nG0 X0 Y0 Z50\nATRANS X5\nTRANS X10\nG0 X5\n", Reason.START_UNKNOWN
    ),
    "modes of the other language": (
        "siemens", b"G291\nG0 U5\nG290\nG0 X9\nX8\n", Reason.NOT_UNDERSTOOD
    ),
    "a list of values": (
        "siemens", b"DEF REAL AA[3]\nAA[1]=5\nAA[0]=SET(7,8,9)\nG0 X=AA[1]\n", Reason.EXPRESSION
    ),
    "an array of one value": (
        "siemens", b"DEF REAL AA[3]\nAA[1]=5\nAA=REP(2)\nG0 X=AA[1]\n", Reason.EXPRESSION
    ),
    "a list of parameters": (
        "siemens", b"R1=5\nR[0]=SET(7,8)\nG0 X=R1\n", Reason.EXPRESSION
    ),
    "a tolerance for the path": (
        "siemens", b"G60\nCYCLE832(0.05,1,1)\nCOMPOF DYNNORM\nG0 X9\n", Reason.PATH_UNKNOWN
    ),
    "no tolerance any more": (
        "siemens", b"CYCLE832(0,1)\nCOMPOF DYNNORM\nG0 X9\n", Reason.PATH_UNKNOWN
    ),
    "curves of a Fanuc": ("fanuc", b"G5.1 Q2 X0 Y0 Z0\nG0 X9.\n", Reason.COMPRESSED),
    "nano smoothing": ("haas", b"G05.1 Q3\nG0 X9.\n", Reason.COMPRESSED),
    "moves that are stored": ("fanuc", b"G05 P10001 L1\nG0 X9.\n", Reason.START_UNKNOWN),
    "curves instead of blocks": ("siemens", b"SOFT COMPCAD FFWON\nG0 X9\n", Reason.COMPRESSED),
    "curves of a cycle": ("siemens", b"CYCLE832(0.05,1,1)\nG0 X9\n", Reason.COMPRESSED),
    "curves as the machine has them": ("siemens", b"CYCLE832()\nG64\nG0 X9\n", Reason.COMPRESSED),
    "T may run a cycle": (
        "siemens", b"R1=5\nT2\nG0 X0 Y0 Z0\nG0 X=R1\n", Reason.EXPRESSION
    ),
    "a frame along the tool": (
        "siemens", b"TOFRAMEX\nG700 G90 G94 G17 G40 G64 F1\nG0 X0\nX5\n", Reason.ROTATION
    ),
    "polar coordinates": ("fagor", b"G0 R50 Q30\nG0 X9\n", Reason.START_UNKNOWN),
    "an angle alone": ("fagor", b"G3 Q30\nG0 X9\n", Reason.START_UNKNOWN),
    "the same of Fagor": ("fagor", b"G43\nG0 X0 Y0 Z50\nG18\nG0 Y9\n", Reason.START_UNKNOWN),
    "words in machine coordinates": (
        "heidenhain-iso", b"N3 G00 Z-1 M91*\nN4 G00 Z9*\n", Reason.START_UNKNOWN
    ),
    "another origin of the builder": (
        "heidenhain-iso", b"N3 G00 X5 M92*\nN4 G00 X9*\n", Reason.START_UNKNOWN
    ),
    "a cycle called by M99": (
        "heidenhain-iso", b"N3 G00 X5 M99*\nN4 G00 X9*\n", Reason.START_UNKNOWN
    ),
    "a cycle at every position": (
        "heidenhain-iso", b"N3 M89*\nN4 G00 X5*\nN5 G00 X9*\n", Reason.NOT_UNDERSTOOD
    ),
    "a cycle at every position of Klartext": (
        "klartext", b"3 M89\n4 L X+4 Y+4 Z+50 FMAX\n5 L X+8 FMAX\n", Reason.NOT_UNDERSTOOD
    ),
    "G91 behind a word": (
        "heidenhain-iso", b"N3 G00 X5 G91 Y5*\nN4 G90*\nN5 G00 X9*\n", Reason.START_UNKNOWN
    ),
    "a subprogram of a label": (
        "heidenhain-iso", b"N3 L1,0*\nN4 G00 X5 Y5 Z5*\nN5 G00 X9*\n", Reason.NOT_FOLLOWED
    ),
    "so without the comma": (
        "heidenhain-iso", b"N3 L1*\nN4 G00 G40 G90 X5 Y5 Z5*\nN5 G00 X9*\n",
        Reason.NOT_UNDERSTOOD
    ),
    "a label to which a jump may lead": (
        "heidenhain-iso", b"N3 D09 P01 +Q1 P02 +1 P03 1*\nN4 G91*\nN5 G98 L1*\nN6 G00 X9*\n",
        NO_DISTANCE
    ),
    "a label that is called from nobody knows where": (
        "heidenhain-iso", b"N3 L1,0*\nN4 G98 L1*\nN5 G91 G00 X9*\nN6 G98 L0*\nN7 G00 X9*\n",
        Reason.NOT_FOLLOWED
    ),
    "a label that ends what nobody called": (
        "heidenhain-iso", b"N3 G98 L1*\nN4 G98 L0*\nN5 G00 G40 X5*\nN6 G00 X9*\n", NO_DISTANCE
    ),
    "a label that stands twice": (
        "klartext", b"LBL 1\nL X+5 FMAX\nLBL 01\nL X+6 FMAX\nCALL LBL 1 REP 2\nL X+7 R0 FMAX\n",
        Reason.NOT_UNDERSTOOD
    ),
    "a parameter that nobody set": ("klartext", b"L X+Q1 FMAX\n", Reason.EXPRESSION),
    "one that a cycle may set": ("klartext", b"Q100 = 5\nL X+Q100 FMAX\n", Reason.EXPRESSION),
    "one behind a call of another program": (
        "klartext", b"Q1 = 5\nCALL PGM X\nL Y+0 Z+0 R0 FMAX\nL X+Q1 FMAX\n", Reason.EXPRESSION
    ),
    "one behind a tool change": (
        "klartext", b"Q1 = 5\nTOOL CALL 2 Z S99\nL Y+0 Z+0 R0 FMAX\nL X+Q1 FMAX\nL X+0 FMAX\n",
        Reason.START_UNKNOWN
    ),
    "a third of a millimetre": ("klartext", b"Q1 = 1 / 3\nL X+Q1 FMAX\n", Reason.EXPRESSION),
    "a root without brackets": ("klartext", b"Q1 = SQRT 4\nL X+Q1 FMAX\n", Reason.EXPRESSION),
    "what the control reads into one": (
        "klartext", b"Q1 = 5\nFN 18: SYSREAD Q1 = ID270 NR1 IDX1\nL X+Q1 FMAX\n",
        Reason.EXPRESSION
    ),
    "somebody jogs at G38": ("heidenhain-iso", b"N3 G38*\nN4 G00 X9*\n", Reason.START_UNKNOWN),
    "a way longer by the radius": (
        "heidenhain-iso", b"N3 G01 G43 Z5 F9*\nN4 G40*\nN5 G00 Z9*\n", Reason.START_UNKNOWN
    ),
    "beside a linear one": ("linuxcnc", b"G0 X3 A5\n", Reason.ROTARY_WAY),
    "a dwell without P": ("grbl", b"G4 X3\nG0 X9\n", Reason.START_UNKNOWN),
    "T with decimals": ("grbl", b"G0 X5 T1.5\nG0 X9\n", Reason.START_UNKNOWN),
    "an arc that misses its end": ("grbl", b"G2 X10 Y0 I5.6\nG0 X0\n", Reason.START_UNKNOWN),
    "an arc of Marlin whose ends are in line": (
        "marlin", b"G3 X1 I5 Z-2 F600\nG0 X9\n", Reason.START_UNKNOWN
    ),
    "an arc whose radius is too small": ("grbl", b"G2 X10 R3\nG0 X0\n", Reason.START_UNKNOWN),
    "an arc without its plane": ("grbl", b"G2 Z3 I5\nG0 Z50\n", Reason.START_UNKNOWN),
    "an arc from an unknown place": (
        "grbl", b"M0\nG2 X10 Y0 I5\nG0 X0\n", Reason.START_UNKNOWN
    ),
    "such an arc in inches": ("grbl", b"G20\nG2 X.5 R.2\nG0 X0\n", Reason.START_UNKNOWN),
    "such an arc by increments": (
        "grbl", b"G91 G2 X10 I5.6\nG90 G0 X0\n", Reason.START_UNKNOWN
    ),
    "such an arc among many lines": (
        "grbl", b"G1 X1\n" * 40 + b"G3 X10 Y0 I4\nG1 Y1\n" + b"Y3\n" * 40 + b"G0 X0\n",
        Reason.START_UNKNOWN,
    ),
    "behind a rounded corner": (
        "siemens", b"G1 X10 RND=5\nG0 Y10\n", Reason.START_UNKNOWN
    ),
    "a corner that is cut, and Z between": (
        "siemens", b"G1 X10 CHF=5\nG0 Z10\n", Reason.START_UNKNOWN
    ),
    "rounded corners": (
        "siemens", b"RNDM=5\nG1 X5 Y5\nG0 X10 Y0\nG0 Y10\n", Reason.START_UNKNOWN
    ),
    "a macro of Marlin": ("marlin", b"M810\nG0 X5 Y5 Z5\nG0 X9 F6000\n", NO_DISTANCE),
    "what Marlin writes to a file": (
        "marlin", b"M28 A\nG21\nG90\nG0 X5 Y5 Z5\nM29\nG0 X9 F6000\n", NO_DISTANCE
    ),
    "a macro of Klipper": ("klipper", b"M600\nG0 X5 Y5 Z5\nG0 X9 F6000\n", NO_DISTANCE),
    "polar moves, which name no axis": (
        "heidenhain-iso", b"N3 I+50 J+50*\nN4 G11 R+30 H+30 F500*\nN5 G00 X+10*\n", START
    ),
    "a polar rapid": ("heidenhain-iso", b"N3 G10 R+30 H+30*\nN5 G00 X+10*\n", START),
    "a polar arc": ("heidenhain-iso", b"N3 G12 H+30 F9*\nN5 G00 X+10*\n", START),
    "a polar move without its code": (
        "heidenhain-iso", b"N3 G11 R+30 H+30 F9*\nN4 G11 X1 Y1*\nN5 H+60*\nN6 G00 X+10*\n", START
    ),
    "by a parameter": ("heidenhain-iso", b"N3 Q1 = 5*\nN4 G11 R+Q1 F9*\nN5 G00 X+10*\n", START),
    "what a modal macro leaves": (
        "fanuc", b"G66 P9001 A1.\nG0 X5.\nG67\nG0 X6. Y6. Z6.\nX7.\n", CALLED
    ),
    "that of a Haas": ("haas", b"G66 P9001 A1.\nG67\nG90 G21 G17 G40 G94 G0 X6.\nX7.\n", PATH),
    "modes behind it are stated too early": (
        "fanuc", b"G66 P9001\nG90 G21\nG0 X5.\nG67\nG0 X6. Y6.\nX7.\n", CALLED
    ),
    "a pallet that may be there": ("haas", b"M46 Q1 P100\nG0 X50.\nN100 G0 X9.\n", CALLED),
    "and where it then leads": (
        "haas", b"M46 Q1 P9\nG21 G90 G94 G17 G40 G64 F1.\nG0 X5. Y5. Z5.\nN9 G0 X9.\n", CALLED
    ),
    "so on either control": ("iso-mill", b"M46 Q1 P100\nG0 X50.\nN100 G0 X9.\n", CALLED),
    "G92 that G54 may end": ("haas", b"G92 X0. Y0.\nG0 X-20.\nG54\nG0 X9.\n", START),
    "or in one block": ("haas", b"G92 X0. Y0.\nG0 X-20.\nG54 G0 X9.\n", Reason.FRAME_CHANGE),
    "so in what both read alike": ("iso-mill", b"G92 X0. Y0.\nG0 X-20.\nG54\nG0 X9.\n", START),
    "G52 that may be a system": ("haas", b"G52 X5.\nG54\nG0 X9.\n", START),
    "E of a Fadal": ("iso-mill", b"E2\nG0 X9.\n", START),
    "what a FluidNC runs": ("grbl", b"$SD/Run=a.nc\nG0 X5 Y5\nX9\n", NO_DISTANCE),
    "the check mode": ("grbl", b"$C\nG0 X5 Y5\nX9\n", NO_DISTANCE),
    "jogging": ("grbl", b"$J=G91 X5 F9\nG0 X9\n", NO_DISTANCE),
    "G61 that may be skipped": ("linuxcnc", b"/G61.1\nG0 X9\n", PATH),
    "G61 in a branch": ("linuxcnc", b"o1 if [#5399 EQ 1]\nG61\no1 endif\nG0 X9\n", PATH),
    "G61 of a call": (
        "linuxcnc", b"o<elsewhere> call\nG21 G90 G94 G17 G40 G49 F9\nG0 X5 Y5 Z5\nX9\n", PATH
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", NOT_CERTAIN)
def test_what_only_looks_certain_is_left_alone(name):
    dialect, text, reason = NOT_CERTAIN[name]
    assert read(text, dialect)[-1] == reason
    assert reason is None or also_noticed(text, dialect)


def test_axis_words_without_a_motion_are_refused_where_g80_may_be_in_force():
    """By grbl, with all that stands beside them."""
    text = b"G21 G90 G94 F100\nX1 G91 F50\nG0 X0 Y0 Z0\nG90 G0 X0 Y0 Z0\nG0 X9\n"
    rapids = read_program(io.BytesIO(text), dialect="grbl", start=start_of("grbl")).rapids
    assert REASONS[rapids.reason[0]] == NO_DISTANCE
    assert rapids.reason[-1] == CERTAIN
    assert math.isnan(rapids.feed[-1])
    assert read(text, "grbl", b"")[-1] is None


@pytest.mark.parametrize("line", ["G92 X0", "G28 X0"])
def test_axis_words_of_a_code_are_refused_too_where_g80_may_be_in_force(line):
    """By grbl: where the axis stands behind it is not known."""
    text = f"G21 G90 G94 G54\n{line}\nG0 X7\n".encode()
    home = dict.fromkeys("XYZ", 0.0)
    start = replace(start_of("grbl"), positions=dict.fromkeys("XYZ", 5.0), home=home)
    start = replace(start, offsets={"G54": home})
    for head, known in ((b"", False), (b"G80\n", False), (b"G0\n", True)):
        rapids = read_program(io.BytesIO(head + text), dialect="grbl", start=start).rapids
        assert math.isnan(rapids.start[-1, 0]) != known, head


def test_a_feed_motion_without_f_may_leave_the_feed_mode_as_it_was():
    """grbl refuses it in G93 whether an axis moves or not, and G93 with it."""
    text = HEADS["grbl"] + b"G93 G1\nG0 X0 Y0 Z0\nG0 X9\n"
    assert read_program(io.BytesIO(text), dialect="grbl").rapids.feed_mode[-1] == 0


@pytest.mark.parametrize(
    ("front", "known"),
    [("", True), ("G94", True), ("G93", False), ("G999", False), ("G93\nG94", True)],
)
@pytest.mark.parametrize("fast", [True, False])
def test_only_where_g93_may_be_in_force_a_feed_motion_without_f_may_be_refused(front, known, fast):
    """By grbl, which begins in G94; of other mills nobody knows what they begin in."""
    text = f"{front}\nG21 G90 G17 G40 G54\nG0 X0. Y0. Z0.\nG1 X1. F9.\nG1 X2.\nG0 X3.\n".encode()
    rapids = read_program(io.BytesIO(text), dialect="any-mill", fast=fast).rapids
    assert math.isnan(rapids.start[-1, 0]) != known
    found = Findings(9)
    moved = replace(rapids, start=rapids.start + 1.0)  # what nobody confirms, nobody contradicts
    assert confirm(io.BytesIO(text), "any-mill", Start(), moved, [len(rapids) - 1], found) == 0
    assert any("X starts at" in each.problem for each in found.violations) == known


@pytest.mark.parametrize("front", [b"", b"G1 A5\nG1 A6\nG1 A7\nG1 A8\n"])
def test_an_arc_that_may_be_refused_leaves_an_axis_that_turns_unknown_in_any_unit(front):
    text = b"F100\nG0 A0\n" + front + b"G2 A5 I3 Y1\n"
    start = start_of("grbl", wraps={"A": "none"}, limits={"A": (9.0, 9.0, 9.0)})
    *_, last = trace(io.BytesIO(text), dialect="grbl", start=start)
    assert math.isnan(last[1][AXES.index("A")])


STILL_CERTAIN = {
    "a pole and a straight line": ("heidenhain-iso", b"N3 I+50 J+50*\nN4 G01 X5 F9*\nN5 G00 X9*\n"),
    "modes behind a modal macro": (
        "fanuc", b"G66 P9001\nG67\nG90 G21 G94 G17 G40 G80 G64 F9.\nG0 X5. Y5. Z5.\nX6.\n"
    ),
    "an absolute word behind G92 and G54": ("haas", b"G92 X0.\nG54\nG0 X5. Y5. Z5.\nG0 X9.\n"),
    "a system that is selected again": ("haas", b"G54\nG0 X9.\n"),
    "settings of grbl": ("grbl", b"$10=1\n$$\n$G\nG0 X5 Y5 Z5\nX6\n"),
    "G64 behind a call": (
        "linuxcnc", b"o<elsewhere> call\nG21 G90 G94 G17 G40 G49 G64 F9\nG0 X5 Y5 Z5\nX9\n"
    ),
    "a common variable": ("fanuc", b"#500=5.\n#1=2.\nG0 X5.\n"),
    "a timer": ("fanuc", b"#3001=0\nG0 X5.\n"),
    "an offset is written, then selected": ("fanuc", b"#5221=3.\nG54\nG49\nG0 X5. Y5.\nX6.\n"),
    "a frame is written, then selected": (
        "siemens", b"$P_UIFR[1]=CTRANS(X,5)\nG54 D1\nG0 X5\nX6\n"
    ),
    "parameters of LinuxCNC": ("linuxcnc", b"#5221=3\nG0 X5\n"),
    "comments of a Duet": (
        "duet", b"(a (b)\n (a)\n(a)G0 X5 (b) Y3 (c)\nN5 (a)G1 X6 F9 (d\n(a) ; b\nG0 X7 ; (a) G9\n"
    ),
    "an offset of a Duet": ("duet", b"G10 L2 P1 X5\nG54\nG0 X5 Y5 Z5\nG0 X6\n"),
    "behind MCALL, which a call may have left": (
        "siemens", b"SUB_OF_THE_BUILDER\nG710 G90 G94 G17 G40 G64 F100\nMCALL\nG0 X5 Y5 Z5\nX6\n"
    ),
    "behind an override that was ended": (
        "marlin", b"M220 S50\nM9999\nM220 S100\nG21\nG90\nG0 X5 Y5 Z5 F6000\nG0 X6\n"
    ),
    "G43 with its axis": ("fanuc", b"G43 H1 Z5.\nG0 Z9.\n"),
    "no length along X": ("haas", b"G43 H1 Z5.\nG0 X9.\nG49\nG0 X5.\n"),
    "behind a modal macro": (
        "fanuc", b"G66 P9000\nX1.\nG67\nG21 G90 G94 G17 G40 G49 G54 G64 F9.\nG0 X5.\nX6.\n"
    ),
    "look-ahead again": ("haas", b"G103 P1\nG103 P0\nG0 X5.\n"),
    "F of all axes": ("siemens", b"FGROUP(X,Y)\nFGROUP()\nG0 X5 Z9\n"),
    "LinuxCNC at M0": ("linuxcnc", b"M0\nG0 X9\n"),
    "adaptive feed that is off": ("linuxcnc", b"M52 P1\nM52 P0\nG0 X9\n"),
    "T of Haas": ("haas", b"T5\nG0 X9.\n"),
    "a lone G54": ("fanuc", b"G54\nG0 X9.\n"),
    "G92 in G91 of LinuxCNC": ("linuxcnc", b"G91 G92 X5\nG90 G0 X9\n"),
    "G92 E0 of a printer": ("marlin", b"G92 E0\nG0 X9\n"),
    "behind the laser": ("grbl", b"M3 S100\nG1 X5\nM5\nG0 X9\n"),
    "increments of a rotary axis": ("linuxcnc", b"G91 G0 A5\n"),
    "an arc of a radius": ("fagor", b"G2 X5 Y5 R9\nG0 X9\n"),
    "a comment on a line of its own": ("marlin", b"(a pocket)\nG0 X5\n"),
    "F as it is": ("marlin", b"M220 S50\nM220 S100\nG0 X5\n"),
    "mm behind inches": ("marlin", b"G20\nG21\nG0 X5 Y5 Z5 F6000\nG0 X6\n"),
    "an absolute word behind a shift": (
        "siemens", b"TRANS\nG0 X0 Y0 Z50\nTRANS X10\nG0 X5\nG91 X6\n"
    ),
    "a path that blends still": ("siemens", b"CYCLE832(0.05,1,1)\nCOMPOF DYNNORM\nG0 X9\n"),
    "lines again": ("fanuc", b"G5.1 Q2 X0 Y0 Z0\nG1 X8. F100.\nG5.1 Q0\nG0 X9.\n"),
    "look-ahead alone": ("fanuc", b"G5.1 Q1 R5\nG0 X9.\nG8 P1\nG0 X5.\n"),
    "blocks again": ("siemens", b"COMPON\nG1 X8 F100\nCOMPOF\nG0 X9\n"),
    "ATRANS behind TRANS": (
        "siemens", b"TRANS\nG0 X0 Y0 Z50\nTRANS X10\nATRANS X5\nG0 X5\n"
    ),
    "TRANS behind both": (
        "siemens", b"ATRANS X5\nTRANS\nG0 X0 Y0 Z50\nTRANS X10\nG0 X5\n"
    ),
    "the same plane again": ("siemens", b"T1 D1\nG0 X0 Y0 Z50\nG17\nG0 Y9\n"),
    "behind words in machine coordinates": (
        "heidenhain-iso", b"N3 G00 Z-1 M91*\nN4 G00 X5 Z9*\nN5 G00 X9 Z5*\n"
    ),
    "behind a label": (
        "heidenhain-iso", b"N3 G98 L1*\nN4 G01 G40 G90 X5 F99*\nN5 G00 X9*\n"
    ),
    "a Q parameter": ("klartext", b"FN 1: Q05 = +2 + -0,5\nQL1 = Q5 * 2\nL X+QL1 FMAX\n"),
    "a Q parameter in DIN/ISO": ("heidenhain-iso", b"N3 D03 Q05 P01 +2 P02 -4*\nN4 G00 X-Q5*\n"),
    "behind a label that was called": (
        "klartext", b"L F99\nCALL LBL 1\nL X+5 FMAX\nM30\nLBL 1\nL IY+3 FMAX\nLBL 0\n"
    ),
    "behind a part that runs again": (
        "heidenhain-iso", b"N3 G01 F99*\nN4 G98 L1*\nN5 G91 X+5*\nN6 G90*\nN7 L1,2*\nN8 G00 X9*\n"
    ),
    "behind a cycle called by M99": (
        "heidenhain-iso", b"N3 G00 X5 M99*\nN4 G00 X5 Y5 Z9*\nN5 G00 X9*\n"
    ),
    "a rotary axis that stays": ("linuxcnc", b"G0 X5 A10\n"),
    "an arc that meets its end": ("grbl", b"G2 X10 Y0.003 I5\nG3 X0 Y0 R8\nG0 X5\n"),
    "arcs among many lines": (
        "grbl", b"G1 X1\n" * 40 + b"G3 X11 Y0 I5 J0\nX1 I-5\nG1 X5\nY3\n" * 20 + b"G0 X0\n"
    ),
    "behind an arc that misses its end": (
        "grbl", b"G2 X10 Y0 I5.6\nG0 X0 Y0 Z9 F90\nG1 X3\nG0 X5\n"
    ),
    "an arc of Marlin that meets its end": ("marlin", b"G2 X10 Y0 I5 F600\nG0 X0 Y5\n"),
    "an arc of LinuxCNC, which stops": ("linuxcnc", b"G2 X10 Y0 I5.6\nG0 X0\n"),
    "a text of Marlin": ("marlin", b"M117 Hello G91 #1\nM118 G91 World*3\nG0 X5 F900\n"),
    "rounded corners no more": (
        "siemens", b"RNDM=5\nG1 X5 Y5\nRNDM=0\nG1 X5 Y5\nG0 X10 Y0\nG0 Y10\n"
    ),
    "behind the corner's other side": ("siemens", b"G1 X10 RND=5\nY10\nG1 X9 Y9\nG0 Y8\n"),
}  # fmt: skip


MEASURED = {
    "an edge is measured": ("haas", b"G36 X20. F50.\nG0 X10. Y10. Z20.\n"),
    "a centre": ("haas", b"G136 X20. F50.\nG0 X10. Y10. Z20.\n"),
    "a tool": ("haas", b"G37 H1 Z-5. F50.\nG43 H1 G0 X10. Y10. Z20.\n"),
    "and then the place is known to the machine": (
        "haas",
        b"G36 X20. F50.\nG53 G0 X-10. Y-10. Z-5.\nG55\nG1 F100.\n",
    ),
    "and the axis stands where it was met": ("haas", b"G36 X20. F50.\nG54 G49\n"),
    "a cycle measures": ("siemens", b"CYCLE978(100,1,1,1,10)\nG1 X10 Y10 Z10 F100\nG54\n"),
    "another one": ("siemens", b"CYCLE976(100,1,1,1,10)\nG1 X10 Y10 Z10 F100\nG54\n"),
}
"""What writes offsets that the machine file had stated."""


@pytest.mark.parametrize("name", MEASURED)
def test_what_was_measured_is_not_what_the_machine_file_says(name):
    dialect, text = MEASURED[name]
    offsets = {"G54": dict.fromkeys("XYZ", -100.0), "G55": dict.fromkeys("XYZ", -150.0)}
    facts = {
        "offsets": offsets, "tool_lengths": {1: 80.0}, "home": dict.fromkeys("XYZ", 0.0),
        "startup": "G710 G55" if dialect == "siemens" else "",
    }  # fmt: skip
    start = Start(**facts)
    data = HEADS[dialect] + text + b"G0 X5. Y5. Z5.\n"
    rapids = read_program(io.BytesIO(data), dialect=dialect, start=start).rapids
    assert rapids.reason[-1] != CERTAIN
    found = Findings(100)
    assert not confirm(io.BytesIO(data), dialect, start, rapids, [len(rapids) - 1], found)


FRAMES = {
    "of the program": (b"$P_PFRAME=CROT(Z,45):CSCALE(X,2,Y,2)\nG54 D1\n", b"TRANS\n"),
    "a chain": (b"$P_PFRAME = $P_PFRAME : CMIRROR(X)\nG54 D1\n", b"ROT\n"),
    "a part of it": (b"$P_PFRAME[Z,RT]=45\nG54 D1\n", b"TRANS\n"),
    "settable": (b"$P_UIFR[1]=CTRANS(X,5):CROT(Z,45)\nG54 D1\n", None),
    "copied": (b"$P_UIFR[1]=$P_UIFR[2]\nG54 D1\n", None),
    "its angle": (b"$p_uifr[1, z, rt]=45\nG54 D1\n", None),
    "a basic one": (b"$P_CHBFRAME[0]=CSCALE(X,2)\nG54 D1\n", None),
}
"""Frames that turn, scale or mirror, written as data; and what ends them for certain."""
SHIFTS = (
    b"$P_UIFR[1,X,TR]=5\n",
    b"$P_UIFR[1]=CTRANS(X,5,Y,3):CFINE(X,0.1)\n",
    b"$P_UIFR[1,Z,FI]=1\n",
)


@pytest.mark.parametrize("name", FRAMES)
def test_frames_that_are_written_as_data_may_turn(name):
    text, end = FRAMES[name]
    moves = b"G1 X10 Y5 Z5 F100\nG0 X20 Y6\n"
    assert read(text + moves, "siemens")[-1] == Reason.ROTATION
    assert also_noticed(text + moves, "siemens")
    if end is not None:
        assert read(text + end + moves, "siemens")[-1] is None


@pytest.mark.parametrize("shift", SHIFTS)
def test_shifts_that_are_written_as_data_turn_nothing(shift):
    assert read(shift + b"G54 D1\nG1 X10 Y5 Z5 F100\nG0 X20 Y6\n", "siemens")[-1] is None


TURNED_LENGTHS = {
    "in another plane": b"G18\nG43 H1\nG0 X0. Y0. Z50.\nG28 Y0.\nG0 Y5.\n",
    "along the axis of the block": b"G43 X5. H1\nG0 X0. Y0. Z50.\nG53 G0 X-10.\nG0 X5.\n",
}


@pytest.mark.parametrize("name", TURNED_LENGTHS)
def test_along_which_axis_a_length_lies_is_not_always_known(name):
    facts = {
        "offsets": {"G54": dict.fromkeys("XYZ", -100.0)}, "tool_lengths": {1: 80.0},
        "home": dict.fromkeys("XYZ", 0.0),
    }  # fmt: skip
    assert read(TURNED_LENGTHS[name], "fanuc", **facts)[-1] is not None
    plain = b"G43 Z50. H1\nG0 X0. Y0. Z50.\nG53 G0 X-10.\nG0 X5.\n"
    assert read(plain, "fanuc", **facts)[-1] is None


WRITTEN_VARIABLES = {
    "another axis": (b"#5222=-24.64\nG10 L2 P1 X0\nX-20\n", b"Y-47"),
    "another axis of L20": (b"#5222=-24.64\nG10 L20 P1 X0\nX-20\n", b"Y-47"),
    "a rotation": (b"#5230=45\nG10 L2 P1 X0\nG1 X-20 Y3 Z5 F100\n", b"X1"),
    "that of another system": (b"#5250=45\nG55\nG1 X-20 Y3 Z5 F100\n", b"X1"),
    "a computed one": (b"#[5200+30]=45\nG10 L2 P1 X0\nG1 X-20 Y3 Z5 F100\n", b"X1"),
}


@pytest.mark.parametrize("name", WRITTEN_VARIABLES)
def test_what_linuxcnc_takes_over_of_written_variables_is_not_known(name):
    text, word = WRITTEN_VARIABLES[name]
    text = text + b"G0 " + word + b"\n"
    assert read(text, "linuxcnc")[-1] is not None
    assert also_noticed(text, "linuxcnc")


@pytest.mark.parametrize("name", STILL_CERTAIN)
def test_what_is_certain_is_still_rewritten(name):
    dialect, text = STILL_CERTAIN[name]
    assert read(text, dialect)[-1] is None


AGAIN = {
    "a macro at every position": ("fanuc", b"G66 P9001 A1.\nX8.\nM99\n"),
    "a compressor of Fanuc": ("fanuc", b"G5.1 Q2\nM99\n"),
    "polar coordinates": ("fanuc", b"G16\nM99\n"),
    "overrides that are off": ("fanuc", b"#3004=3\nM99\n"),
    "what M47 repeats": ("mach", b"G16\nM47\n"),
    "a cycle behind MCALL": ("siemens", b"MCALL CYCLE81(10,0,2,-5,0)\nX8\nGOTOS\n"),
    "a compressor of Siemens": ("siemens", b"COMPCAD\nGOTOS\n"),
    "F of some axes": ("siemens", b"FGROUP(X)\nIF R1<5 GOTOS\nM30\n"),
    "corners": ("siemens", b"RNDM=1\nGOTOS\n"),
    "a limit": ("siemens", b"ACC[X]=20\nGOTOS\n"),
    "adaptive feed": ("linuxcnc", b"M52 P1\nM99\n"),
    "exact stops": ("linuxcnc", b"G61.1\nM99\n"),
}


@pytest.mark.parametrize("name", AGAIN)
def test_what_the_last_pass_has_left_on_is_on_in_the_next_one(name):
    dialect, last = AGAIN[name]
    head = HEADS[dialect].replace(b" G64", b"") if b"G61" in last else HEADS[dialect]
    assert read(b"G0 X9.\nX7.\n" + last, dialect, head)[0] is not None
    assert read(b"G0 X9.\nX7.\nM30\n", dialect, head)[0] is None


@pytest.mark.parametrize("dialect", ["fanuc", "grbl", "mach", "siemens", "haas"])
def test_the_machine_file_may_say_that_nobody_moves_an_axis_meanwhile(dialect):
    text = b"M0\nM1\nG0 X9.\n"
    assert read(text, dialect, resume="same", spindle="mill") == [None]
    assert read(text, dialect, resume="unknown", spindle="mill") == [Reason.START_UNKNOWN]


@pytest.mark.parametrize("turns", [b"M3 S9", b"M19", b"M70", b"SPOS=90", b"SPOSA=90"])
def test_a_spindle_may_be_a_rotary_axis(turns):
    wraps = {"C": "none"}
    text = b"G0 C0\n%s\nG0 C9\nC8\n"
    found = read(text % turns, "siemens", wraps=wraps)
    assert found[1:] == [Reason.START_UNKNOWN, None]
    assert read(text % b"M8", "siemens", wraps=wraps)[1:] == [None, None]


@pytest.mark.parametrize("code", [b"G53", b"G153", b"SUPA"])
def test_basic_frames_lie_between_machine_and_work_systems(code):
    offsets = {"G54": {"X": 1.0, "Y": 1.0, "Z": 1.0}}
    text = b"G54 G0 X0 Y0 Z50\n%s G0 Z3\nG0 Z9\nZ8\n" % code
    found = read(text, "siemens", offsets=offsets)
    assert found[1:] == [Reason.FRAME_CHANGE, Reason.START_UNKNOWN, None]


def test_a_rapid_that_ends_in_a_stop_is_certain_itself():
    assert read(b"G0 X9. M0\nX8.\n", "fanuc") == [None, Reason.START_UNKNOWN]


# Laser and plasma


@pytest.mark.parametrize("dialect", ["grbl", "mach", "marlin"])
def test_the_machine_file_may_say_that_m3_turns_a_spindle(dialect):
    text = b"M3 S100\nG0 X9. F6000\n" if dialect != "marlin" else b"M3 S100\nG0 X9 F6000\n"
    assert read(text, dialect) == [Reason.BEAM]
    assert read(text, dialect, spindle="mill") == [None]
    assert read(text, dialect, spindle="laser") == [Reason.BEAM]


@pytest.mark.parametrize(
    ("dialect", "habit"),
    [
        ("grbl", b"G1 X3 S200\n"),
        ("grbl", b"G1 X3 S200\n" * 40),
        ("grbl", b"M4\n"),
        ("marlin", b"M3 I\n"),
        ("mach", b"G1 X3. S200\n"),
    ],
)
def test_a_program_that_behaves_like_one_for_a_laser_is_not_believed(dialect, habit):
    text = b"M3 S100\nG0 X9.\n" + habit + b"M5\nG0 X2.\n"
    found = read(text, dialect, spindle="mill")
    assert found[0] == Reason.BEAM
    assert found[-1] != Reason.BEAM


def test_a_declared_laser_that_outputs_may_fire_keeps_all_its_rapids():
    assert read(b"M5\nG0 X9\n", "linuxcnc", spindle="laser") == [None]
    assert read(b"M67 E0 Q5\nM5\nG0 X9\n", "linuxcnc", spindle="laser") == [Reason.BEAM]
    assert read(b"M3 S1\nG0 X9\n", "linuxcnc") == [None]


# Rotary axes


@pytest.mark.parametrize(
    ("wrap", "stands", "word", "ends"),
    [
        ("none", b"10", b"5", 5.0),
        ("sign", b"10", b"5", 365.0),
        ("sign", b"10", b"20", 20.0),
        ("sign", b"10", b"-5", 5.0),
        ("sign", b"10", b"-350", -10.0),
        ("sign", b"10", b"370", math.nan),
        ("shortest", b"350", b"10", 10.0),  # 350 is reached backwards from 0
        ("shortest", b"100", b"190", 190.0),
        ("shortest", b"100", b"280", math.nan),
        ("shortest", b"100", b"290", -70.0),
        ("shortest", b"-100", b"200", -160.0),
        ("shortest", b"10", b"350", -10.0),
        ("shortest", b"10", b"100", 100.0),
    ],
)
def test_a_rotary_axis_goes_the_way_that_the_machine_file_says(wrap, stands, word, ends):
    data = b"G21 G90 G94 G17 G40\nG0 A" + stands + b"\nG0 A" + word + b"\n"
    start = Start(positions={"A": 0.0}, wraps={"A": wrap})
    rapids = read_program(io.BytesIO(data), start=start).rapids
    assert same(float(rapids.target[-1, AXES.index("A")]), ends)
    assert (rapids.reason[-1] == CERTAIN) is not math.isnan(ends)
    found = Findings(9)
    confirm(io.BytesIO(data), "linuxcnc", start, rapids, [1], found)
    assert not found.violations or math.isnan(ends)


@pytest.mark.parametrize("wrap", [None, "none", "sign", "shortest"])
@pytest.mark.parametrize("fast", [True, False])
def test_rotary_axes_in_runs_of_plain_lines(wrap, fast):
    lines = b"".join(b"X%d A%d\n" % (k, k * 7 % 360) for k in range(60))
    start = Start(positions=dict.fromkeys(AXES, 0.0), wraps={} if wrap is None else {"A": wrap})
    rapids = read_program(io.BytesIO(b"G21 G90 G94 G17 G40 G0\n" + lines), start=start, fast=fast)
    reasons = [REASONS[r] for r in rapids.rapids.reason.tolist() if r != CERTAIN]
    assert (Reason.ROTARY_WAY in reasons) is (wrap is None)
    if wrap == "sign":
        assert rapids.rapids.target[-1, 3] == 59 * 7  # forwards all the time


def test_an_axis_that_has_counted_turns_is_not_written_within_the_program():
    text = """
interval: 0.001
positioning: linear
controller: fanuc
axes:
  X: {rapid: &r {velocity: 500, acceleration: 3000, jerk: 5.0e+4}, modes: [{frequency: 22}]}
  A: {wrap: shortest, rapid: *r, modes: [{frequency: 30, participation: 1}]}
"""
    program = b"G21 G17 G40 G90 G94 G64 F100.\nG0 X0. A300.\nG0 A90.\nG0 X50. A90.\nG0 A10.\nM30\n"
    for controller, planned in (("fanuc", []), ("csv", [3, 4, 5])):
        result = process(program, Machine.loads(text), controller=controller)
        lines = result.program.rapids.line[result.plans.planned]
        assert lines.tolist() == planned
    plain = program.replace(b"A300.", b"A100.")
    result = process(plain, Machine.loads(text))
    assert result.program.rapids.line[result.plans.planned].tolist() == [3, 4, 5]


# Mills and lathes


@pytest.mark.parametrize("dialect", [d for d in DIALECTS if DIALECTS[d].lathe == "no"])
def test_a_dialect_of_mills_is_refused_on_a_lathe(dialect):
    with pytest.raises(ProgramError, match="it is a lathe"):
        read(b"", dialect, head=b"G90\n", diameter=True)


@pytest.mark.parametrize(
    "text",
    [
        b"O1 (FANUC TURN POST)\nG90 X40. Z-20.\nX35.\n",
        b"O1 (FANUC)\nT0101\nG0 X40. Z2.\n",
        b"O1 (FANUC)\nG50 S2000\nG0 X40. Z2.\n",
        b"O1 (FANUC)\nG96 S200\nG0 X40. Z2.\n",
        b"O1 (FANUC)\nG71 P10 Q20 R1.\n",
        b"O1 (FANUC)\nG76 P010060 Q100 R0.05\n",
        b"(HAAS ST-20)\nG0 T0202\nG50 S1000\n",
    ],
)
def test_auto_takes_no_program_of_a_lathe_for_one_of_a_mill(text):
    with pytest.raises(ProgramError, match="lathe"):
        read_program(io.BytesIO(text), dialect="auto")


def test_auto_takes_no_mill_on_a_machine_that_is_a_lathe():
    with pytest.raises(ProgramError, match="lathe"):
        read_program(io.BytesIO(b"(FANUC)\nG0 X1.\n"), dialect="auto", start=Start(diameter=True))


def test_increments_u_and_w_are_those_of_system_a():
    program = read_program(io.BytesIO(b"O1 (FANUC)\nG0 X40. Z2.\nU-2. W1.\n"), dialect="auto")
    assert program.dialect == "fanuc-lathe-a"


@pytest.mark.parametrize(
    "text",
    [
        b"O1\nM62\nG0 X100\n", b"O1\nM66 (CHUCK)\nG0 X100\n", b"O1\nG38.2 Z-5. F50.\n",
        b"O1\nG50 S2000\n", b"O1\nM97 P10\n", b"O1\nG103 P1\n", b"O1\nG54.1 P2\n",
    ],
)  # fmt: skip
def test_codes_that_many_builders_use_are_no_evidence(text):
    with pytest.raises(ProgramError):
        read_program(io.BytesIO(text), dialect="auto")


# F that the program itself reads


@pytest.mark.parametrize(
    ("dialect", "reads"),
    [
        ("linuxcnc", b"#1=#<_feed>\n"),
        ("linuxcnc", b"#1=[#< _FEED >*2]\n"),
        ("linuxcnc", b"M70\n"),
        ("linuxcnc", b"M72\n"),
        ("linuxcnc", b"#1=##2\n"),
        ("fanuc", b"#1=#4109\n"),
        ("fanuc", b"G1 X5. F[#4109*2]\n"),
        ("haas", b"IF [#4109 GT 5] GOTO 10\n"),
    ],
)
def test_f_that_the_program_reads_is_restored(dialect, reads):
    def needed(text):
        data = HEADS[dialect] + b"G0 X9.\n" + text + b"G1 X3. F7.\n"
        return bool(read_program(io.BytesIO(data), dialect=dialect).rapids.feed_needed[-1])

    assert needed(reads)
    assert not needed(b"#1=#2\n")


# What holds in one branch only


def test_a_feed_that_may_have_been_written_either_way_is_not_known():
    text = b"F200.\n/M98 P2\nG0 X9.\nG1 X5.\nM30\nO2\nF200\nM99\n"
    found = read(text, "fanuc", decimal_point="calculator")
    assert found[0] == Reason.FEED_UNKNOWN


def test_a_tolerance_that_holds_in_one_branch_only_makes_the_path_unknown():
    data = HEADS["linuxcnc"] + b"G64 P0.02\n/G64 P0.05\nG0 X9\n"
    assert read_program(io.BytesIO(data)).rapids.path[-1] == 0


CONSTANT = {
    *("ended", "touched", "fixed", "wraps", "slides", "limits", "along", "straight", "line"),
    "lost",
}


def _different(field, k):
    """A value of a field that another k does not give."""
    return {
        "mode": k + 1, "number": k + 0.5, "axes": [k + 0.25] * len(AXES), "once": bool(k),
        "named": {"rotation": bool(k)}, "lowest": {"velocity": 2.0 - k},
        "table": {k: [1.0]}, "constant": None,
    }[field.kind]  # fmt: skip


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.name)
def test_every_field_of_the_state_is_joined_forgotten_and_compared(field):
    a, b = State(), State()
    if field.kind in ("constant", "note"):
        assert field.name in CONSTANT
        return
    for k, state in enumerate((a, b)):
        value = _different(field, k)
        if field.name == "cycle":
            value = (810 + 10 * k, 1.0, 2.0)
        elif field.name == "variables":
            value = {"1": 1.0 + k}
        if field.kind != "once":
            state.turns = state.rotates = True
        setattr(state, field.name, value)
    assert not agree(a, b)
    assert agree(a, a.copy())
    assert a.copy() is not a
    joined = getattr(join(a, b), field.name)
    forgotten = a.copy()
    forgotten.forget()
    gone = getattr(forgotten, field.name)
    if field.kind == "once":
        assert joined is True
    elif field.kind == "named":
        assert joined == {"rotation": None} == gone
    elif field.kind == "lowest":
        assert joined == {"velocity": 1.0}
        assert gone == {"velocity": 2.0}
    elif field.kind == "table":
        assert joined == {} == gone
    elif field.kind == "axes":
        assert all(map(math.isnan, joined))
        assert all(map(math.isnan, gone))
    else:
        assert joined is None or math.isnan(joined)
        assert gone is None or math.isnan(gone)
    for word in {other.together for other in FIELDS if other.name == field.name} - {""}:
        for other in FIELDS:
            if other.together == word:
                value = getattr(join(a, b), other.name)
                assert value is None or math.isnan(value)


@pytest.mark.parametrize("name", KINDS)
def test_every_field_of_the_second_reading_is_joined(name):
    made = [Known(DIALECTS["linuxcnc"], Facts()) for _ in range(2)]
    assert set(vars(made[0])) == set(KINDS)
    values = {
        "modes": [{"motion": 0}, {"motion": 10}], "frames": [{"r": True}, {"r": False}],
        "axes": [[1.0] * len(AXES), [2.0] * len(AXES)], "table": [{1: 2.0}, {1: 3.0}],
        "number": [1.0, 2.0], "tolerance": [1.0, 2.0], "ever": [False, True], "mode": [1, 2],
        "least": [{"velocity": 2.0}, {"velocity": 1.0, "jerk": 3.0}],
    }  # fmt: skip
    kind = KINDS[name]
    if kind in ("given", "place"):
        return
    for known, value in zip(made, values[kind], strict=True):
        setattr(known, name, value)
        known.path = value if name == "path" else 64
    made[0].join(made[1])
    joined = getattr(made[0], name)
    if kind == "tolerance":
        assert made[0].path is None
    elif kind in ("modes", "frames"):
        assert set(joined.values()) == {None}
    elif kind == "axes":
        assert all(map(math.isnan, joined))
    elif kind == "table":
        assert joined == {}
    elif kind == "least":
        assert joined == {"velocity": 1.0, "jerk": 3.0}
    elif kind == "ever":
        assert joined is True
    else:
        assert joined is None or math.isnan(joined)


# Right programs that were refused


def test_klippers_bare_g92_makes_every_position_zero():
    data = HEADS["klipper"] + b"G0 X5\nG92\nG0 X5\nG1 Z3\n"
    rapids = read_program(io.BytesIO(data), dialect="klipper").rapids
    assert (rapids.reason[-1], rapids.start[-1, 0], rapids.target[-1, 0]) == (CERTAIN, 0.0, 5.0)


def test_a_tool_with_a_name_is_a_tool_change():
    found = read(b'T="DRILL 8.5" M6\nG0 X1 Y1 Z1\nX5\n', "siemens")
    assert found[-1] is None


@pytest.mark.parametrize("text", [b"G0 X=9\n", b"G0 X = 9\n", b"G0 X=+9\n", b"G0 X=-9 Y=AC(3)\n"])
def test_siemens_values_behind_an_equals_sign(text):
    assert read(text, "siemens")[-1] in (None, Reason.OTHER_WORDS)


def test_text_behind_the_end_of_a_block_is_a_comment():
    assert read(b"G0 X9. ; to the corner\nX8. ; T1 is a 10MM MILL\n", "fanuc") == [None, None]
    assert read(b"G0 X9. ; X5.\n", "fanuc") == [Reason.NOT_UNDERSTOOD]


def test_line_ends_cr_cr_lf():
    data = HEADS["linuxcnc"].replace(b"\n", b"\r\r\n") + b"G0 X9\r\r\nX8\r\r\n"
    rapids = read_program(io.BytesIO(data)).rapids
    assert (rapids.reason[1:] == CERTAIN).all()
    assert data[rapids.begin[1] : rapids.end[1]].strip() == b"G0 X9"


def test_a_byte_order_mark_belongs_to_no_line():
    data = b"\xef\xbb\xbf" + HEADS["linuxcnc"] + b"G0 X9\n"
    program = read_program(io.BytesIO(data))
    assert program.findings == (program.findings[-1],)
    assert program.size == len(data)
    assert program.insert_at == 3
    assert program.rapids.reason[-1] == CERTAIN
    assert data[program.rapids.begin[-1] : program.rapids.end[-1]] == b"G0 X9"


def test_a_code_that_is_not_known_is_named():
    (finding, *_) = read_program(io.BytesIO(b"G21 G90\nG187 P1\nG0 X1\nM2\n")).findings
    assert "G187" in finding.message
    assert "linuxcnc" in finding.message


def test_a_control_character_is_named():
    program = b"G21 G90\nG0 X1\x01\n"
    with pytest.raises(ProgramError, match="0x01"):
        read_program(io.BytesIO(program))


def test_klartext_is_refused_whatever_dialect_is_stated():
    klartext = b"0 BEGIN PGM PART MM\n1 TOOL CALL 1 Z S2000\n2 L X+10 FMAX\n3 END PGM PART MM\n"
    with pytest.raises(ProgramError, match="Klartext"):
        read_program(io.BytesIO(klartext), dialect="heidenhain-iso")
    with pytest.raises(ProgramError, match="no line BEGIN PGM"):
        read_program(io.BytesIO(b"G0 X1\n"), dialect="klartext")


def test_every_reader_begins_in_a_state_without_a_unit():
    for name, dialect in DIALECTS.items():
        fixed = "units" in dialect.defaults
        assert (Reader("p", dialect, Start()).state.unit is not None) is fixed, name


def test_a_plane_that_nobody_knows_is_no_error_of_the_second_reader():
    """Heidenhain's G20 takes the fourth axis for the tool's."""
    program = (
        b"N10 G20 G71 G90 G40\nN20 G00 X0 Y0 Z0\nN30 G00 X10 Y5\nN40 G41 G01 X20 F100\nN60 M30\n"
    )
    machine = Machine.load(find_machine("centre"))
    machine = replace(machine, controller="csv", dialect="heidenhain-iso")
    made = process(program, machine)
    assert (made.planned, made.verification.confirmed) == (1, 1)


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "iso-mill"])
@pytest.mark.parametrize("words", [b"G5.1 Q1 X0. Y0. Z0.", b"G05.1Q2X0Y0Z0\nG5.1Q0"])
def test_axes_that_are_smoothed_do_not_move(dialect, words):
    data = HEADS["fanuc"] + b"G0 X10. Y20. Z9.\n" + words + b"\nG0 X50.\n"
    rapids = read_program(io.BytesIO(data), dialect=dialect).rapids
    assert rapids.reason[-1] == CERTAIN
    assert rapids.start[-1, :3].tolist() == [10.0, 20.0, 9.0]
    found = Findings(100)
    confirm(io.BytesIO(data), dialect, Start(), rapids, [len(rapids) - 1], found)
    assert not found.violations
    rapids.start[-1, 0] = 0.0  # as if the axis had moved
    confirm(io.BytesIO(data), dialect, Start(), rapids, [len(rapids) - 1], found)
    assert found.violations


@pytest.mark.parametrize("dialect", ["linuxcnc", "mach"])
def test_what_a_word_of_an_a_that_slides_means_in_inches_is_not_known(dialect):
    slides = {"wraps": {"A": "none"}, "linear": {"A": True}}
    text = b"G0 A1.\nG0 A2.\nG20\nG0 X1.\nG0 A3.\nG0 X2.\nG21\nG0 A4.\nG0 A5.\n"
    head = HEADS[dialect].replace(b" A10", b"") + b"G0 A10.\n"
    expected = [None, None, None, START, None, START, None]
    assert read(text, dialect, head, **slides) == expected
    # Where it turns, degrees are degrees.
    assert START not in read(text, dialect, head, wraps={"A": "none"})
    also_noticed(head + text, dialect, **slides)


@pytest.mark.parametrize("dialect", ["duet", "grbl", "rs274", "any-mill"])
def test_how_far_an_a_turns_in_inches_is_not_known_where_a_firmware_converts_degrees(dialect):
    """RepRapFirmware converts words of every axis, grblHAL those of axes outside of $376."""
    turns = {"wraps": {"A": "none"}, "limits": dict.fromkeys("XYZA", (math.inf,) * 3)}
    head = b"G21 G90 G94 G17 G40 G49 G54 F100\nG0 X0. Y0. Z50.\n"
    head = HEADS["duet"] if dialect == "duet" else head
    text = b"G0 A10.\nG0 A20.\nG0 X9.\n"
    assert read(text, dialect, head, **turns) == [START, None, None]
    inches = head.replace(b"G21", b"G20")
    assert read(text, dialect, inches, **turns) == [START, START, None]
    data = inches + text[:16]
    another = replace(DIALECTS[dialect], inches_turn=False)
    rapids = read_program(io.BytesIO(data), dialect=another, start=Start(**turns)).rapids
    assert rapids.reason[-1] == CERTAIN
    assert not confirm(io.BytesIO(data), dialect, Start(**turns), rapids, [1], Findings(100))


def test_an_a_that_slides_is_known_in_no_program_for_a_machine_in_inches():
    text = "units: {}\ninterval: 0.001\npositioning: linear\naxes:\n  A:\n    type: linear\n"
    text += "    rapid: {{velocity: 10, acceleration: 50, jerk: 5000}}\n"
    for units, known in (("mm", True), ("inch", False)):
        assert Machine.loads(text.format(units)).program_start().linear == {"A": known}


@pytest.mark.parametrize("dialect", ["grbl", "rs274"])
@pytest.mark.parametrize(
    "line",
    [
        b"/G1 X5",  # skipped, run or refused
        b"G1 X5 / Y3",
        b"G1 X5 (a;b) Y3",  # FluidNC ends the line at the semicolon
        b"G1 X5 (" + b"c" * 130 + b") Y3",  # and refuses a line of more than 127 bytes
        b"N99999999 G1 X5",
        b"G92 G1 X5",  # FluidNC moves all axes
        b"G28 G1 X5",
        b"G43.1 G1 Z5",
    ],
)
def test_what_fluidnc_takes_otherwise_is_not_known(line, dialect):
    head = b"G21 G90 G94 G17 G54 G40 G49\nG0 X1 Y1 Z1\nG1 F100\n"
    rapids = read_program(
        io.BytesIO(head + line + b"\nG0 X9 Y9\n"), dialect=dialect, start=start_of(dialect)
    ).rapids
    assert np.isnan(rapids.start[-1, :2]).any()
    assert read(head + line + b"\nG0 X9 Y9\n", dialect, b"")[-1] is not None


def test_a_g40_behind_what_one_reading_does_not_know_is_not_held_against_a_rapid():
    head = b"X=R1 ) A5\nG17 G54 G40 G49 G80 G90 G94 G21 F800.\n"
    text = b"G2 X47.5 Y30. Z2.1 I-2.5 J0.\nG0 Z21.\n"
    assert read(text, "haas", head) == [None]


def test_the_name_of_the_file_means_nothing_to_either_reading_beside_calls():
    head = b"%\nPART-2.NC (post)\nG21 G90 G94 G17 G40 G49 G80 G54 G64 F100.\nG0 Z50.\n"
    text = b"G0 Z5.\nG1 X5.\nM98 P1000\nM30\n%\n"
    assert read(text, "fanuc", head) == [None]
    rapids = read_program(io.BytesIO(head + text), dialect="fanuc").rapids
    assert confirm(io.BytesIO(head + text), "fanuc", Start(), rapids, [1], Findings(9)) == 1


@pytest.mark.parametrize("dialect", ["grbl", "rs274"])
def test_what_the_second_reading_does_not_know_it_does_not_refuse(dialect):
    """An axis that the machine does not have leaves it without a motion, the first one with G0."""
    head = b"G21 G90 G94 G17 G54 G40 G49\nG0 X1 Y1 Z1\n"
    assert read(head + b"W-3\nX9\nZ9\n", dialect, b"", limits={})[-2:] == [None, None]


@pytest.mark.parametrize("dialect", ["grbl", "rs274"])
@pytest.mark.parametrize(
    "line",
    [
        b"(" + b"c" * 300 + b")",
        b"(" + b"c" * 80 + b") ;" + b"d" * 80,
        b"(a; b)",
        b"G1 X5 (a; b)",
        b"G1 X5 (a) ; b",
        b"N9999999 G1 X5",
    ],
)
def test_comments_and_numbers_that_no_control_minds_cost_nothing(line, dialect):
    head = b"G21 G90 G94 G17 G54 G40 G49\nG0 X1 Y1 Z1\nG1 F100\n"
    assert read(head + line + b"\nG0 X9 Y9\n", dialect, b"")[-1] is None

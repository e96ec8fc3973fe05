#!/usr/bin/python3
"""What LinuxCNC's own interpreter makes of a program: every move, with its line and full precision.

    /usr/bin/python3 oracle.py part.ngc [--tool-table sim.tbl] [--modal]
    /usr/bin/python3 oracle.py --serve

One call per line on standard output: `line WHAT values`, positions in mm in program coordinates,
angles in degrees, feed in mm/min. Exit status 0, or 1 with `file:line: message` where the
interpreter refuses the program. It needs Debian's own /usr/bin/python3 (module `gcode`, package
linuxcnc-uspace).

rs274 itself prints four decimals, and the module `gcode` alone crashes (signal 11) at the first T
or M6: the tool data library has no table. AXIS and the controller open one made by another process;
here it is made in this process before the interpreter starts, in a private $HOME, so that neither a
running LinuxCNC nor another oracle shares it.

With --serve it reads one line of JSON for each program (`arguments`, `timeout` in s, and where its
output goes: `out`, `err`), interprets that program in a process of its own, and prints the exit
status: null where time was out.
"""

import argparse
import ctypes
import json
import os
import re
import signal
import sys
import tempfile
from pathlib import Path

INCH = 25.4
STARTUP = "G17 G21 G40 G49 G54 G64 G80 G90 G94 G97"


def open_tool_data(home, table):
    """Make $HOME/.tool.mmap and load the table into it."""
    os.environ["HOME"] = home
    library = ctypes.CDLL("libtooldata.so.0", mode=ctypes.RTLD_GLOBAL)
    library._Z17tool_mmap_creatorPK13EMC_TOOL_STATi(None, 0)
    library._Z13tooldata_initb(ctypes.c_bool(False))
    if library._Z13tooldata_loadPKcPPc(table.encode(), None) != 0:
        raise SystemExit(f"{table}: not a tool table")


def read_tools(table):
    """The table's entries in file order, as the interpreter asks for them; 0 is the spindle."""
    tools = [(-1,) + (0.0,) * 12 + (0,)]
    for line in Path(table).read_text(encoding="latin-1").splitlines():
        words = {
            w[0].upper(): float(w[1:]) for w in re.findall(r"[A-Za-z][-+.\d]+", line.split(";")[0])
        }
        if "T" in words:
            lengths = [words.get(a, 0.0) / INCH for a in "XYZ"] + [words.get(a, 0.0) for a in "ABC"]
            lengths += [words.get(a, 0.0) / INCH for a in "UVW"] + [words.get("D", 0.0) / INCH]
            angles = [words.get("I", 0.0), words.get("J", 0.0)]
            tools.append((int(words["T"]), *lengths, *angles, int(words.get("Q", 0))))
    return tools


class Canon:
    """Called by the interpreter, always in inches; anything else is ignored."""

    def __init__(self, out, tools, parameter_file, modal):
        self.out, self.tools, self.modal = out, tools, modal
        self.parameter_file = parameter_file
        self.line = 0

    def put(self, what, lengths=(), *rest):
        words = [self.line, what, *(f"{v * INCH:.9f}" for v in lengths), *rest]
        self.out.write(" ".join(map(str, words)) + "\n")

    def next_line(self, state):
        self.line = state.sequence_number
        if self.modal and self.line:
            codes = [f"G{c / 10:g}" for c in state.gcodes[1:] if c >= 0]
            self.put("MODAL", (), *codes)

    def pose(self, what, p):
        self.put(what, p[:3], *(f"{a:.9f}" for a in p[3:6]))

    def straight_traverse(self, *p):
        self.pose("TRAVERSE", p)

    def straight_feed(self, *p):
        self.pose("FEED", p)

    def straight_probe(self, *p):
        self.pose("PROBE", p)

    def rigid_tap(self, *p):
        self.put("RIGID_TAP", p[:3])

    def arc_feed(self, first, second, c1, c2, turns, axis, *_):
        self.put("ARC", (first, second, c1, c2, axis), turns)

    def set_feed_rate(self, rate):
        self.put("FEEDRATE", (), f"{rate * INCH:.6f}")

    def dwell(self, seconds):
        self.put("DWELL", (), seconds)

    def change_tool(self, pocket):
        self.put("CHANGE_TOOL", (), self.tools[pocket][0] if pocket < len(self.tools) else pocket)

    def tool_offset(self, *p):
        self.put("TOOL_OFFSET", p[:3])

    def set_g5x_offset(self, index, *p):
        self.put("G5X_OFFSET", p[:3], index)

    def set_g92_offset(self, *p):
        self.put("G92_OFFSET", p[:3])

    def set_xy_rotation(self, angle):
        self.put("ROTATION", (), f"{angle:.9f}")

    def set_plane(self, plane):
        self.put("PLANE", (), {1: "G17", 2: "G19", 3: "G18"}.get(plane, plane))

    def user_defined_function(self, number, p, q):
        self.put(f"M{100 + number}", (), p, q)

    def get_tool(self, pocket):
        return self.tools[pocket] if pocket < len(self.tools) else (-1,) + (0.0,) * 12 + (0,)

    def check_abort(self):
        return False

    def get_external_length_units(self):
        return 1.0 / INCH  # of the machine: mm

    def get_external_angular_units(self):
        return 1.0

    def get_axis_mask(self):
        return 0b111111

    def get_block_delete(self):
        return False

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *arguments: None


def main(arguments, home):
    """Interpret one program; its exit status."""
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--tool-table", default=os.path.join(here, "sim.tbl"), help="lengths in mm")
    parser.add_argument("--startup", default=STARTUP, help="codes in force before the first line")
    parser.add_argument(
        "--modal", action="store_true", help="also the active G codes of each line that acts"
    )
    given = parser.parse_args(arguments)
    open_tool_data(home, given.tool_table)
    import gcode  # the interpreter; only now, since it needs the tool data

    parameter_file = os.path.join(home, "oracle.var")
    open(parameter_file, "w").close()
    canon = Canon(sys.stdout, read_tools(given.tool_table), parameter_file, given.modal)
    result, _ = gcode.parse(given.program, canon, "G21", given.startup)
    sys.stdout.flush()
    if result > gcode.MIN_ERROR:
        print(f"{given.program}:{canon.line}: {gcode.strerror(result)}", file=sys.stderr)  # noqa: T201
        return 1
    return 0


def serve():
    """One process for each program that is asked for, until no more are."""
    for line in sys.stdin:
        asked = json.loads(line)
        with tempfile.TemporaryDirectory(prefix="oracle-") as home:
            child = os.fork()
            if child == 0:
                interpret(asked, home)
            _, ended = os.waitpid(child, 0)
        status = os.waitstatus_to_exitcode(ended)
        print(json.dumps(None if status == -signal.SIGALRM else status), flush=True)  # noqa: T201


def interpret(asked, home):
    """The whole life of a process that interprets one program."""
    signal.alarm(asked["timeout"])
    status = 70
    try:
        for name, stream in (("out", 1), ("err", 2)):
            os.dup2(os.open(asked[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), stream)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        status = main(asked["arguments"], home)
    except SystemExit as ending:
        status = 2
        print(ending, file=sys.stderr)  # noqa: T201
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


if __name__ == "__main__":
    if sys.argv[1:] == ["--serve"]:
        serve()
    else:
        with tempfile.TemporaryDirectory(prefix="oracle-") as home:
            sys.exit(main(sys.argv[1:], home))

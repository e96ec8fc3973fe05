"""Firmwares' own interpreters, from checkouts of theirs: what each line of a program does there.

- ``KLIPPER``: folder of a checkout of Klipper3d/klipper. Its ``gcode.py`` and ``gcode_move.py`` run
  here, with a printer of stubs.
- ``GRBL``: folder of a checkout of gnea/grbl; gcc builds the interpreter with `grbl.c`.
- ``GRBLHAL``: folder of a checkout of grblHAL/Simulator with its submodule (grblHAL/core); gcc
  builds the interpreter with `grblhal.c`.
- ``FLUIDNC``: folder of a checkout of bdring/FluidNC; g++ builds the interpreter with
  `fluidnc.cpp`.

All are under the GPL, so that nothing of them is in this project, and no package of Debian has
them. Behind a line that is refused, the next one runs: some senders go on so.
"""

import contextlib
import importlib
import json
import os
import subprocess
import sys
import tempfile
import textwrap
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent


@dataclass(frozen=True)
class Ran:
    """What a line did; lengths in mm, of the axes that the machine has."""

    start: dict[str, float]
    """In front of its motion, by the names that hold behind it."""
    end: dict[str, float]
    offset: dict[str, float]
    """Machine minus program coordinates."""
    motions: int
    rapids: int | None
    """Those of them that run as fast as the axes can; None where the firmware has no such."""
    refused: bool
    feed: float
    """[mm/min]"""
    incremental: bool
    inch: bool


def checkout(variable, file):
    """Folder that an environment variable names; the test is skipped without one."""
    folder = Path(os.environ.get(variable, os.devnull))
    if not (folder / file).is_file():
        pytest.skip(f"{variable} names no checkout that has {file}")
    return folder


class _Printer:
    """What Klipper's classes ask of a printer, and no more."""

    def __init__(self, commands):
        self.answers, self._handlers = [], {}
        self.command_error, self.config_error = commands.CommandError, RuntimeError
        self.place, self.speeds = [0.0] * 4, []
        dispatch = commands.GCodeDispatch(self)
        dispatch.register_output_handler(self.answers.append)
        self._objects = {"gcode": dispatch, "toolhead": self}
        for name in ("G4", "M400", "M204", "SET_VELOCITY_LIMIT"):
            dispatch.register_command(name, lambda command: None)

    def add(self, name):
        self._objects[name] = importlib.import_module(f"extras.{name}").load_config(self)

    # the printer, and a section of its configuration

    def get_printer(self):
        return self

    def getfloat(self, name, default=None, **limits):
        return default

    def get_start_args(self):
        return {}

    def get_reactor(self):
        return self

    def mutex(self):
        return contextlib.nullcontext()

    def register_event_handler(self, event, handler):
        self._handlers.setdefault(event, []).append(handler)

    def send_event(self, event, *arguments):
        for handler in self._handlers.get(event, []):
            handler(*arguments)

    def lookup_object(self, name, default=None):
        return self._objects.get(name, default)

    def load_object(self, config, name):
        return self._objects[name]

    def invoke_shutdown(self, message):
        self.answers.append(f"!! {message}")

    def is_shutdown(self):
        return False

    # the toolhead and its kinematics

    def move(self, place, speed):
        self.place = list(place)
        self.speeds.append(speed)

    def get_position(self):
        return list(self.place)

    def get_extra_axes(self):
        return [None] * 4

    def get_kinematics(self):
        return self

    def home(self, state):
        for axis in state.get_axes():
            self.place[axis] = 7.0 + axis
        self.send_event("homing:home_rails_end", state, [])


def run_klipper(lines, arcs, before=()):
    """What Klipper makes of a program.

    Parameters
    ----------
    lines : list of str
        The program's.
    arcs : bool
        The section [gcode_arcs] is there.
    before : sequence of str
        Lines that ran before, of which nothing is told.
    """
    folder = checkout("KLIPPER", "klippy/extras/gcode_move.py") / "klippy"
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
    printer = _Printer(importlib.import_module("gcode"))
    for name in ("gcode_move", "homing", "firmware_retraction", *(["gcode_arcs"] * arcs)):
        printer.add(name)
    printer.send_event("klippy:ready")
    moves, commands = printer.lookup_object("gcode_move"), printer.lookup_object("gcode")

    def places():
        return dict(zip("XYZ", moves.last_position, strict=False))

    told = []
    for line in (*before, *lines):
        front, printer.speeds[:], printer.answers[:] = places(), [], []
        commands._process_commands([line])
        offset = dict(zip("XYZ", moves.base_position, strict=False))
        told.append(
            Ran(
                start={axis: front[axis] - offset[axis] for axis in "XYZ"},
                end={axis: place - offset[axis] for axis, place in places().items()},
                offset=offset,
                motions=len(printer.speeds),
                rapids=None,
                refused=any(answer.startswith("!!") for answer in printer.answers),
                feed=moves.speed / moves.speed_factor,
                incremental=not moves.absolute_coord,
                inch=False,
            )
        )
    return told[len(before) :]


@cache
def _grbl():
    """The interpreter, in a folder that goes with this process."""
    source = checkout("GRBL", "grbl/gcode.c") / "grbl"
    folder = tempfile.TemporaryDirectory(prefix="grbl-")
    # What its headers ask of an AVR's compiler and library.
    for header in ("io", "pgmspace", "interrupt", "wdt"):
        _empty(folder, "avr", header)
    _empty(folder, "util", "delay")
    flags = ["-D__flash=", "-D_delay_ms(n)=", "-D_delay_us(n)=", f"-I{folder.name}", f"-I{source}"]
    files = [source / f"{name}.c" for name in ("gcode", "protocol", "nuts_bolts", "settings")]
    return folder, _built(folder, [*flags, HERE / "grbl.c", *files])


def _empty(folder, *names):
    header = Path(folder.name, *names).with_suffix(".h")
    header.parent.mkdir(exist_ok=True)
    header.touch()


ARDUINO = {
    "Arduino.h": """\
        #pragma once
        #include <charconv>
        #include <cmath>
        #include <cstdint>
        #include <cstring>
        #include <string>
        #include "IPAddress.h"
        #include "Print.h"
        #include "Stream.h"
        #include "WString.h"
        """,
    "IPAddress.h": """\
        #pragma once
        #include <cstdint>
        struct IPAddress {
            IPAddress(uint32_t address = 0) {}
            operator uint32_t() const { return 0; }
            bool fromString(const char*) { return false; }
        };
        """,
}
"""What FluidNC's headers ask of an Arduino."""


@cache
def _fluidnc():
    """The interpreter, in a folder that goes with this process."""
    source = checkout("FLUIDNC", "FluidNC/src/GCode.cpp") / "FluidNC"
    folder = tempfile.TemporaryDirectory(prefix="fluidnc-")
    for name, text in ARDUINO.items():
        Path(folder.name, name).write_text(textwrap.dedent(text))
    names = "GCode Parameters Expression Flowcontrol NutsBolts string_util Error"
    names += " Pins/VoidPinDetail Pins/PinDetail Pins/PinCapabilities Pins/PinAttributes"
    files = [source / "src" / f"{name}.cpp" for name in names.split()]
    files += [source / "capture" / "arduino" / f"{name}.cpp" for name in ("Print", "WString")]
    folders = [folder.name, *(source / name for name in ("capture", "capture/arduino"))]
    folders += [source / "include", source / "src", source]
    flags = ["-std=c++20", "-fpermissive", "-include", "charconv", "-DHOST", "-DARDUINO=1"]
    flags += ['-DMCU="linux"', '-DVARIANT="capture"', "-DSKIP_HARDWARE_SETUP=1"]
    flags += [f"-I{name}" for name in folders]
    return folder, _built(folder, [*flags, HERE / "fluidnc.cpp", *files], compiler="g++")


@cache
def _grblhal(axes):
    """The interpreter, built for so many axes, in a folder that goes with this process."""
    source = checkout("GRBLHAL", "src/grbl/gcode.c") / "src"
    folder = tempfile.TemporaryDirectory(prefix="grblhal-")
    files = [*(source / "grbl").glob("*.c"), *(source / "grbl" / "kinematics").glob("*.c")]
    files += [source / f"{name}.c" for name in ("eeprom", "grbl_eeprom_extensions")]
    files += [source / "validator_driver.c", source / "platform_linux.c", HERE / "grblhal.c"]
    flags = [f"-DN_AXIS={axes}", "-DPLATFORM_LINUX", "-DF_CPU=16000000", f"-I{source}"]
    return folder, _built(
        folder, [*flags, "-Wl,--wrap=mc_line,--wrap=mc_arc", *files, "-lrt", "-lpthread"]
    )


def _built(folder, arguments, compiler="gcc"):
    """A program of C or C++."""
    program = Path(folder.name, "interpreter")
    command = [compiler, "-O1", "-w", "-fno-strict-aliasing", "-o", program, *arguments, "-lm"]
    subprocess.run(command, check=True, timeout=300)
    return program


def run_grbl(lines, before=()):
    """What plain grbl makes of a program.

    Parameters
    ----------
    lines : list of str
        The program's.
    before : sequence of str
        Lines that ran before, of which nothing is told.
    """
    return _told(*_grbl(), "XYZ", [*before, *lines])[len(before) :]


def run_fluidnc(lines, before=()):
    """What FluidNC makes of a program; as of `run_grbl`."""
    return _told(*_fluidnc(), "XYZ", [*before, *lines])[len(before) :]


def run_grblhal(lines, axes="XYZ", before=()):
    """What grblHAL makes of a program.

    Parameters
    ----------
    lines : list of str
        The program's.
    axes : str
        Of the machine.
    before : sequence of str
        Lines that ran before, of which nothing is told.
    """
    folder, program = _grblhal(len(axes))
    Path(folder.name, "EEPROM.DAT").unlink(missing_ok=True)
    return _told(folder, program, axes, [*before, *lines])[len(before) :]


def _told(folder, program, axes, lines):
    """What an interpreter in C tells of each line."""
    text = "".join(f"{line}\n" for line in lines).encode("latin-1")
    done = subprocess.run(
        [program], input=text, cwd=folder.name, capture_output=True, timeout=20, check=True
    )
    told, stands = [], dict.fromkeys(axes, 0.0)
    for answer in done.stdout.splitlines():
        _, error, motions, rapids, incremental, inch, feed, *numbers = json.loads(answer)
        machine = dict(zip(axes, numbers[::2], strict=True))
        offset = dict(zip(axes, numbers[1::2], strict=True))
        told.append(
            Ran(
                start={axis: stands[axis] - offset[axis] for axis in axes},
                end={axis: machine[axis] - offset[axis] for axis in axes},
                offset=offset,
                motions=motions,
                rapids=rapids,
                refused=error != 0,
                feed=feed,
                incremental=bool(incremental),
                inch=bool(inch),
            )
        )
        stands = machine
    return told

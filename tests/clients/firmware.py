"""Firmwares' own interpreters, from checkouts of theirs: what each line of a program does there.

- ``KLIPPER``: folder of a checkout of Klipper3d/klipper. Its ``gcode.py`` and ``gcode_move.py`` run
  here, with a printer of stubs.
- ``GRBL``: folder of a checkout of gnea/grbl; gcc builds the interpreter with `grbl.c`.
- ``GRBLHAL``: folder of a checkout of grblHAL/Simulator with its submodule (grblHAL/core); gcc
  builds the interpreter with `grblhal.c`.
- ``FLUIDNC``: folder of a checkout of bdring/FluidNC; g++ builds the interpreter with
  `fluidnc.cpp`.
- ``MARLIN``: folder of a checkout of MarlinFirmware/Marlin; g++ builds it for its own Linux with
  `marlin.cpp`, a minute each for what it can do without options and with them.

All are under the GPL, so that nothing of them is in this project, and no package of Debian has
them. Behind a line that is refused, the next one runs: some senders go on so.
"""

import contextlib
import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
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


MARLIN_OPTIONS = {
    "MOTHERBOARD": "BOARD_SIMULATED",
    "SERIAL_PORT": "0",
    **dict.fromkeys(("X_DRIVER_TYPE", "Y_DRIVER_TYPE", "Z_DRIVER_TYPE", "E0_DRIVER_TYPE"), "A4988"),
    "ARC_SUPPORT": "",
    # What asks for a machine, or for more of its code.
    **dict.fromkeys(
        (
            *("DWIN_CREALITY_LCD", "DWIN_LCD_PROUI", "RET6_12864_LCD", "PROUI_EX"),
            *("CV_LASER_MODULE", "LCD_BACKLIGHT_TIMEOUT_MINS", "SDSUPPORT", "EEPROM_SETTINGS"),
            *("PRINTCOUNTER", "NOZZLE_PARK_FEATURE", "ADVANCED_PAUSE_FEATURE", "LIN_ADVANCE"),
            *("HOTEND_IDLE_TIMEOUT", "POWER_LOSS_RECOVERY", "BABYSTEPPING", "HAS_GCODE_PREVIEW"),
            *("PROBE_MANUALLY", "MESH_BED_LEVELING", "AUTO_BED_LEVELING_UBL", "LCD_BED_LEVELING"),
            *("ENDSTOP_INTERRUPTS_FEATURE", "FILAMENT_RUNOUT_SENSOR", "CUSTOM_VERSION_FILE"),
            *("PREVENT_COLD_EXTRUSION", "PREVENT_LENGTHY_EXTRUDE", "NO_WORKSPACE_OFFSETS"),
            *("MIN_SOFTWARE_ENDSTOPS", "MAX_SOFTWARE_ENDSTOPS", "HOME_AFTER_DEACTIVATE"),
            *("NO_MOTION_BEFORE_HOMING", "HOST_ACTION_COMMANDS"),
        )
    ),
}
"""Of Marlin's configuration; None switches one off."""
MARLIN_EXTRAS = (
    *("INCH_MODE_SUPPORT", "PAREN_COMMENTS", "GCODE_CASE_INSENSITIVE", "GCODE_MOTION_MODES"),
    *("CNC_COORDINATE_SYSTEMS", "CNC_WORKSPACE_PLANES"),
)
MARLIN_WRAPS = (
    *("_ZN7Planner11buffer_lineERK7XYZEvalIfEfhRK12PlannerHints", "_ZN7Planner11synchronizeEv"),
    *("_ZN8Endstops20validate_homing_moveEv", "_Z8homeaxis8AxisEnum", "_Z4idleb"),
    *("_Z10safe_delayj", "_ZN11GCodeParser23unknown_command_warningEv"),
)


@cache
def _marlin(extras):
    """The interpreter, with what the language may have besides or not; as of the others."""
    checked_out = checkout("MARLIN", "Marlin/src/gcode/queue.cpp") / "Marlin"
    folder = tempfile.TemporaryDirectory(prefix="marlin-")
    source = Path(folder.name, "Marlin")
    shutil.copytree(checked_out, source, ignore=shutil.ignore_patterns("tft*", "fontdata"))
    options = {**MARLIN_OPTIONS, **dict.fromkeys(MARLIN_EXTRAS, "" if extras else None)}
    for file in (source / "Configuration.h", source / "Configuration_adv.h"):
        text = file.read_text()
        for name, value in options.items():
            new = f"//#define {name}" if value is None else f"#define {name} {value}"
            text = re.sub(rf"(?m)^(\s*)(?://\s*)?#define\s+{name}\b.*$", rf"\1{new}", text)
        file.write_text(text)
    flags = ["-std=gnu++17", "-D__PLAT_LINUX__", "-D__MARLIN_FIRMWARE__", f"-I{source}"]
    flags.append(f"-I{source / 'src/HAL/LINUX/include'}")
    others = re.compile(r"src/HAL/(?!LINUX|shared)|src/lcd/.*/|/LINUX/main.cpp|gcode/queue.cpp")
    files = [file for file in source.rglob("*.cpp") if not others.search(file.as_posix())]

    def compiled(file):
        out = file.with_suffix(".o")
        command = ["g++", "-w", *flags, "-c", file, "-o", out]
        subprocess.run(command, check=True, timeout=300)
        return out

    with ThreadPoolExecutor(os.cpu_count()) as threads:
        objects = list(threads.map(compiled, files))
    wraps = f"-Wl,{','.join(f'--wrap={name}' for name in MARLIN_WRAPS)}"
    linked = [*flags, HERE / "marlin.cpp", *objects, wraps, "-lrt", "-lpthread"]
    return folder, _built(folder, linked, compiler="g++")


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


def run_marlin(lines, extras, way, before=()):
    """What Marlin makes of a program.

    Parameters
    ----------
    lines : list of str
        The program's.
    extras : bool
        It has what its language may have besides (`MARLIN_EXTRAS`).
    way : str
        How lines come: of a "file", "bare" through the serial port, or "sent" by a sender.
    before : sequence of str
        Lines that ran before, of which nothing is told.
    """
    told = _told(*_marlin(extras), "XYZ", [*before, *lines], way)[len(before) :]
    return [replace(each, rapids=None) for each in told]


def _told(folder, program, axes, lines, *arguments):
    """What an interpreter in C tells of each line."""
    text = "".join(f"{line}\n" for line in lines).encode("latin-1")
    done = subprocess.run(
        [program, *arguments],
        input=text,
        cwd=folder.name,
        capture_output=True,
        timeout=20,
        check=True,
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

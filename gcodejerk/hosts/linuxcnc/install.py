"""Install what `linuxcnc-hal` needs into a LinuxCNC configuration, and take it out again.

Three things: `gcodejerk.hal` beside the INI, the M code M152 where the INI has its M codes, and
marked lines in the INI: the HAL file behind the last one, and a path for M codes where none is.
The override guard (form `guard`, for controller `linuxcnc`) has no M code, and needs halui.

Rule: everything is looked at before anything is written, and whatever does not fit is refused. The
user's own HAL files are never changed; what is taken out leaves the INI byte for byte.
"""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from gcodejerk.errors import EmitError, Place
from gcodejerk.hosts.linuxcnc import hal_files
from gcodejerk.hosts.linuxcnc.backups import HAL, backup_of, drop_backups, keep, write
from gcodejerk.hosts.linuxcnc.filter_lines import without_all
from gcodejerk.hosts.linuxcnc.hal_commands import Hal, read_hal
from gcodejerk.hosts.linuxcnc.ini import (
    Ini,
    check_motion,
    is_writable,
    marked,
    parse_ini,
    read_ini,
    without_lines,
)

HAL_FILE = "gcodejerk.hal"
MEASURED = "2.9"
"""The version of LinuxCNC in which all this was played."""
_OWN = re.compile(rb"# gcodejerk install ([a-z-]+) sum:([0-9a-f]{16})\n")
_LEAST_IO = 4
_ZERO = re.compile(r"[-+]?(?:0*\.?0*|0+\.?0*[eE].*)")
"""Inputs and outputs that motmod has unless told otherwise; number 3 is used."""


@dataclass(frozen=True, slots=True)
class Change:
    """What an installation would write."""

    ini: bytes
    hal: bytes
    script: bytes | None
    """None: the form has none."""
    script_path: Path


def install(path: str, form: str, version: str | None = None) -> list[str]:
    """Install a form.

    Parameters
    ----------
    path : str
        The INI.
    form : str
        One of `hal_files.FORMS`, or `hal_files.GUARD`.
    version : str, optional
        Of LinuxCNC; that of the one on this machine by default.

    Returns
    -------
    list of str
        What was done, for the user.

    Raises
    ------
    EmitError
        The configuration does not fit; nothing was changed.
    """
    ini = read_ini(path)
    own = ini.folder / HAL_FILE
    before = _installed(ini)
    _check_version(version)
    clean = parse_ini(ini.path, without_lines(ini.data))
    change = _change(clean, form)
    if before is not None:
        return [_again(ini, own, change, before, form)]
    for place in (ini.path, ini.folder):
        if not is_writable(place):
            raise EmitError(
                f"{place} cannot be written to",
                "copy the configuration to a folder of yours, and name the .ini file there",
            )
    files = {own: change.hal}
    if change.script is not None:
        files[change.script_path] = change.script
    for file, content in files.items():
        if file.exists() and file.read_bytes() != content:
            raise EmitError(
                f"{file} exists and is not what would be written", "rename or remove it first"
            )
    backup = backup_of(ini.path, HAL, ini.data, partial(without_all, ini.path))
    done = [f"{own}: written, the HAL of the form {form}"]
    write(own, change.hal)
    if change.script is not None:
        write(change.script_path, change.script)
        os.chmod(change.script_path, 0o755)
        done.append(f"{change.script_path}: written, the M code M152")
    keep(backup, ini.data)
    write(ini.path, change.ini)
    use = f"process programs with --controller linuxcnc-hal --as {form}"
    if form == hal_files.GUARD:
        use = "say controller_options: {override_guard: true} in the machine file, and process "
        use += "programs with --controller linuxcnc"
    return [
        *done,
        f"{ini.path}: {len(marked(change.ini))} marked block(s) of lines added; it was kept as "
        f"{backup.name}",
        f"{use}; `{_way_back(path)}` takes all of it out again",
    ]


def _way_back(path: str) -> str:
    return shlex.join(["gcodejerk", "install", "linuxcnc", path, "--remove"])


def remove(path: str) -> list[str]:
    """Take out what was installed.

    Returns
    -------
    list of str
        What was done.

    Raises
    ------
    EmitError
        Somebody has edited what was installed; nothing was changed.
    """
    ini = read_ini(path)
    own = ini.folder / HAL_FILE
    form = _installed(ini)
    if form is None and not own.exists():
        return [f"{ini.path}: nothing of gcodejerk is installed"]
    clean = without_lines(ini.data)
    # A HAL file that goes along with no INI any more was installed once, and is not loaded.
    _check_untouched(own)
    for block in marked(ini.data):
        lines = block.splitlines()
        keys = [line.partition("=")[0].strip() for line in lines]
        if keys not in (["HALFILE"], ["HALUI", "HALFILE"], ["USER_M_PATH"]):
            raise EmitError(
                f"the lines between the marks of gcodejerk were edited: {lines}",
                f"put them back as they were, or take them out by hand (backup: *{HAL})",
                ini.place(),
            )
    for place in (ini.path, ini.folder):
        if not is_writable(place):
            raise EmitError(f"{place} cannot be written to", "change its permissions")
    script = _script_path(parse_ini(ini.path, clean))
    write(ini.path, clean)
    done = [f"{ini.path}: the marked lines were taken out"]
    others = [other for other in sorted(ini.folder.glob("*.ini")) if _names_ours(other)]
    if others:
        return [*done, f"{own}, {script}: kept, {others[0].name} uses them, too"]
    own.unlink(missing_ok=True)
    done.append(f"{own}: removed")
    if script.is_file() and script.read_bytes() == _script():
        script.unlink()
        done.append(f"{script}: removed")
    return done + drop_backups(ini.path, clean, HAL, partial(without_all, ini.path))


def _names_ours(path: Path) -> bool:
    """Whether an INI loads our HAL file."""
    return re.search(rb"(?m)^\s*HALFILE\s*=\s*gcodejerk\.hal", path.read_bytes()) is not None


def _installed(ini: Ini) -> str | None:
    """The form that is installed, None where none is."""
    if not any(e.value == HAL_FILE for e in ini.all("HAL", "HALFILE")):
        return None
    own = ini.folder / HAL_FILE
    match = _OWN.match(own.read_bytes()) if own.is_file() else None
    if match is None:
        raise EmitError(
            f"the INI names {HAL_FILE}, which is not there or not of gcodejerk",
            "take that HALFILE out of the INI, or take back the backup",
            ini.place(),
        )
    return match[1].decode()


def _again(ini: Ini, own: Path, change: Change, before: str, form: str) -> str:
    """What to say where something is installed already."""
    if before != form:
        raise EmitError(
            f"the form {before} is installed already",
            f"run `{_way_back(str(ini.path))}` first",
            ini.place(),
        )
    _check_untouched(own)
    same = own.read_bytes() == change.hal and change.ini == ini.data
    if change.script is not None:
        path = change.script_path
        same = same and path.is_file() and path.read_bytes() == change.script
    if not same:
        raise EmitError(
            "another version of this is installed, or the configuration was changed since",
            f"run `{_way_back(str(ini.path))}`, then install again",
            ini.place(),
        )
    return f"{ini.path}: the form {form} is installed already; nothing was changed"


def _check_untouched(own: Path) -> None:
    """Refuse where somebody has edited the HAL file."""
    if not own.is_file():
        return
    data = own.read_bytes()
    match = _OWN.match(data)
    if match is None or _sum(data[match.end() :]) != match[2]:
        raise EmitError(
            f"{own} was edited after it was installed",
            "put what was added into a HAL file of your own, and put this one back or remove it",
        )


def _check_version(version: str | None) -> None:
    """Refuse a LinuxCNC in which this was not played, or of which the version cannot be told."""
    if version is None:
        tool = shutil.which("linuxcnc_var")
        if tool is not None:
            answer = subprocess.run(
                [tool, "LINUXCNCVERSION"], capture_output=True, text=True, check=False
            )
            version = answer.stdout.strip() or None
    if version is None:
        raise EmitError(
            "the version of LinuxCNC cannot be told: linuxcnc_var is not on this machine",
            "run this on the machine that runs LinuxCNC, or say --linuxcnc-version 2.9",
        )
    if not re.match(r"2\.9(\D|$)", version):
        raise EmitError(
            f"this is LinuxCNC {version}; the HAL was played with {MEASURED} only",
            f"use --controller linuxcnc, or say --linuxcnc-version {MEASURED} to try it",
        )


def _change(ini: Ini, form: str) -> Change:
    """What would be written into a configuration without ours."""
    check_motion(ini)
    hal = read_hal(ini, HAL_FILE)
    _check_hal(ini, hal, form)
    script_path = _script_path(ini)
    if form == hal_files.GUARD:
        return _guard(ini, hal, script_path)
    quoted = str(script_path.resolve() if script_path.is_absolute() else script_path.absolute())
    if any(c in quoted for c in " \t'\"#$[]"):
        raise EmitError(f"HAL cannot take the name {quoted}", "use a folder without blanks")
    if form == "adaptive-feed":
        text = hal_files.adaptive_feed(quoted)
    else:
        behind, joints = _joints(ini, hal)
        text = hal_files.position(quoted, joints, _period(ini), behind)
    last = ini.all("HAL", "HALFILE")[-1]
    places = [(last.line, f"HALFILE = {HAL_FILE}")]
    if ini.value("RS274NGC", "USER_M_PATH") is None:
        sections = dict(ini.sections)
        if "RS274NGC" not in sections:
            raise EmitError("there is no section [RS274NGC]", "add it", ini.place())
        places.append((sections["RS274NGC"], f"USER_M_PATH = {script_path.parent.absolute()}"))
    data = ini.data
    for line, entry in sorted(places, reverse=True):
        data = Ini(ini.path, data, (), ()).with_lines(line, entry)
    return Change(data, _headed(text, form), _script(), script_path)


def _headed(text: str, form: str) -> bytes:
    """A HAL file with the line that says what it is, and its sum."""
    body = text.encode()
    return f"# gcodejerk install {form} sum:{_sum(body).decode()}\n".encode() + body


def _guard(ini: Ini, hal: Hal, script_path: Path) -> Change:
    """What would be written for the override guard."""
    halui = ini.value("HAL", "HALUI")
    if halui is not None and Path(halui.split()[0] if halui else "").name != "halui":
        raise EmitError(
            f"[HAL] HALUI is {halui!r}, and the guard reads the overrides from halui",
            "say HALUI = halui",
            ini.place(ini.all("HAL", "HALUI")[0].line),
        )
    text = hal_files.guard({pin: signal for pin, (signal, _) in hal.signal.items()})
    lines = f"HALFILE = {HAL_FILE}" if halui is not None else f"HALUI = halui\nHALFILE = {HAL_FILE}"
    data = ini.with_lines(ini.all("HAL", "HALFILE")[-1].line, lines)
    return Change(data, _headed(text, hal_files.GUARD), None, script_path)


def _check_hal(ini: Ini, hal: Hal, form: str) -> None:
    """Refuse HAL files that use what we need."""
    for component in dict.fromkeys(hal_files.components(form)):
        if component in hal.loaded:
            what = "it has one FIFO" if component == "streamer" else "HAL loads it once"
            raise EmitError(
                f"the component {component} is loaded here, and {HAL_FILE} loads it, too: {what}",
                "use another component here (logic or lut5, mux8 ...), or another --form",
                hal.loaded[component],
            )
    for pin in hal_files.TAKEN[form]:
        if pin in hal.signal:
            signal, place = hal.signal[pin]
            raise EmitError(
                f"{pin} is linked to the signal {signal} here, and {HAL_FILE} needs it",
                "take it off here; what both have to do with it can be joined by hand",
                place,
            )
    if "motmod" not in hal.loaded:
        raise EmitError("no HAL file loads motmod", "see LinuxCNC's manual", ini.place())
    for name in ("num_aio",) if form == hal_files.GUARD else ("num_dio", "num_aio"):
        match = re.search(rf"{name}=(\S+)", hal.arguments["motmod"])
        if match is not None and not (match[1].isdigit() and int(match[1]) >= _LEAST_IO):
            raise EmitError(
                f"motmod is loaded with {name}={match[1]}, and number 3 of them is needed",
                f"say {name}={_LEAST_IO} or more, or leave it out",
                hal.loaded["motmod"],
            )
    if "motion-controller" not in hal.functions.get("servo-thread", []):
        raise EmitError(
            "motion-controller is in no thread servo-thread of these HAL files",
            "see LinuxCNC's manual",
            ini.place(),
        )


def _joints(ini: Ini, hal: Hal) -> tuple[int, list[hal_files.Joint]]:
    """Place of motion-controller in the thread, and the joints of X, Y and Z."""
    if hal.unclear is not None:
        raise EmitError(
            "a function is put in a place of the thread that depends on others",
            "give addf no place, or one counted from the front",
            hal.unclear,
        )
    kinematics = (ini.value("KINS", "KINEMATICS") or "").split()
    if not kinematics or kinematics[0] != "trivkins":
        raise EmitError(
            f"KINEMATICS is {' '.join(kinematics) or 'missing'}: the drives get positions of axes, "
            "so each axis has to have a joint of its own (trivkins)",
            "use --form adaptive-feed",
            ini.place(),
        )
    named = [word[12:] for word in kinematics[1:] if word.lower().startswith("coordinates=")]
    letters = (named or [ini.value("TRAJ", "COORDINATES") or ""])[0].upper().replace(" ", "")
    out = []
    for letter in "XYZ":
        if letters.count(letter) > 1:
            raise EmitError(
                f"axis {letter} has two joints ({letters}), which are moved alike and homed apart",
                "use --form adaptive-feed",
                ini.place(),
            )
        if letter not in letters:
            continue
        joint = letters.index(letter)
        _check_uncompensated(ini, joint)
        _check_no_offset(ini, letter)
        signals = []
        for pin in (f"joint.{joint}.motor-pos-cmd", f"joint.{joint}.motor-pos-fb"):
            if pin not in hal.signal:
                raise EmitError(
                    f"{pin} is linked to no signal in these HAL files",
                    f"link it: net {letter.lower()}-pos {pin} => ...",
                    ini.place(),
                )
            signals.append(hal.signal[pin][0])
        out.append(hal_files.Joint(joint, letter, *signals))
    if len(out) < 2:
        raise EmitError(f"there are no axes X, Y or Z in {letters!r}", None, ini.place())
    return hal.functions["servo-thread"].index("motion-controller") + 1, out


def _check_uncompensated(ini: Ini, joint: int) -> None:
    """Refuse a joint whose motor LinuxCNC itself leads elsewhere than its axis says."""
    for key in ("BACKLASH", "COMP_FILE"):
        for entry in ini.all(f"JOINT_{joint}", key):
            if _ZERO.fullmatch(entry.value.split("#")[0].strip()):
                continue
            raise EmitError(
                f"[JOINT_{joint}] {key} is {entry.value}: what LinuxCNC adds to the motor's "
                "position is not in the samples, and the machine would switch off behind a rapid",
                "use --form adaptive-feed, in which LinuxCNC compensates as ever",
                ini.place(entry.line),
            )


def _check_no_offset(ini: Ini, letter: str) -> None:
    """Refuse an axis that something else may move while a rapid is played."""
    for entry in ini.all(f"AXIS_{letter}", "OFFSET_AV_RATIO"):
        if not _ZERO.fullmatch(entry.value.split("#")[0].strip()):
            raise EmitError(
                f"[AXIS_{letter}] OFFSET_AV_RATIO is {entry.value}: an external offset that "
                "changes while a rapid is played is not in the samples, and the machine would "
                "switch off behind it",
                "use --form adaptive-feed, in which LinuxCNC adds it as ever",
                ini.place(entry.line),
            )


def _period(ini: Ini) -> float:
    """Of the servo thread [s]."""
    text = ini.value("EMCMOT", "SERVO_PERIOD") or ""
    if not text.isdigit() or not 50_000 <= int(text) <= 10_000_000:
        raise EmitError(
            f"[EMCMOT] SERVO_PERIOD is {text or 'missing'}", "say it in ns: 1000000", ini.place()
        )
    base = ini.value("EMCMOT", "BASE_PERIOD") or "0"
    if base.isdigit() and int(base) and int(text) % int(base):
        raise EmitError(
            f"SERVO_PERIOD {text} is no multiple of BASE_PERIOD {base}: the servo thread then runs "
            f"every {int(text) // int(base) * int(base)} ns",
            "make it a multiple, and set interval of the machine file alike",
            Place(str(ini.path)),
        )
    return int(text) * 1e-9


def _script() -> bytes:
    return (hal_files.HERE / hal_files.SCRIPT).read_bytes()


def _script_path(ini: Ini) -> Path:
    """Where the M code goes: the first folder of M codes, or beside the INI."""
    named = (ini.value("RS274NGC", "USER_M_PATH") or "").split(":")[0].strip()
    folder = (ini.folder / Path(named).expanduser()) if named else ini.folder
    if not folder.is_dir():
        raise EmitError(
            f"[RS274NGC] USER_M_PATH names {named}, which is no folder", "correct it", ini.place()
        )
    return folder / hal_files.SCRIPT


def _sum(data: bytes) -> bytes:
    return hashlib.blake2b(data, digest_size=8).hexdigest().encode()

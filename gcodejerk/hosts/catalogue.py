"""Every host that gcodejerk can be installed into, and what its installation needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gcodejerk.hosts.command import machine_word, own_command
from gcodejerk.hosts.freecad.install import install_post, remove_post
from gcodejerk.hosts.linuxcnc import filter_lines, hal_files
from gcodejerk.hosts.linuxcnc.install import install as install_hal
from gcodejerk.hosts.linuxcnc.install import remove as remove_hal
from gcodejerk.hosts.slicers import SLICERS, slicer_lines
from gcodejerk.hosts.texts import TEXTS, WATCHED, folder_lines, remove_text, text_lines

_FORMS = (*hal_files.FORMS, hal_files.GUARD, filter_lines.FORM)


@dataclass(frozen=True, slots=True)
class Request:
    """What the user asks for."""

    host: str
    where: str | None = None
    machine: str | None = None
    form: str | None = None
    base: str | None = None
    remove: bool = False
    linuxcnc_version: str | None = None

    def problem(self) -> str | None:
        """What is wrong with the words of the command, None where nothing is."""
        takes = HOSTS[self.host].takes
        if self.remove:
            for option, value in (("--machine", self.machine), ("--base", self.base)):
                if value is not None:
                    return f"--remove takes out what is there: leave {option} out"
        if self.host == "linuxcnc":
            return self._linuxcnc_problem()
        if self.form is not None or self.linuxcnc_version is not None:
            return "--form and --linuxcnc-version are for linuxcnc"
        if self.base is not None and "base" not in takes:
            return "--base is for freecad"
        if self.where is not None and "where" not in takes:
            return f"{self.host}: there is no file to put into {self.where}, leave it out"
        if self.remove and "remove" not in takes:
            return f"{self.host}: nothing was installed; take the line out of its settings"
        if self.remove and self.host in TEXTS and self.where is None:
            return f"{self.host}: name the folder that it was put into"
        if self.machine is None and not self.remove:
            return f"{self.host}: name the machine file with --machine"
        return None

    def _linuxcnc_problem(self) -> str | None:
        """The same for LinuxCNC."""
        if self.where is None:
            return "linuxcnc: name the configuration's .ini file"
        if self.base is not None:
            return "--base is not for the host linuxcnc"
        if self.form is not None and self.form not in _FORMS:
            return f"--form {self.form}: choose one of {', '.join(_FORMS)}"
        if self.linuxcnc_version is not None and (self.remove or self.form == filter_lines.FORM):
            return "--linuxcnc-version is for putting HAL in: leave --linuxcnc-version out"
        if self.form == filter_lines.FORM:
            if self.machine is None and not self.remove:
                return "--form filter: name the machine file with --machine"
            return None
        if self.machine is not None:
            return "--machine is for --form filter: the HAL files know no machine"
        if self.remove and self.form is not None:
            return "--remove takes out whichever form of HAL is there: leave --form out"
        return None


@dataclass(frozen=True, slots=True)
class Host:
    """One host."""

    does: str
    """What is installed, in a line."""
    tested: str
    takes: frozenset[str]
    """Of `where`, `machine`, `base`, `remove`."""
    install: Callable[[Request], list[str]]
    """What was done, or what to do, for the user."""


def host_lines() -> list[str]:
    """One line for each host."""
    width = max(map(len, HOSTS))
    lines = [f"{name:{width}}  {host.does} [{host.tested}]" for name, host in HOSTS.items()]
    return [*lines, "`gcodejerk install HOST ...`; docs/hosts.md says more"]


def _linuxcnc(request: Request) -> list[str]:
    """LinuxCNC: HAL, or lines of [FILTER]."""
    assert request.where is not None
    if request.form == filter_lines.FORM:
        if request.remove:
            return filter_lines.remove_filter(request.where)
        assert request.machine is not None
        machine = machine_word(request.machine)
        return filter_lines.install_filter(request.where, own_command(), machine)
    if request.remove:
        return remove_hal(request.where)
    return install_hal(request.where, request.form or hal_files.FORMS[0], request.linuxcnc_version)


def _freecad(request: Request) -> list[str]:
    """FreeCAD: a post-processor."""
    if request.remove:
        return remove_post(request.where)
    assert request.machine is not None
    machine = machine_word(request.machine)
    return install_post(request.where, own_command(), machine, request.base or "linuxcnc")


def _slicer(request: Request) -> list[str]:
    """A slicer: a line to paste."""
    assert request.machine is not None
    return slicer_lines(request.host, own_command(), machine_word(request.machine))


def _text(request: Request) -> list[str]:
    """A host that takes a file."""
    if request.remove:
        assert request.where is not None
        return remove_text(request.host, request.where)
    assert request.machine is not None
    machine = machine_word(request.machine)
    return text_lines(request.host, request.where, own_command(), machine)


def _watched(request: Request) -> list[str]:
    """A host that only opens files."""
    assert request.machine is not None
    return folder_lines(request.host, own_command(), machine_word(request.machine))


HOSTS: dict[str, Host] = {
    "linuxcnc": Host(
        "HAL that plays rapids, an override guard, or the screens' [FILTER], into an INI",
        "tested with LinuxCNC 2.9",
        frozenset({"where", "machine", "remove"}),
        _linuxcnc,
    ),
    "freecad": Host(
        "a post-processor: any stock one, then the rapids; into the macro directory",
        "tested with FreeCAD 0.20.2; the class for 1.0 with a stand-in",
        frozenset({"where", "machine", "base", "remove"}),
        _freecad,
    ),
    "prusaslicer": Host(
        "the line for its post-processing scripts",
        "tested with PrusaSlicer 2.5.0",
        frozenset({"machine"}),
        _slicer,
    ),
    **{
        name: Host(
            "the line for its post-processing scripts",
            "untested; it calls scripts as PrusaSlicer does",
            frozenset({"machine"}),
            _slicer,
        )
        for name in SLICERS
        if name != "prusaslicer"
    },
    **{
        name: Host(what, "untested", frozenset({"where", "machine", "remove"}), _text)
        for name, what in {
            "cura": "a post-processing script",
            "fusion360": "lines for the end of a post (.cps)",
            "mastercam": "a batch file to drop programs onto",
            "solidcam": "a batch file to drop programs onto",
            "vectric": "a batch file, and the line of the post that calls it",
            "octoprint": "a plugin, one file: programs are processed when they are uploaded",
            "bcnc": "a plugin, one file: a button for the program that is open",
        }.items()
    },
    **{
        name: Host(
            "the command that fills the folder it opens from",
            "steps",
            frozenset({"machine"}),
            _watched,
        )
        for name in WATCHED
    },
}
ALIASES = {"fusion": "fusion360"}
"""Other names that hosts go by."""
assert set(TEXTS) | set(WATCHED) | set(SLICERS) < set(HOSTS)

"""Every host that gcodejerk can be installed into, and what its installation needs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gcodejerk.hosts.command import machine_word, own_command
from gcodejerk.hosts.freecad.install import install_post, remove_post
from gcodejerk.hosts.linuxcnc import filter_lines, hal_files
from gcodejerk.hosts.linuxcnc.install import install as install_hal
from gcodejerk.hosts.linuxcnc.install import remove as remove_hal

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
        host = HOSTS[self.host]
        if self.host == "linuxcnc":
            return self._linuxcnc_problem()
        for name, given in (
            ("--form", self.form),
            ("--linuxcnc-version", self.linuxcnc_version),
            ("--base", None if "base" in host.takes else self.base),
            ("WHERE", None if "where" in host.takes else self.where),
            ("--remove", (None, "")["remove" not in host.takes and self.remove]),
        ):
            if given is not None:
                return f"{name} is not for the host {self.host}"
        if "where!" in host.takes and self.where is None:
            return f"{self.host}: name the folder, `gcodejerk install {self.host} DIR`"
        if self.machine is None and not self.remove and "machine" in host.takes:
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
    """Of `where`, `where!` (has to be said), `machine`, `base`, `remove`."""
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
}

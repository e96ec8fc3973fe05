"""FreeCAD: post with a stock post-processor, then rewrite the rapids of its program with gcodejerk.

This file is put into FreeCAD's macro directory by `gcodejerk install freecad`; it is then a
post-processor `gcodejerk`. FreeCAD 0.20 and 0.21 call `export`, FreeCAD 1.0 and later the class
`Gcodejerk`.

Rule 1: gcodejerk runs in its own Python, as a command. Nothing of it is imported here, and
FreeCAD's `sys.executable` is no Python.
Rule 2: whatever fails is raised, so that FreeCAD shows it, and nothing is written.
Rule 3: the program is bytes. Nothing changes its line ends, so that its stamp holds.

The file keeps to Python 3.8, which some builds of FreeCAD have inside.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from typing import Any

# Between the marks: what `gcodejerk install freecad` knew.
# gcodejerk begin
COMMAND: list[str] = []
MACHINE = ""
BASE = "linuxcnc"
# gcodejerk end

TOOLTIP = "Posts with a stock post-processor, then rewrites the rapids with gcodejerk."
TOOLTIP_ARGS = f"""Arguments (all others go to the stock post-processor):
--base NAME          the stock post-processor: linuxcnc, grbl, fanuc, mach3_mach4 ... ({BASE})
--machine FILE       machine file of gcodejerk, or the name of a shipped machine ({MACHINE})
--exe PATH           the command gcodejerk, where another one is meant than the one installed
--jerk-options TEXT  options of `gcodejerk process`, for example '--expand-cycles'
"""
UNITS = "G21"
HIDDEN = ("PYTHONHOME", "PYTHONPATH", "PYTHONSTARTUP", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH")
"""Variables by which FreeCAD's bundles find their own libraries, and other programs do not."""
HOMES = (
    "Path.Post.scripts.{}_post",
    "PathScripts.post.{}_post",
    "Path.Post.scripts.{}_legacy_post",
)
"""Stock post-processors where no search path tells: of 0.21 on, of 0.20, and functions of 1.1."""


class GcodejerkPostError(Exception):
    """Posting failed; nothing was written."""


class Options:
    """Our arguments, and those of the stock post-processor."""

    def __init__(self, text: str | None) -> None:
        ours = {"--base": "", "--machine": "", "--exe": "", "--jerk-options": ""}
        rest = []
        words = iter(shlex.split(text or ""))
        for word in words:
            name, equals, value = word.partition("=")
            if name not in ours:
                rest.append(word)
            elif equals:
                ours[name] = value
            else:
                ours[name] = next(words, "")
            if name in ours and not ours[name]:
                raise GcodejerkPostError(f"the post-processor's argument {name} has no value")
        self.base = ours["--base"] or BASE
        self.machine = ours["--machine"] or os.environ.get("GCODEJERK_MACHINE", "") or MACHINE
        self.exe = ours["--exe"]
        self.options = shlex.split(ours["--jerk-options"])
        self.rest = " ".join(shlex.quote(word) for word in rest)
        if self.base == "gcodejerk":
            raise GcodejerkPostError("--base names the post-processor in front of gcodejerk")

    def command(self) -> list[str]:
        """The words that start gcodejerk."""
        named = self.exe or os.environ.get("GCODEJERK", "")
        words = [os.path.expanduser(named)] if named else list(COMMAND)
        if not words:
            found = shutil.which("gcodejerk")
            words = [found] if found else []
        if not words or shutil.which(words[0]) is None:
            raise GcodejerkPostError(
                f"gcodejerk was not found{f' at {words[0]}' if words else ''}: install it, run "
                "`gcodejerk install freecad` anew, or name it: --exe /path/of/gcodejerk"
            )
        return words


def export(objectslist: list[Any], filename: str, argstring: str) -> str:
    """FreeCAD 0.20 and 0.21: post some objects to a file.

    Parameters
    ----------
    objectslist : list
        FreeCAD's: fixtures, tool controllers, operations.
    filename : str
        Where the program goes; "-" writes none (1.0 writes what is returned).
    argstring : str
        The job's arguments for the post-processor.

    Returns
    -------
    str
        The program.
    """
    options = Options(argstring)
    post = _function(options.base)
    with tempfile.TemporaryDirectory(prefix="gcodejerk-") as folder:
        # A real file: some stock post-processors take no "-".
        raw = os.path.join(folder, _name(filename))
        returned = post(objectslist, raw, options.rest)
        if os.path.isfile(raw):
            with open(raw, "rb") as file:
                data = file.read()
            # Some write the file's name into the program.
            for now, then in ((raw, filename), (raw.upper(), filename.upper())):
                data = data.replace(os.fsencode(now), os.fsencode(then))
        elif isinstance(returned, str):
            data = returned.encode("utf-8")
        else:
            raise GcodejerkPostError(f"the post-processor {options.base} has written no program")
    program = rewritten(data, options, _name(filename))
    if filename != "-":
        _write(filename, program)
    return program.decode("utf-8", "surrogateescape")


def rewritten(data: bytes, options: Options, name: str) -> bytes:
    """A program, rewritten by gcodejerk.

    Parameters
    ----------
    data : bytes
        As the stock post-processor wrote it.
    options : Options
        Which gcodejerk, and which machine.
    name : str
        What messages call the program.

    Returns
    -------
    bytes
        The output, proven by gcodejerk.
    """
    if not data.strip():
        raise GcodejerkPostError(f"the post-processor {options.base} has written an empty program")
    if not options.machine:
        raise GcodejerkPostError("no machine file: say --machine FILE in the job's arguments")
    machine = os.path.expanduser(options.machine)
    with tempfile.TemporaryDirectory(prefix="gcodejerk-") as folder:
        raw, out = os.path.join(folder, name), os.path.join(folder, "out-" + name)
        with open(raw, "wb") as file:
            file.write(data)
        words = [*options.command(), "process", "--machine", machine, *options.options]
        environment = {key: value for key, value in os.environ.items() if key not in HIDDEN}
        environment["PYTHONIOENCODING"] = "utf-8"
        try:
            done = subprocess.run(
                [*words, "-o", out, "--", raw],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env=environment,
                check=False,
                # No window of its own on Windows.
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as error:
            raise GcodejerkPostError(f"{words[0]} cannot be started: {error}") from error
        said = done.stdout.decode("utf-8", "replace").strip()
        said = said.replace(f" -> {out}", "").replace(folder + os.sep, "")
        if done.returncode != 0 or not os.path.isfile(out):
            raise GcodejerkPostError(
                f"gcodejerk refused the program (exit status {done.returncode}), nothing was "
                f"written:\n{said}"
            )
        with open(out, "rb") as file:
            program = file.read()
    _say(said)
    return program


def _function(base: str) -> Any:
    """The function `export` of a post-processor, a stock one or one of the user's, loaded anew."""
    for folder in _search_paths():
        path = os.path.join(folder, f"{base}_post.py")
        spec = importlib.util.spec_from_file_location(f"{base}_post", path)
        if not os.path.isfile(path) or spec is None or spec.loader is None:
            continue
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        if hasattr(module, "export"):
            return module.export
    for home in HOMES:
        try:
            module = importlib.import_module(home.format(base))
        except ImportError:
            continue
        if hasattr(module, "export"):
            return module.export
    raise GcodejerkPostError(
        f"there is no post-processor {base} with a function `export`; --base names one of "
        "FreeCAD's, or NAME_post.py in the macro directory"
    )


def _search_paths() -> list[str]:
    """Where FreeCAD looks for post-processors."""
    for name in ("Path.Preferences", "PathScripts.PathPreferences"):
        try:
            return list(importlib.import_module(name).searchPathsPost())
        except (ImportError, AttributeError):
            continue
    return [os.path.dirname(os.path.abspath(__file__))]


def _name(filename: str) -> str:
    """A name for a program's copies."""
    return os.path.basename(filename) if filename not in ("", "-") else "program.ngc"


def _write(filename: str, program: bytes) -> None:
    """Write the program in one move: an old one stays until the new one is complete."""
    place = os.path.realpath(filename)
    temporary = place + ".gcodejerk"
    try:
        with open(temporary, "wb") as file:
            file.write(program)
        os.replace(temporary, place)
    except OSError as error:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise GcodejerkPostError(f"{filename} cannot be written: {error}") from error


def _say(text: str) -> None:
    """Show what gcodejerk said, in FreeCAD's report view."""
    try:
        console = importlib.import_module("FreeCAD").Console
    except (ImportError, AttributeError):
        print(text, file=sys.stderr)  # noqa: T201
        return
    console.PrintMessage(text + "\n")


def _base_class() -> Any:
    """FreeCAD's class of post-processors, where it has one (1.0)."""
    try:
        return importlib.import_module("Path.Post.Processor").PostProcessor
    except (ImportError, AttributeError):
        return object


class Gcodejerk(_base_class()):  # type: ignore[misc]
    """FreeCAD 1.0 and later: the post-processor as a class."""

    def __init__(self, job: Any, *args: Any, **kwargs: Any) -> None:
        super().__init__(job, TOOLTIP, TOOLTIP_ARGS, "Metric", *args, **kwargs)
        self._given = job

    @property
    def tooltip(self) -> str:
        """What the list of post-processors shows."""
        return TOOLTIP

    @property
    def tooltipArgs(self) -> str:  # noqa: N802
        """What the field of arguments shows."""
        return TOOLTIP_ARGS

    def export(self) -> list[tuple[str, str | None]]:
        """Post the job with the stock post-processor, and rewrite each section of it.

        Returns
        -------
        list of (str, str or None)
            Name and program of each section; FreeCAD writes the files.
        """
        job = self._given
        if isinstance(job, dict):  # development versions: selected operations
            job = job["job"]
        elif isinstance(job, (list, tuple)):
            job = job[0]
        given = job.PostProcessorArgs
        options = Options(given)
        factory = importlib.import_module("Path.Post.Processor").PostProcessorFactory
        # The stock post-processor reads its arguments from the job.
        job.PostProcessorArgs = options.rest
        try:
            post = factory.get_post_processor(self._given, options.base)
            if not hasattr(post, "export"):
                raise GcodejerkPostError(f"FreeCAD has no post-processor {options.base}")
            sections = post.export()
        finally:
            job.PostProcessorArgs = given
        if not sections:
            raise GcodejerkPostError(f"the post-processor {options.base} has written nothing")
        return [(part, _section(part, text, options)) for part, text in sections]


def _section(part: str, text: str | None, options: Options) -> str | None:
    """One section, rewritten; None stays None: no file is wanted."""
    if text is None:
        return None
    data = text[2:] if text.startswith("\n\n") else text
    name = "".join(c if c.isalnum() or c in "-_" else "_" for c in str(part)) or "program"
    program = rewritten(data.encode("utf-8"), options, name + ".ngc")
    # By two empty lines in front FreeCAD knows that line ends are to stay, and takes them away.
    return "\n\n" + program.decode("utf-8")

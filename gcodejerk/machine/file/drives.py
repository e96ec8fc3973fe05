"""Drives and structures between a machine file and the classes of `machine.drives`.

Rule: here stands what involves several keys of one servo or one structure; what a single key may
hold is `drive_keys`'. What is wrong is collected with its place, as everywhere in a machine file.
"""

from __future__ import annotations

import hashlib
import zipfile
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from gcodejerk.machine.drives import (
    GROUND,
    Body,
    Friction,
    Joint,
    Matrices,
    Screw,
    Servo,
    Structure,
    Vector,
)
from gcodejerk.machine.file.checker import Checker, KeyPath, dotted

PER_KV = 1000.0 / 60.0
"""1/s of one m/min/mm."""
STRIBECK = 2.0
"""mm/s, where the file does not say."""
SYMMETRIC = 1e-9
"""What a matrix may be away from its mirror image, of its largest entry."""
WHOLE = ("bodies", "joints", "screws", "damping", "tool", "workpiece", "at")


def servo_of(values: dict[str, Any]) -> Servo | None:
    """The servo of an axis, of values that were checked."""
    if not _stated(values):
        return None
    own = {field.name for field in fields(Servo)} - {"kpp", "friction"}
    given = {name: value for name, value in values.items() if name in own}
    kpp = values["kpp"] if "kpp" in values else PER_KV * values["kv"]
    return Servo(kpp=kpp, friction=_friction(values.get("friction", {})), **given)


def _stated(servo: dict[str, Any]) -> bool:
    """Whether the file has this servo: one that is left out has empty sections."""
    return "velocity_bandwidth" in servo


def _friction(values: dict[str, Any]) -> Friction | None:
    if not values:
        return None
    static = values.get("static", values["coulomb"])
    more = {"at": values["at"]} if "at" in values else {}
    return Friction(values["coulomb"], static, values.get("stribeck", STRIBECK), **more)


def check_servos(values: dict[str, Any], checker: Checker) -> None:
    """Refuse servos that contradict themselves or their axis."""
    for name, axis in values.get("axes", {}).items():
        servo = axis.get("servo", {})
        path: KeyPath = ("axes", name, "servo")
        if not checker.given(path):
            continue
        if name in checker.rotary:
            checker.problems.add(
                checker.place(path),
                f"{dotted(path)} is given, but {name} is a rotary axis: servos here turn screws",
                "leave servo out; the axis is then where it is told to be",
            )
        if ("kpp" in servo) == ("kv" in servo):
            both = "both kpp and kv" if "kpp" in servo else "neither kpp nor kv"
            checker.problems.add(
                checker.place(path), f"{dotted(path)} has {both}, expected one of them",
                "kpp: 40 [1/s] or kv: 2.4 [m/min/mm]",
            )  # fmt: skip
        friction = servo.get("friction", {})
        if friction.get("static", np.inf) < friction.get("coulomb", 0.0):
            checker.problems.add(
                checker.place((*path, "friction", "static")),
                f"{dotted((*path, 'friction', 'static'))} is {friction['static']:g}, expected at "
                f"least coulomb, {friction['coulomb']:g} [N]",
                "an axis breaks away at its static friction, which is the larger",
            )


def structure_of(
    values: dict[str, Any], axes: dict[str, Any], folder: Path, checker: Checker
) -> Structure | None:
    """The structure of a machine, or None where the file has none or it is wrong.

    Parameters
    ----------
    values : dict
        Of the key `structure`.
    axes : dict
        Of the key `axes`.
    folder : Path
        Where the name of a file begins.
    checker : Checker
        Takes what is wrong.

    Returns
    -------
    Structure or None
    """
    path: KeyPath = ("structure",)
    if not values:
        return None
    if "file" in values:
        return _of_file(values, axes, folder, checker)
    missing = [name for name in ("bodies", "tool", "workpiece", "at") if not values.get(name)]
    if missing:
        _tell(checker, path, f"has no {missing[0]}", f"add {missing[0]}, or file")
    bodies = values.get("bodies", {})
    names = _checked_bodies(bodies, path, checker)
    _check_names(values, path, [*names, GROUND], checker)
    screws = [screw.get("axis") for screw in values.get("screws", {}).values()]
    _require_servos([axis for axis in screws if axis], axes, checker)
    if checker.problems.found or missing:
        return None
    return Structure(
        tuple(_body(body) for body in bodies.values()),
        tuple(_joint(joint) for joint in values.get("joints", {}).values()),
        tuple(
            Screw(s["axis"], s["moves"], s["carried_by"], _vector(s["at"]))
            for s in values.get("screws", {}).values()
        ),
        values.get("damping", 0.0), values["tool"], values["workpiece"], _vector(values["at"]),
    )  # fmt: skip


def _tell(checker: Checker, path: KeyPath, what: str, remedy: str) -> None:
    checker.problems.add(checker.place(path), f"{dotted(path)} {what}", remedy)


def _check_names(values: dict[str, Any], path: KeyPath, known: list[Any], checker: Checker) -> None:
    """Refuse names of bodies that there are not."""
    said: list[tuple[KeyPath, Any]] = [
        ((*path, key), values.get(key)) for key in ("tool", "workpiece")
    ]
    for i, joint in values.get("joints", {}).items():
        said += [
            ((*path, "joints", i, "between", k), n) for k, n in joint.get("between", {}).items()
        ]
    for i, screw in values.get("screws", {}).items():
        said += [((*path, "screws", i, key), screw.get(key)) for key in ("moves", "carried_by")]
    for where, name in said:
        if name is not None and name not in known:
            bodies = ", ".join(map(str, known))
            _tell(checker, where, f"is {name!r}, which is no body", f"the bodies are {bodies}")


def _require_servos(moved: list[str], axes: dict[str, Any], checker: Checker) -> None:
    """Refuse screws that nothing turns, and servos that turn no screw."""
    for axis in moved:
        if not _stated(axes.get(axis, {}).get("servo", {})):
            _tell(
                checker, ("structure",), f"moves a body along {axis}, which has no servo",
                f"add axes.{axis}.servo",
            )  # fmt: skip
    for axis, values in axes.items():
        if _stated(values.get("servo", {})) and axis not in moved:
            _tell(
                checker, ("axes", axis, "servo"), "turns no screw of the structure",
                "add it to structure.screws, or leave servo out",
            )  # fmt: skip


def _vector(values: dict[int, float]) -> Vector:
    x, y, z = values.values()
    return x, y, z


def _body(values: dict[str, Any]) -> Body:
    if "inertia" in values:
        inertia = _vector(values["inertia"])
    else:
        a, b, c = (1e-3 * x for x in values["size"].values())
        twelfth = values["mass"] / 12.0
        inertia = (twelfth * (b * b + c * c), twelfth * (a * a + c * c), twelfth * (a * a + b * b))
    return Body(values["name"], values["mass"], inertia, _vector(values["at"]))


def _joint(values: dict[str, Any]) -> Joint:
    first, second = values["between"].values()
    damping = {"damping": _vector(values["damping"])} if "damping" in values else {}
    points = tuple(_vector(point) for point in values["points"].values())
    return Joint((first, second), points, _vector(values["stiffness"]), **damping)


def _load(name: str, folder: Path, checker: Checker) -> Matrices | None:
    """Matrices of a file, or None after telling what is wrong with it."""
    path: KeyPath = ("structure", "file")
    try:
        with np.load(folder / name, allow_pickle=False) as file:
            found = {key: np.asarray(file[key], dtype=float) for key in file.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        why = getattr(error, "strerror", None) or "it is no .npz file of numbers"
        _tell(checker, path, f"is {name!r}: {why}", "numpy.savez(FILE, M=..., K=..., nut_X=...)")
        return None
    wrong = _wrong_matrices(found)
    if wrong:
        _tell(checker, path, f"is {name!r}: {wrong}", "see docs/simulate.md")
        return None
    count = len(found["M"])

    def rows(prefix: str) -> tuple[tuple[str, tuple[float, ...]], ...]:
        return tuple(
            (key[-1], tuple(found[key].tolist())) for key in sorted(found) if key.startswith(prefix)
        )

    square = {key: found.get(key, np.zeros((count, count))) for key in ("M", "K", "C")}
    M, K, C = (tuple(map(tuple, square[key].tolist())) for key in ("M", "K", "C"))
    return Matrices(name, M, K, C, rows("nut_"), rows("tool_"))


def _of_file(
    values: dict[str, Any], axes: dict[str, Any], folder: Path, checker: Checker
) -> Structure | None:
    """A structure whose matrices stand in a file."""
    for name in WHOLE:
        if name in values:
            _tell(checker, ("structure", name), "stands beside structure.file", "keep one of them")
    matrices = _load(values["file"], folder, checker)
    if matrices is None:
        return None
    _require_servos([axis for axis, _ in matrices.nut], axes, checker)
    return Structure(matrices=matrices)


def _checked_bodies(bodies: dict[int, Any], path: KeyPath, checker: Checker) -> list[Any]:
    """The names of the bodies; each is one body's, and each body's inertia is told once."""
    names = [body.get("name") for body in bodies.values()]
    for i, name in enumerate(names):
        if name == GROUND or name in names[:i]:
            what = "the ground's" if name == GROUND else "that of another body, too"
            _tell(checker, (*path, "bodies", i, "name"), f"{name!r} is {what}", "choose another")
        if ("size" in bodies[i]) == ("inertia" in bodies[i]):
            _tell(
                checker, (*path, "bodies", i), "needs size or inertia, one of them",
                "size: [600, 500, 1300] is that of a box of the same inertia [mm]",
            )  # fmt: skip
    return names


# Complex: one thing that can be wrong behind another.
def _wrong_matrices(found: dict[str, Any]) -> str:
    """What is wrong with the arrays of a file; empty where nothing is."""
    for key in ("M", "K"):
        if key not in found:
            return f"it has no {key}"
    count = len(found["M"]) if found["M"].ndim == 2 else -1
    for key, value in found.items():
        vector = key[:-1] in ("nut_", "tool_") and key[-1] in "XYZ"
        if not vector and key not in ("M", "K", "C"):
            return f"{key} is not one of M, K, C, nut_X.. or tool_X.."
        if value.shape != ((count,) if vector else (count, count)):
            return f"{key} has the shape {value.shape}, expected as M, which has {found['M'].shape}"
        if not np.isfinite(value).all():
            return f"{key} holds what is no number"
        if not vector and not _is_symmetric(value):
            return f"{key} is not symmetric"
    if count < 1 or np.linalg.eigvalsh(found["M"]).min() <= 0.0:
        return "M is not positive definite"
    nuts = {key[-1] for key in found if key.startswith("nut_")}
    if nuts != {key[-1] for key in found if key.startswith("tool_")} or not nuts:
        return "every axis needs both nut_ and tool_"
    return ""


def _is_symmetric(matrix: Any) -> bool:
    return bool(np.abs(matrix - matrix.T).max(initial=0.0) <= SYMMETRIC * np.abs(matrix).max())


def digest(structure: Structure) -> Structure:
    """The same with what is in its file in place of the file's name."""
    matrices = structure.matrices
    if matrices is None:
        return structure
    what = (
        matrices.mass, matrices.stiffness, matrices.damping, matrices.nut, matrices.tool,
    )  # fmt: skip
    name = hashlib.sha256(repr(what).encode()).hexdigest()
    return replace(structure, matrices=replace(matrices, source=name))

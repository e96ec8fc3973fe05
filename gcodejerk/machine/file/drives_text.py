"""Drives and structures as lines of a machine file; the writer puts them in their place."""

from __future__ import annotations

from dataclasses import fields

from gcodejerk.machine.drives import Body, Friction, Joint, Screw, Servo, Structure, Vector
from gcodejerk.machine.file.scalar_text import braces, number_text, quoted


def servo_text(servo: Servo | None) -> list[str]:
    """Lines of the key `servo` of an axis; none where there is none."""
    if servo is None:
        return []
    values = {field.name: getattr(servo, field.name) for field in fields(Servo)}
    texts = {
        name: value if isinstance(value, str) else number_text(value)
        for name, value in values.items()
        if not isinstance(value, Friction | None)
    }
    if servo.friction is not None:
        texts["friction"] = _friction(servo.friction)
    return [f"    servo: {braces(texts)}"]


def _friction(friction: Friction) -> str:
    values = {name: getattr(friction, name) for name in ("coulomb", "static", "stribeck")}
    return braces({k: number_text(x) for k, x in values.items()} | {"at": friction.at})


def structure_text(structure: Structure | None) -> list[str]:
    """Lines of the key `structure`; none where there is none."""
    if structure is None:
        return []
    if structure.matrices is not None:
        return [f"structure: {braces({'file': quoted(structure.matrices.source)})}"]
    return [
        "structure:",
        *_listed("bodies", [_body(body) for body in structure.bodies]),
        *_listed("joints", [_joint(joint) for joint in structure.joints]),
        *_listed("screws", [_screw(screw) for screw in structure.screws]),
        f"  damping: {number_text(structure.damping)}",
        f"  tool: {quoted(structure.tool)}",
        f"  workpiece: {quoted(structure.workpiece)}",
        f"  at: {_vector(structure.at)}",
    ]


def _listed(key: str, entries: list[dict[str, str]]) -> list[str]:
    if not entries:
        return []
    return [f"  {key}:", *(f"    - {braces(entry)}" for entry in entries)]


def _body(body: Body) -> dict[str, str]:
    return {
        "name": quoted(body.name),
        "mass": number_text(body.mass),
        "inertia": _vector(body.inertia),
        "at": _vector(body.at),
    }


def _joint(joint: Joint) -> dict[str, str]:
    return {
        "between": f"[{', '.join(map(quoted, joint.between))}]",
        "points": f"[{', '.join(map(_vector, joint.points))}]",
        "stiffness": _vector(joint.stiffness),
        "damping": _vector(joint.damping),
    }


def _screw(screw: Screw) -> dict[str, str]:
    return {
        "axis": screw.axis,
        "moves": quoted(screw.moves),
        "carried_by": quoted(screw.carried_by),
        "at": _vector(screw.at),
    }


def _vector(values: Vector) -> str:
    return f"[{', '.join(map(number_text, values))}]"

"""Writing: streams in the languages of controllers, one file per controller."""

from gcodejerk.emit.base import (
    API,
    Controller,
    Form,
    Options,
    controller_of,
    controllers,
    load_controller,
)

__all__ = [
    "API",
    "Controller",
    "Form",
    "Options",
    "controller_of",
    "controllers",
    "load_controller",
]

"""Servotronix softMC: JERK with SMOOTHFACTOR -1 (softmc.servotronix.com); words not verified."""

from __future__ import annotations

from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    AxisJerks,
)


class SoftmcController(AxisJerks):
    """Servotronix softMC."""

    name = "softmc"
    forms = (Form("parameters", "unverified", "acceleration and JERK with SmoothFactor -1"),)
    facts = ("U", "softmc.servotronix.com; words not verified", "program", "no")
    called = ("ACCELERATION", "JERK")
    sheet_suffix = ".softmc-setup.txt"
    remark = ("' ", "")
    notes_for_user = ("SmoothFactor has to be -1: the exact jerk",)

"""gcodejerk: rapids that do not shake the machine.

`import gcodejerk` is cheap: the names below are loaded when they are first used.
"""

from __future__ import annotations

__version__ = "0.1.0"

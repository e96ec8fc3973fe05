"""What an operator has to know of streams at the machine: one text each, wherever it is shown.

A stream is made of feed moves, so that other knobs act on it than on the rapid that it replaces.
What is known of that was measured on LinuxCNC 2.9 only. The page `PAGE` says it at length.
"""

from __future__ import annotations

PAGE = "docs/at-the-machine.md"
MEASURED = f"G1, rapid override does nothing, measured: {PAGE}"
UNTESTED = f"G1, rapid override does nothing, untested: {PAGE}"
HAL_PAGE = "docs/linuxcnc-hal.md"
PLAYED = f"played from the file .streams, measured: {HAL_PAGE}"
GUARD_PAGE = "docs/linuxcnc-guard.md"
GUARDED = f"streams behind an override guard, measured: {GUARD_PAGE}"
STAMP_NOTES = (MEASURED, UNTESTED, PLAYED, GUARDED)
"""The comment below the stamp: at most 67 characters, without a parenthesis."""
_FEED_MOVES = "streams are feed moves (G1): rapid override does nothing to them"
_FEED = "feed override does, keep it at 100 %"
ABSOLUTE = (
    "um are the real machine's only if participation was measured with the servo on; the % of "
    "today's holds for any linear servo"
)
"""Of every figure in um (residues of the closed loop: the servo's gain is in the participation)."""
NO_MODES = (
    "the machine file has no modes: nothing is known to vibrate, so nothing can be gained, and "
    "every rapid is left alone; `gcodejerk machine test-program` writes a program to record it with"
)


def stamp_note(controller: str, guarded: bool = False) -> str:
    """The comment below the stamp of a program written for a controller, with or without guard."""
    if guarded:
        return GUARDED
    if controller == "linuxcnc-hal":
        return PLAYED
    return MEASURED if controller == "linuxcnc" else UNTESTED


def at_the_machine(controller: str, guarded: bool = False) -> str:
    """What is known of overrides, feed hold and single block on a controller.

    Parameters
    ----------
    controller : str
        Its name.
    guarded : bool, optional
        Streams run at 100 % of both overrides only.

    Returns
    -------
    str
        One note, for every program in which streams stand.
    """
    if guarded:
        return (
            "streams run only where feed and rapid override are both at 100 % when the program "
            "comes to them, else the original G0 does; a guard takes 22 ms a rapid ([TASK] "
            "CYCLE_TIME 0.001; 45 ms at 0.010), and needs `gcodejerk install linuxcnc INI --form "
            "guard`: without it no stream runs; single step is not seen and stops at every block "
            f"of a stream ({GUARD_PAGE})"
        )
    if controller == "linuxcnc-hal":
        return (
            "keep the file .streams beside the program, and install the HAL files that play it "
            f"(gcodejerk install linuxcnc INI): {HAL_PAGE}"
        )
    if controller == "linuxcnc":
        return (
            f"{_FEED_MOVES} (measured: at 0 % X60 ran at 100 mm/s), {_FEED}; feed hold brakes at "
            f"MAX_ACCELERATION, single step stops at every block ({PAGE})"
        )
    return (
        f"{_FEED_MOVES}, {_FEED}; overrides, feed hold and single block were not measured on "
        f"{controller} ({PAGE})"
    )

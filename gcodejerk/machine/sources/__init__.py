"""What people have in place of a machine file: their control's own configuration.

Each control has one module, a pure function from text to a `Draft`; `recognise` tells whose a text
is. `text_of` writes a draft as a commented machine file in which every number says where it comes
from. Rule: nothing is made up. A number is read, follows from numbers that were read, was stated by
the user, or carries the word ASSUMED; what no machine file can do without and nobody said is asked
for.
"""

from gcodejerk.machine.sources.collect import draft_of, recognise
from gcodejerk.machine.sources.draft import Draft, DraftAxis, Fact
from gcodejerk.machine.sources.stated import stated_axis, stated_mode
from gcodejerk.machine.sources.text import text_of

__all__ = [
    "Draft",
    "DraftAxis",
    "Fact",
    "draft_of",
    "recognise",
    "stated_axis",
    "stated_mode",
    "text_of",
]

"""From a measurement to modes: at present, the program that makes a machine ring.

Rule: nothing about a machine is invented here. What cannot be told from a record is not told.
"""

from gcodejerk.identification.excitation import Excitation, excitation
from gcodejerk.identification.rapids import DIALECTS, rapids_program

__all__ = ["DIALECTS", "Excitation", "excitation", "rapids_program"]

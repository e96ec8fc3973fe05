"""From a measurement to modes, and the program that makes a machine ring.

Rule: nothing about a machine is invented here. What cannot be told from a record is not told.
"""

from gcodejerk.identification.commanded import Commanded, commanded_rapids
from gcodejerk.identification.decays import Decay, Search, find_decays
from gcodejerk.identification.excitation import Excitation, excitation
from gcodejerk.identification.files import read_file, read_records
from gcodejerk.identification.modes import Identification, Identified, identify_modes
from gcodejerk.identification.rapids import DIALECTS, rapids_program
from gcodejerk.identification.record import Record, RecordError, Samples, Spectrum, make_record
from gcodejerk.identification.responses import FrequencyResponse, take_response
from gcodejerk.identification.spectra import Peak, Peaks, find_peaks

__all__ = [
    "DIALECTS", "Commanded", "Decay", "Excitation",
    "FrequencyResponse", "Identification", "Identified", "Peak", "Peaks",
    "Record", "RecordError", "Samples", "Search", "Spectrum", "commanded_rapids", "excitation",
    "find_decays", "find_peaks", "identify_modes", "make_record", "rapids_program", "read_file",
    "read_records", "take_response",
]  # fmt: skip

"""Files that are no programs are refused by what they hold; what may be a program passes."""

import json
from pathlib import Path

import pytest

from gcodejerk.errors import ProgramError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.foreign import kind_of
from gcodejerk.rewrite.pipeline import process

ROOT = Path(__file__).parents[2]
VMC = Machine.load(find_machine("vmc"))
FOREIGN = {
    "machine file": (ROOT / "machines/vmc.yaml").read_bytes(),
    "machine file with a byte order mark": b"\xef\xbb\xbf"
    + (ROOT / "machines/paper.yaml").read_bytes(),
    "machine file with CR LF": (ROOT / "machines/drill.yaml").read_bytes().replace(b"\n", b"\r\n"),
    "report": json.dumps({"gcodejerk": "0.1.0", "rapids": []}, indent=1).encode(),
    "JSON in one line": b'{"a":1}',
    "JSON list": b'[ {"a": 1} ]',
    "page": b"<!DOCTYPE html>\n<html><body>G0 X1</body></html>\n",
    "page without a type": b"\n  <html>\nG0 X1\n",
    "drawing": b'<?xml version="1.0"?><svg/>',
    "PNG": b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
    "JPEG": b"\xff\xd8\xff\xe0\0\x10JFIF",
    "GIF": b"GIF89a\1\0",
    "PDF": b"%PDF-1.7\n%\xe2\xe3\n1 0 obj\n",
    "PostScript": b"%!PS-Adobe-3.0\n",
    "ZIP": b"PK\x03\x04\x14\0",
    "gzip": b"\x1f\x8b\x08\0",
    "STEP": b"ISO-10303-21;\nHEADER;\n",
    "script": b"#!/usr/bin/env python3\nG0 = 1\n",
}
PROGRAMS = [
    b"%\nO1234 (PART)\nG0 X1\nM30\n%\n",
    b"%PART\nG0 X1\nM30\n",
    b"%_N_PART_MPF\n;$PATH=/_N_MPF_DIR\nSTART: G0 X1\nLOOP: G1 X2\nEND: M30\n",
    b"#1=5\n#<_x>=2\n#101 = 3\nG0 X#1\n",
    b"[HEADER]\nG0 X1\n",
    b"{gcode}\nG0 X1\n",
    b"(<html> in a comment)\nG0 X1\n",
    b"<part> made by somebody\nG0 X1\n",
    b"; layer: 1\n; height: 2\n; width: 3\nG0 X1\n",
    b"NAME: a\nDATE: b\nTOOL: c\nG0 X1\n",
    b"0 BEGIN PGM 1 MM\n1 L X+0 FMAX\n",
    b"part.nc\n%\nO1\nG0 X1\n",
    b"\xef\xbb\xbfG0 X1\n",
    b"",
    b"\n\n\n",
    b"SET_PIN PIN=x VALUE=1\nSTART_PRINT\nG0 X1\n",
    b"/G0 X1\n*-comment\n",
]


@pytest.mark.parametrize("data", FOREIGN.values(), ids=FOREIGN)
def test_what_no_control_could_run_is_refused_with_what_it_is(data):
    with pytest.raises(ProgramError, match="this is no NC program but a"):
        process(data, VMC, dialect="linuxcnc")


@pytest.mark.parametrize("data", PROGRAMS)
def test_what_may_be_a_program_passes(data):
    assert kind_of(data) is None


def test_no_program_of_the_corpus_is_refused():
    folder = ROOT.parent / "shared/corpus"
    programs = [path for path in sorted(folder.rglob("*.*")) if path.suffix != ".md"]
    if not programs:
        pytest.skip("the corpus is not here")
    assert [path for path in programs if kind_of(path.read_bytes()[: 1 << 14])] == []


def test_every_sample_and_seed_passes():
    for path in [*ROOT.glob("samples/**/*.n*"), *ROOT.glob("tests/fuzz/seeds/*.nc")]:
        assert kind_of(path.read_bytes()) is None, path

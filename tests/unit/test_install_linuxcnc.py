"""`install linuxcnc`: in, out again byte for byte, and refused where it cannot be."""

import runpy
import shutil
import sys
from pathlib import Path
from types import ModuleType

import pytest

from gcodejerk import Machine, process
from gcodejerk.cli import main
from gcodejerk.errors import EmitError
from gcodejerk.hosts.linuxcnc import hal_files
from gcodejerk.hosts.linuxcnc.install import install, remove

KIT = Path(__file__).parents[1] / "clients" / "linuxcnc"
FORMS = hal_files.FORMS


@pytest.fixture
def config(tmp_path):
    """A configuration of LinuxCNC's: its INI."""
    for name in ("sim.ini", "sim.hal", "sim.tbl"):
        shutil.copy(KIT / name, tmp_path / name)
    return tmp_path / "sim.ini"


def add(config, form="adaptive-feed", version="2.9.4"):
    return install(str(config), form, version)


def everything(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@pytest.mark.parametrize("form", FORMS)
def test_what_is_installed_is_taken_out_again_byte_for_byte(config, form):
    before = everything(config.parent)
    add(config, form)
    after = everything(config.parent)
    assert set(after) - set(before) == {"gcodejerk.hal", "M152", "sim.ini.before-gcodejerk"}
    assert after["sim.ini.before-gcodejerk"] == before["sim.ini"]
    assert b"HALFILE = sim.hal\n# gcodejerk begin\nHALFILE = gcodejerk.hal\n" in after["sim.ini"]
    assert (config.parent / "M152").stat().st_mode & 0o111
    assert "nothing was changed" in add(config, form)[0]
    assert everything(config.parent) == after
    remove(str(config))
    assert everything(config.parent) == before
    assert "nothing of gcodejerk" in remove(str(config))[0]


@pytest.mark.parametrize("end", ["\n", "\r\n", "unended"])
def test_line_ends_are_kept(config, end):
    data = config.read_bytes()
    if end == "unended":
        hal = data.index(b"[HAL]\nHALFILE = sim.hal\n")
        data = data[:hal] + data[hal + 24 :] + b"[HAL]\nHALFILE = sim.hal"
    config.write_bytes(data.replace(b"\n", b"\r\n") if end == "\r\n" else data)
    before = config.read_bytes()
    add(config)
    assert b"gcodejerk.hal" in config.read_bytes()
    remove(str(config))
    assert config.read_bytes() == before


def test_the_guard_is_installed_and_taken_out_again_byte_for_byte(config):
    before = everything(config.parent)
    done = add(config, "guard")
    after = everything(config.parent)
    assert set(after) - set(before) == {"gcodejerk.hal", "sim.ini.before-gcodejerk"}
    lines = b"# gcodejerk begin\nHALUI = halui\nHALFILE = gcodejerk.hal\n# gcodejerk end\n"
    assert b"HALFILE = sim.hal\n" + lines in after["sim.ini"]
    assert b"@" not in after["gcodejerk.hal"]
    assert "override_guard: true" in done[-1]
    assert "nothing was changed" in add(config, "guard")[0]
    with pytest.raises(EmitError, match="form guard is installed already"):
        add(config)
    assert everything(config.parent) == after
    remove(str(config))
    assert everything(config.parent) == before


def test_the_guard_takes_the_halui_and_the_signals_that_are_there(config):
    edit(config, "[HAL]\n", "[HAL]\nHALUI = halui\nPOSTGUI_HALFILE = screen.hal\n")
    (config.parent / "screen.hal").write_text(
        "net shown halui.feed-override.value => screen.feed\n"
    )
    add(config, "guard")
    assert config.read_text().count("HALUI = ") == 1
    hal = (config.parent / "gcodejerk.hal").read_text()
    assert "net shown halui.feed-override.value => gcodejerk-feed.in1\n" in hal
    assert "net gcodejerk-rapid-override halui.rapid-override.value" in hal


@pytest.mark.parametrize(
    ("name", "old", "new", "says"),
    [
        ("sim.ini", "[HAL]\n", "[HAL]\nHALUI = other\n", "reads the overrides from halui"),
        (
            "sim.hal",
            "loadrt scale",
            "loadrt near names=n\nloadrt scale",
            "component near is loaded",
        ),
        (
            "sim.hal",
            "net z-command",
            "net probe hm2.analog => motion.analog-in-03\nnet z-command",
            "motion.analog-in-03 is linked to the signal probe",
        ),
        ("sim.hal", "num_joints", "num_aio=2 num_joints", "num_aio=2"),
    ],
)
def test_the_guard_is_refused_where_something_is_in_its_place(config, name, old, new, says):
    edit(config.parent / name, old, new)
    before = everything(config.parent)
    with pytest.raises(EmitError, match=says):
        add(config, "guard")
    assert everything(config.parent) == before


def test_a_path_of_m_codes_is_added_where_there_is_none(config):
    edit(config, "USER_M_PATH = .\n", "")
    before = config.read_bytes()
    add(config)
    assert f"USER_M_PATH = {config.parent}\n".encode() in config.read_bytes()
    remove(str(config))
    assert config.read_bytes() == before


def test_what_the_user_edits_elsewhere_stays(config):
    add(config)
    edit(config, "MACHINE = gcodejerk-sim", "MACHINE = mine")
    done = remove(str(config))
    assert "MACHINE = mine" in config.read_text()
    assert "gcodejerk.hal" not in config.read_text()
    assert any("kept, the INI was edited since" in line for line in done)


@pytest.mark.parametrize(
    ("name", "old", "new", "says"),
    [
        ("sim.ini", "HALFILE = gcodejerk.hal\n", "HALFILE = gcodejerk.hal\nX = 1\n", "were edited"),
        ("sim.ini", "# gcodejerk end\n", "", "not in pairs"),
        ("gcodejerk.hal", "setp", "# setp", "was edited after it was installed"),
    ],
)
def test_what_the_user_edits_in_between_is_not_taken_out(config, name, old, new, says):
    add(config)
    edit(config.parent / name, old, new)
    before = everything(config.parent)
    with pytest.raises(EmitError, match=says):
        remove(str(config))
    assert everything(config.parent) == before


def test_the_other_form_is_installed_behind_a_removal_only(config):
    add(config)
    before = everything(config.parent)
    with pytest.raises(EmitError, match="adaptive-feed is installed already"):
        add(config, "position")
    assert everything(config.parent) == before


def test_files_that_another_configuration_uses_stay(config):
    other = config.with_name("other.ini")
    shutil.copy(config, other)
    add(config)
    add(other)
    remove(str(other))
    assert (config.parent / "gcodejerk.hal").exists()
    remove(str(config))
    assert not (config.parent / "gcodejerk.hal").exists()


REFUSED = [
    ("sim.ini", "[EMCMOT]", "[MOTION]", "no LinuxCNC configuration"),
    ("sim.ini", "HALFILE = sim.hal", "HALFILE = gone.hal", "gone.hal does not exist"),
    ("sim.ini", "HALFILE = sim.hal", "HALFILE = sim.tcl", "is a Tcl script"),
    ("sim.ini", "HALFILE = sim.hal\n", "", "no HALFILE"),
    ("sim.ini", "EMCMOT = motmod", "EMCMOT = other", "EMCMOT is other, not motmod"),
    ("sim.ini", "EMCMOT = motmod", "EMCMOT = motmod num_dio=9", "motmod arguments: num_dio=9"),
    ("sim.ini", "USER_M_PATH = .", "USER_M_PATH = gone", "no folder"),
    ("sim.hal", "loadrt scale", "loadrt streamer depth=9 cfg=f\nloadrt scale", "one FIFO"),
    ("sim.hal", "loadrt scale", "loadrt near\nloadrt scale", "component near is loaded here"),
    (
        "sim.hal",
        "net line",
        "net load load.out => motion.adaptive-feed\nnet line",
        "motion.adaptive-feed is linked to the signal load",
    ),
    ("sim.hal", "net line", "net probe motion.digital-in-03\nnet line", "digital-in-03 is linked"),
    ("sim.hal", "num_joints=", "num_dio=2 num_joints=", "num_dio=2"),
    ("sim.hal", "addf motion-controller servo-thread", "", "in no thread servo-thread"),
]


@pytest.mark.parametrize(("name", "old", "new", "says"), REFUSED)
def test_a_configuration_that_does_not_fit_is_refused_and_left_alone(config, name, old, new, says):
    edit(config.parent / name, old, new)
    before = everything(config.parent)
    with pytest.raises(EmitError, match=says) as refused:
        add(config)
    assert refused.value.remedy
    assert everything(config.parent) == before


@pytest.mark.parametrize(
    ("name", "old", "new", "says"),
    [
        ("sim.ini", "KINEMATICS = trivkins", "KINEMATICS = maxkins", "KINEMATICS is maxkins"),
        ("sim.ini", "COORDINATES = X Y Z", "COORDINATES = X Y Y Z", "axis Y has two joints"),
        ("sim.hal", "net z-command joint.2.motor-pos-cmd", "net z-command", "linked to no signal"),
        ("sim.hal", "addf sampler.0 servo-thread", "addf sampler.0 servo-thread -2", "depends on"),
        ("sim.hal", "net line", "net on motion.enable\nnet line", "motion.enable is linked"),
        ("sim.ini", "BASE_PERIOD = 0", "BASE_PERIOD = 30000", "no multiple of BASE_PERIOD"),
        ("sim.ini", "[JOINT_1]", "[JOINT_1]\nBACKLASH = 0.02", "JOINT_1. BACKLASH is 0.02"),
        ("sim.ini", "[JOINT_2]", "[JOINT_2]\nCOMP_FILE = z.comp", "COMP_FILE is z.comp"),
        ("sim.ini", "[AXIS_X]", "[AXIS_X]\nOFFSET_AV_RATIO = 0.1", "OFFSET_AV_RATIO is 0.1"),
    ],
)
def test_the_form_position_needs_more(config, name, old, new, says):
    edit(config.parent / name, old, new)
    before = everything(config.parent)
    with pytest.raises(EmitError, match=says):
        add(config, "position")
    assert everything(config.parent) == before


def test_no_backlash_and_that_of_other_joints_are_none_of_the_form_position(config):
    edit(config, "[JOINT_1]", "[JOINT_1]\nBACKLASH = 0.000")
    config.write_text(config.read_text() + "\n[JOINT_3]\nBACKLASH = 0.1\n")
    assert "the form position" in add(config, "position")[0]


def test_read_only_configurations_and_unknown_versions_are_refused(config, monkeypatch):
    before = everything(config.parent)
    config.chmod(0o444)
    with pytest.raises(EmitError, match="cannot be written to"):
        add(config)
    config.chmod(0o644)
    with pytest.raises(EmitError, match=r"LinuxCNC 2\.10"):
        add(config, version="2.10.0")
    monkeypatch.setattr(shutil, "which", lambda name: None)
    with pytest.raises(EmitError, match="version of LinuxCNC cannot be told"):
        install(str(config), "adaptive-feed")
    (config.parent / "M152").write_text("mine")
    with pytest.raises(EmitError, match="is not what would be written"):
        add(config)
    (config.parent / "M152").unlink()
    assert everything(config.parent) == before


def test_the_drives_take_their_place_behind_motion_controller(config):
    """Functions stand in the thread behind LinuxCNC's own, in front of what drives the motors."""
    add(config, "position")
    text = (config.parent / "gcodejerk.hal").read_text()
    places = [line.split() for line in text.splitlines() if line.startswith("addf")]
    assert [int(words[3]) for words in places] == list(range(3, 3 + len(places)))
    for axis, joint in zip("xyz", range(3), strict=True):
        assert f"net {axis}-command gcodejerk-drive-{joint}.out" in text
    loaded = {
        name
        for line in text.splitlines()
        if line.startswith("loadrt") and "names=" in line
        for name in line.split("names=")[1].split(",")
    }
    assert {words[1] for words in places} == loaded | {"streamer.0"}


def test_every_component_of_the_adaptive_feed_form_runs(config):
    add(config)
    text = (config.parent / "gcodejerk.hal").read_text()
    run = {line.split()[1] for line in text.splitlines() if line.startswith("addf")}
    loaded = {
        name
        for line in text.splitlines()
        if line.startswith("loadrt") and "names=" in line
        for name in line.split("names=")[1].split(",")
    }
    assert run == loaded | {"streamer.0"}


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["linuxcnc", "INI", "--linuxcnc-version", "2.9"], 0),
        (["linuxcnc", "INI", "--form", "pvt"], 2),
        (["linuxcnc", "INI", "--form", "position", "--remove"], 2),
        (["machine", "INI"], 2),
        (["linuxcnc", "gone.ini"], 1),
    ],
)
def test_exit_status(config, arguments, code, capsys, monkeypatch):
    named = [str(config) if word == "INI" else word for word in arguments]
    monkeypatch.setattr("sys.argv", ["gcodejerk", "install", *named])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == code
    out, err = capsys.readouterr()
    assert bool(err) == (code > 0)
    assert bool(out) == (code == 0)


# --- M152 knows the programs that ask for rapids ---


@pytest.fixture
def asks(monkeypatch, tmp_path):
    """What M152 says of a program; LinuxCNC's own module is not needed for it."""
    monkeypatch.setitem(sys.modules, "hal", ModuleType("hal"))
    script = Path(hal_files.__file__).parent / hal_files.SCRIPT
    of_path = runpy.run_path(str(script))["asks"]

    def of_text(data):
        (tmp_path / "part.ngc").write_bytes(data)
        return of_path(str(tmp_path / "part.ngc"))

    return of_text


@pytest.mark.parametrize(
    ("head", "end"),
    [(b"", b""), (b"\n" * 70_000 + b"%\n", b"%\n"), (b"(A long story)\n" * 6_000 + b"O100\n", b"")],
)
@pytest.mark.parametrize("form", FORMS)
def test_a_program_that_asks_for_rapids_is_known_whatever_stands_in_front(asks, form, head, end):
    golden = Path(__file__).parents[1] / "golden" / "hal_position" / "machine.yaml"
    program = head + b"G21 G90 G17 G40 G94 G64\nG0 X0\nG0 X50\nM2\n" + end
    output = process(program, Machine.load(golden), form=form).output
    assert (output.index(b"\nM152 P") > 65_536) == bool(head)
    assert asks(output)
    assert not asks(program)


def test_m152_is_found_wherever_a_look_at_a_part_of_the_file_may_end(asks):
    for before in range((1 << 20) - 9, (1 << 20) + 2):
        assert asks(b"(" * before + b"\nM152 P1 Q2\n"), before
    assert not asks(b"")
    assert not asks(b"(see\tM152 P1)\nM1520 P1\n")

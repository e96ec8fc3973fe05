"""Numbers that are possible and hardly meant: warned of at their place, with the likely slip."""

import pytest

from gcodejerk.machine import Machine

TEXT = """interval: 0.001
positioning: linear
axes:
  Z:
    rapid: {velocity: %(velocity)s, acceleration: %(acceleration)s, jerk: %(jerk)s}
    limit: %(limit)s
    modes:
      - {frequency: %(frequency)s, damping: %(damping)s}
"""
GOOD = {
    "velocity": "600", "acceleration": "5000", "jerk": "5.0e+5",
    "limit": "{}", "frequency": "30", "damping": "0.02",
}  # fmt: skip


def warnings(text=TEXT, **changed):
    return [str(w) for w in Machine.loads(text % (GOOD | changed), "mill.yaml").warnings]


def test_a_usual_machine_is_not_doubted():
    assert warnings() == []


@pytest.mark.parametrize(
    ("changed", "place", "what"),
    [
        ({"velocity": "36000"}, "5:23", "mm/min"),
        ({"velocity": "0.6"}, "5:23", "m/min or m/s"),
        ({"acceleration": "0.5", "jerk": "50"}, "5:42", "g?"),
        ({"acceleration": "5.0e+6", "jerk": "5.0e+8"}, "5:42", "mm/min^2"),
        ({"jerk": "500"}, "5:54", "m/s^3"),
        ({"jerk": "9999"}, "5:54", "0.5 s to build"),
        ({"jerk": "5.1e+6"}, "5:54", "less than one interval"),
        ({"limit": "{velocity: 500}"}, "6:23", "below rapid.velocity"),
        ({"limit": "{acceleration: 4000}"}, "6:27", "below rapid.acceleration"),
        ({"limit": "{jerk: 4.0e+5}"}, "6:19", "below rapid.jerk"),
        ({"limit": "{jerk: 6.0e+6}"}, "6:19", "less than one interval"),
        ({"frequency": "2.9"}, "8:21", "below 3"),
        ({"frequency": "499.9"}, None, None),
        ({"damping": "0"}, "8:34", "rings for ever"),
        ({"damping": "0.31"}, "8:34", "per cent"),
        ({"damping": "0.3"}, None, None),
        ({"jerk": "10000"}, None, None),
        ({"jerk": "5.0e+6"}, None, None),
        ({"velocity": "3000"}, None, None),
        ({"velocity": "1"}, None, None),
        ({"acceleration": "10", "jerk": "1000"}, None, None),
        ({"acceleration": "50000", "jerk": "5.0e+6"}, None, None),
    ],
)
def test_what_is_hardly_meant_is_warned_of_at_its_place(changed, place, what):
    found = warnings(**changed)
    if place is None:
        assert found == []
        return
    assert len(found) == 1
    assert found[0].startswith(f"mill.yaml:{place}: axes.Z.")
    assert what in found[0]


def test_a_frequency_in_radians_is_warned_of():
    text = TEXT.replace("interval: 0.001", "interval: 0.0005")
    (found,) = warnings(text, frequency="565")
    assert "565 rad/s is 89.92 Hz" in found


def test_a_damping_that_is_left_out_is_warned_of_at_its_mode():
    (found,) = warnings(TEXT.replace(", damping: %(damping)s", ""))
    assert found.startswith("mill.yaml:8:9: axes.Z.modes[0].damping is 0")


def test_modes_of_the_structure_are_looked_at_too():
    text = TEXT + "modes:\n  - {frequency: 1, damping: 0.02, participation: {Z: 1}}\n"
    (found,) = warnings(text)
    assert found.startswith("mill.yaml:10:17: modes[0].frequency is 1 Hz")


@pytest.mark.parametrize(
    ("velocity", "acceleration", "what"),
    [
        ("600", "3000", None),
        ("24000", "50000", None),
        ("0.5", "3000", "turns per second"),
        ("36000", "3000", "deg/min"),
        ("600", "5", "rad/s^2"),
        ("600", "360000", "deg/min^2"),
    ],
)
def test_rotary_axes_have_thresholds_of_their_own(velocity, acceleration, what):
    text = TEXT.replace("  Z:", "  A:").replace(", jerk: %(jerk)s", "")
    text = text.replace("%(damping)s}", "%(damping)s, participation: 1}")
    found = warnings(text, velocity=velocity, acceleration=acceleration)
    assert len(found) == (what is not None)
    if what:
        assert what in found[0]
        assert "deg/s" in found[0]


def test_inches_are_judged_as_the_millimetres_that_they_are():
    text = "units: inch\n" + TEXT
    usual = {"velocity": "20", "acceleration": "200", "jerk": "20000"}
    assert warnings(text, **usual) == []
    (found,) = warnings(text, **(usual | {"velocity": "1200"}))
    assert "30480 mm/s" in found

"""What figures say, line by line: no word over another, everything named, every line there."""

import functools
from itertools import combinations

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from gcodejerk.machine import Machine, find_machine
from gcodejerk.motion import Profiles
from gcodejerk.planning.move import plan_move
from gcodejerk.report.compare_figure import DPI, draw_comparison, page_size
from gcodejerk.report.compare_lanes import position_curve
from gcodejerk.report.compare_shown import Shown
from gcodejerk.report.compare_spectra import acceleration_spectrum, spread, vibration_spectrum
from gcodejerk.report.map_figure import ONE, THREE, draw_conditions, draw_map
from gcodejerk.report.simulation_figure import MOVE, draw_move_simulation
from gcodejerk.simulation.single import MoveSimulation
from gcodejerk.studies.amplitude_map import Survey
from gcodejerk.studies.comparison import CONTENDERS, compare_move

T_SUM = r"$T_\mathrm{SUM}$"


def texts_of(figure):
    """Every visible text that says something, legends and ticks included."""
    figure.draw_without_rendering()
    unseen = set()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            spare = 1e-9 * (high - low)
            for tick in (*axis.majorTicks, *axis.minorTicks):
                # matplotlib keeps ticks beyond the limits, and does not draw them.
                there = tick.get_visible() and low - spare <= tick.get_loc() <= high + spare
                for label in (tick.label1, tick.label2):
                    if not (there and axis.get_visible()):
                        unseen.add(label)
    return [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and text not in unseen
    ]


def corners(text):
    """The corners of a text's own box, which may be turned, shape (4, 2) [px]."""
    angle = text.get_rotation()
    text.set_rotation(0.0)
    # An annotation's own box has its arrow in it.
    box = Text.get_window_extent(text)
    text.set_rotation(angle)
    upright = np.array([[box.x0, box.y0], [box.x1, box.y0], [box.x1, box.y1], [box.x0, box.y1]])
    turned = Text.get_window_extent(text)
    middle = 0.5 * (turned.p0 + turned.p1)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return middle + (upright - upright.mean(axis=0)) @ np.array([[c, s], [-s, c]])


def apart(one, other, spare=0.5):
    """Whether two turned boxes have a line between them."""
    for box in (one, other):
        for k in (0, 1):
            direction = box[k + 1] - box[k]
            direction = direction / max(float(np.hypot(*direction)), 1e-9)
            a, b = one @ direction, other @ direction
            if a.max() <= b.min() + spare or b.max() <= a.min() + spare:
                return True
    return False


def assert_readable(figure):
    """No word stands over another, and none beyond the page."""
    found = texts_of(figure)
    width, height = figure.bbox.size
    boxes = [(text, corners(text)) for text in found]
    for text, box in boxes:
        assert box.min() > -1.0, text.get_text()
        assert box[:, 0].max() < width + 1.0, text.get_text()
        assert box[:, 1].max() < height + 1.0, text.get_text()
    for (a, first), (b, second) in combinations(boxes, 2):
        assert apart(first, second), (a.get_text(), b.get_text())


def words_of(figure):
    """All of a figure's texts, one a line."""
    return "\n".join(text.get_text() for text in texts_of(figure))


@functools.cache
def surveyed(name, axis, length, condition="III", mode="all", extra=""):
    text = find_machine(name).read_text(encoding="utf-8") + extra
    return Survey.of(Machine.loads(text, f"{name}.yaml"), axis, length, condition, mode)


def drawn(survey, draw=draw_map, size=ONE, **options):
    figure = Figure(size, layout="constrained")
    draw(figure, survey, points=120, **options)
    return figure


MAPS = [
    ("paper", "Z", 1.0), ("centre", "Z", 1.0), ("centre", "Z", 8.0), ("centre", "X", 30.0),
    ("drill", "X", 0.3), ("drill", "X", 20.0), ("drill", "Z", 0.5), ("router", "X", 2.0),
    ("router", "X", 300.0), ("vmc", "Z", 1.0), ("vmc", "Y", 100.0),
]  # fmt: skip


@pytest.mark.parametrize(("name", "axis", "length"), MAPS)
def test_no_word_of_a_map_stands_over_another(name, axis, length):
    assert_readable(drawn(surveyed(name, axis, length)))


@pytest.mark.parametrize("condition", ["I", "II"])
def test_nor_in_maps_of_other_conditions(condition):
    assert_readable(drawn(surveyed("centre", "Z", 1.0, condition)))


@pytest.mark.parametrize(("name", "axis", "length"), MAPS)
def test_no_word_of_three_maps_stands_over_another(name, axis, length):
    assert_readable(drawn(surveyed(name, axis, length), draw_conditions, THREE))


LONG_NAMES = ("W" * 45, "rocking_of_the_column_about_its_base_with_gui", "MwMmMw " * 7)


def named_survey(name, mode="all"):
    """Three modes of one long name, on a machine of one that is longer still."""
    modes = ", ".join(
        f"{{name: '{name[k:]}{k}', frequency: {30 + 17 * k}, damping: 0.02, participation: 1}}"
        for k in range(3)
    )
    text = (
        f"name: '{name} {name}'\ninterval: 0.001\npositioning: linear\naxes:\n  Z: {{rapid: "
        f"{{velocity: 600, acceleration: 5000, jerk: 5.0e+5}}, modes: [{modes}]}}\n"
    )
    return Survey.of(Machine.loads(text, "m.yaml"), "Z", 1.0, "III", mode)


@pytest.mark.parametrize("name", LONG_NAMES)
def test_long_names_stay_on_the_page(name):
    assert_readable(drawn(named_survey(name)))
    assert_readable(drawn(named_survey(name, "1")))
    assert_readable(drawn(named_survey(name), draw_conditions, THREE))


def test_a_map_names_all_that_it_draws():
    figure = drawn(surveyed("centre", "Z", 1.0))
    words = words_of(figure)
    for mode in ("rocking, 30 Hz", "bed, 50 Hz", "column, 90 Hz", "head, 110 Hz"):
        assert f"null of {mode} (without damping)" in words
    inside = [text.get_text() for text in figure.axes[0].texts]
    assert {"30 Hz", "50 Hz", "90 Hz", "110 Hz"} <= set(inside)
    assert inside.count("jerk limit") == 2
    assert inside.count("acceleration limit") == 1
    left = next(t for t in figure.axes[0].texts if t.get_text() == "jerk limit")
    assert left.get_position()[0] < 0.05 or any(
        t.get_position()[0] < 0.05 for t in figure.axes[0].texts if t.get_text() == "jerk limit"
    )
    for said in (
        "$T_1$ [ms]",
        f"{T_SUM} [ms]",
        f"no profile:\n$T_1$ ≥ {T_SUM}/2",
        f"conventional {T_SUM}, 40 ms",
        "colours by the square root of it",
        "beyond a limit of the axis",
        f"$T_1$ = 1 ms, {T_SUM} = 40 ms: 149.6 µm",
    ):
        assert said in words
    assert "above the conventional" not in words


def test_lines_of_different_modes_look_different_and_lie_on_what_they_have_in_the_map():
    figure = drawn(surveyed("centre", "Z", 1.0))
    (legend,) = figure.legends
    nulls = [
        line
        for line in figure.axes[0].lines
        if line.get_color() == "white" and line.get_zorder() < 6
    ]
    # Two of 30 Hz, and more of the others, each set in dashes of its own.
    assert len(nulls) > 15
    assert len({str(line._dash_pattern[1]) + str(line.get_linewidth()) for line in nulls}) == 4
    # White is seen on a patch as dark as the map's valleys.
    dark = [p for p in legend.get_patches() if sum(p.get_facecolor()[:3]) < 0.9]
    assert len(dark) == 4


def test_a_longer_time_is_flagged():
    survey = surveyed("centre", "Z", 8.0)
    figure = drawn(survey)
    assert f"{T_SUM} is 8 ms above the conventional" in words_of(figure)
    assert any(text.arrow_patch is not None for text in figure.axes[0].texts if not text.get_text())
    short = drawn(survey, longest=0.095)
    assert "(not on this map)" in words_of(short)


def test_nulls_too_many_to_draw_are_told():
    words = words_of(drawn(surveyed("router", "X", 300.0)))
    assert "nulls of 9, 32 Hz\n(Condition III): too many to be drawn" in words
    assert "null of" not in words


def test_what_is_beyond_the_limits_is_hatched():
    figure = drawn(surveyed("paper", "Z", 1.0))
    hatched = [c for c in figure.axes[0].collections if getattr(c, "hatches", [None])[0]]
    assert len(hatched) == 1


def test_the_papers_three_maps_have_one_scale_and_its_best_points():
    figure = drawn(surveyed("paper", "Z", 1.0, mode="1"), draw_conditions, THREE)
    maps = figure.axes[:3]
    norms = {id(axes.collections[0].norm) for axes in maps}
    assert len(norms) == 1
    assert len(figure.axes) == 4
    titles = [axes.get_title(loc="left") for axes in maps]
    assert [title.splitlines()[0] for title in titles] == [
        "Condition I", "Condition II", "Condition III"
    ]  # fmt: skip
    # The best T1 from 1 ms on, with the limits left aside where the paper's point breaks them.
    for title, said in zip(titles, ("11777", "12144", "5697"), strict=True):
        assert f"$T_1$ = 1 ms, {T_SUM} = 40 ms: {said} mm/s²" in title
    marked = [
        [line.get_xydata()[0].round(3).tolist() for line in axes.lines
         if line.get_marker() in ("o", "D")]
        for axes in maps
    ]  # fmt: skip
    assert marked == [[[1.0, 40.0], [10.0, 40.0]], [[1.0, 40.0]], [[1.0, 40.0]]]


def test_condition_two_is_at_rest_in_two_periods_whatever_t1(four_segments):
    survey = surveyed("paper", "Z", 1.0, "II")
    mode = survey.modes[0]
    times = survey.null_times(0.21, mode)
    assert times == pytest.approx([2 / 30, 4 / 30, 6 / 30])
    for T in times:
        left = four_segments("II", np.array([0.2, 0.31]) * T, T).left(30.0, 0.0)
        worst = four_segments("II", np.array([0.2, 0.31]) * T, 0.9 * T).left(30.0, 0.0)
        assert (left < 1e-5 * worst).all()
    assert not surveyed("paper", "Z", 1.0).null_times(0.21, mode).size


MANY_MODES = """\
interval: 0.001
positioning: linear
axes:
  X:
    rapid: {velocity: 300, acceleration: 5000, jerk: 5.0e+5}
    modes:
""" + "".join(
    f"      - {{name: a mode with a long name {k}, frequency: {f}, damping: 0.02}}\n"
    for k, f in enumerate((30, 33, 36, 39, 42, 60, 66, 90, 100))
)
SPECTRUM = """\
interval: 0.001
positioning: linear
axes:
  X: {rapid: {velocity: 300, acceleration: 3000, jerk: 5.0e+5}, spectrum: x.csv}
"""
ROTARY = """\
interval: 0.001
positioning: linear
axes:
  A: {type: rotary, rapid: {velocity: 90, acceleration: 3000, jerk: 3.0e+5},
      modes: [{frequency: 40, damping: 0.03, participation: 1}]}
"""


@functools.cache
def compared(name, *moves):
    """What is drawn of a comparison, and its figure."""
    if name == "own":
        text = find_machine("centre").read_text(encoding="utf-8")
        machine = Machine.loads(text.replace("positioning: linear", "positioning: independent"))
    elif name in ("many", "rotary"):
        machine = Machine.loads(MANY_MODES if name == "many" else ROTARY)
    else:
        machine = Machine.load(find_machine(name))
    shown = Shown(compare_move(dict(moves), machine))
    figure = Figure(page_size(shown), dpi=DPI, layout="constrained")
    draw_comparison(figure, shown)
    return shown, figure


COMPARED = [
    ("paper", ("Z", 1.0)), ("vmc", ("X", 43.773)), ("drill", ("X", 20.0), ("Y", 7.0)),
    ("centre", ("X", 30.0), ("Y", -12.0), ("Z", 5.0)), ("own", ("X", 6.0), ("Z", 1.0)),
    ("router", ("X", 24.0)), ("drill", ("Z", 0.05)), ("many", ("X", 5.0)), ("rotary", ("A", 2.0)),
]  # fmt: skip


def part(figure, title):
    """The axes of the part whose title begins so, after its letter."""
    return next(a for a in figure.axes if a.get_title(loc="left")[4:].startswith(title))


@pytest.mark.parametrize("case", COMPARED, ids=lambda case: f"{case[0]}-{len(case) - 1}")
def test_a_comparison_shows_every_axis_with_no_word_over_another_or_over_a_line(case):
    shown, figure = compared(*case)
    assert_readable(figure)
    for axes in figure.axes:
        boxes = [corners(text) for text in axes.texts if text.get_text()]
        lines = [line for line in axes.lines if len(line.get_xdata()) > 2]
        for box in boxes:
            for line in lines:
                x, y = line.get_transform().transform(line.get_xydata()).T
                low, high = box.min(axis=0), box.max(axis=0)
                over = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
                assert not over.any(), (axes.get_title(loc="left"), line)
    assert_every_axis_is_shown(case, shown, figure)


def assert_every_axis_is_shown(case, shown, figure):
    """Acceleration, position and spectrum of each; the others named; a unit on every axis."""
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert [title[1] for title in titles] == list("abcdefghijklmnop"[: len(titles)])
    assert len(titles) == 3 * (len(case) - 1) + 3
    for axis, length in case[1:]:
        letter = next(t[1] for t in titles if t.endswith(f"acceleration of {axis}"))
        assert any(t.endswith(f"spectrum of ({letter})") for t in titles)
        position = part(figure, f"position of {axis}")
        for line in position.lines:
            assert line.get_ydata()[0] == 0.0
            assert line.get_ydata()[-1] == pytest.approx(length)
        assert len(position.lines) == len(shown.shown)
    for axes in figure.axes:
        assert "[" in axes.get_xlabel()
        lanes = any(word in axes.get_title(loc="left") for word in ("acceleration", "vibration"))
        assert lanes or "[" in axes.get_ylabel()
    words = words_of(figure).replace("\n", " ")
    others = words[words.index("all others:") :]
    for candidate in shown.comparison.candidates:
        named = candidate.name in [c.name for c in shown.shown]
        assert named or candidate.name in others
    assert {c.name for c in (*shown.shown, *shown.others)} <= set(CONTENDERS)


def test_modes_are_named_where_there_is_room():
    _, figure = compared("centre", ("X", 30.0), ("Y", -12.0), ("Z", 5.0))
    words = words_of(figure)
    for name in ("rocking 30 Hz", "column 42 Hz", "bed 50 Hz", "table 55 Hz", "head 110 Hz"):
        assert name in words


def test_modes_are_counted_where_there_is_little_room():
    few = words_of(compared("many", ("X", 5.0))[1])
    assert "a mode with" not in few
    assert all(f"{f} Hz" in few for f in (30, 33, 36, 39, 42, 60, 66, 90, 100))


def test_things_that_are_spread_keep_their_order_and_room():
    centres = np.array([1.0, 1.5, 2.0, 50.0, 98.0, 99.0])
    sizes = np.full(6, 12.0)
    places = spread(centres, sizes, 100.0)
    assert (np.diff(places) >= 12.0 + 5.0 - 1e-9).all()
    assert places[0] >= 6.0
    assert places[-1] <= 94.0


def simpson(values, step):
    """Simpson's rule over an odd number of points."""
    weight = np.full(values.shape[-1], 2.0)
    weight[1::2] = 4.0
    weight[[0, -1]] = 1.0
    return (values * weight).sum(axis=-1) * step / 3.0


@pytest.mark.parametrize("name", ["conventional", "condition3", "optimal", "zv"])
def test_the_spectrum_of_the_acceleration_is_its_fourier_integral(name):
    shown, _ = compared("paper", ("Z", 1.0))
    profile = shown.profile(shown.comparison[name], "Z")
    corners_t = np.append(profile.begin, profile.begin[-1] + profile.duration[-1])
    corners_a = np.append(profile.acceleration, 0.0)
    t = np.linspace(0.0, corners_t[-1], 40001)
    a = -3.0 * np.interp(t, corners_t, corners_a)
    f = np.array([2.0, 17.0, 30.0, 55.5, 121.0])
    expected = np.abs(simpson(a * np.exp(-2j * np.pi * f[:, np.newaxis] * t), t[1]))
    found = acceleration_spectrum(profile, -3.0, f)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5 * found.max())


def test_the_spectrum_of_the_vibration_is_what_an_fft_of_samples_shows():
    f, zeta, r = np.array([30.0, 47.3, 90.0]), np.array([0.0, 0.02, 0.1]), [0.2 + 0.1j, 0.05j, -0.3]
    omega = 2 * np.pi * f
    poles = -zeta * omega + 1j * omega * np.sqrt(1 - zeta**2)
    window, count = 0.5, 1 << 14
    t = np.arange(count) * window / count
    swing = sum(
        -np.exp(-z * w * t) * np.imag(a * np.exp(1j * w * np.sqrt(1 - z**2) * t))
        for z, w, a in zip(zeta, omega, r, strict=True)
    )
    shaped = swing * (1 - np.cos(2 * np.pi * t / window))
    expected = 2.0 / count * np.abs(np.fft.rfft(shaped))
    bins = np.arange(1, 120)
    found = vibration_spectrum(np.array(r), poles, window, bins / window)
    np.testing.assert_allclose(found, expected[bins], atol=2e-6)
    # What does not decay stands there with its amplitude.
    alone = vibration_spectrum(np.array(r[:1]), poles[:1], window, [30.0])
    assert alone == pytest.approx([abs(r[0])])


def test_a_position_is_the_acceleration_integrated_twice():
    first = np.array([0, 4])
    durations = np.array([0.01, 0.03, 0.03, 0.01])
    jerk = np.array([3.0, -1.0, -1.0, 3.0]) * 1e5
    profile = Profiles.of(first, durations, np.array([0.0, 3e3, 0.0, -3e3]), jerk)
    t, q = position_curve(profile, 0.1)
    fine = np.linspace(0.0, 0.1, 20001)
    a = np.interp(fine, [0.0, 0.01, 0.04, 0.07, 0.08], [0.0, 3e3, 0.0, -3e3, 0.0])
    for _ in range(2):
        a = np.concatenate([[0.0], np.cumsum(0.5 * (a[1:] + a[:-1]) * fine[1])])
    np.testing.assert_allclose(q, np.interp(t, fine, a), atol=1e-4 * a[-1])


def test_a_measured_spectrum_is_drawn(tmp_path):
    rows = [f"{f},{1.0 / ((1 - (f / 40) ** 2) ** 2 + 0.01)}\n" for f in range(10, 81, 10)]
    (tmp_path / "x.csv").write_text("".join(rows))
    (tmp_path / "m.yaml").write_text(SPECTRUM)
    shown = Shown(compare_move({"X": 2.0}, Machine.load(tmp_path / "m.yaml")))
    figure = Figure(page_size(shown), dpi=DPI, layout="constrained")
    draw_comparison(figure, shown)
    assert_readable(figure)
    assert "grey: measured spectrum" in words_of(figure)


@pytest.mark.parametrize("frequencies", [(38.0, 52.0), (30.0,), (12.0, 95.0, 110.0), (110.0,)])
@pytest.mark.parametrize("interval", [0.001, 0.004])
def test_a_simulation_is_readable_whatever_frequencies_it_spans(frequencies, interval):
    modes = ", ".join(f"{{frequency: {f}, damping: 0.02, participation: 1}}" for f in frequencies)
    text = (
        f"name: Mill\ninterval: {interval}\npositioning: linear\naxes:\n  Z: {{rapid: "
        f"{{velocity: 600, acceleration: 5000, jerk: 5.0e+5}}, modes: [{modes}]}}\n"
    )
    figure = Figure(MOVE, layout="constrained")
    plan = plan_move({"Z": 20.0}, Machine.loads(text, "m.yaml"))
    draw_move_simulation(figure, MoveSimulation(plan))
    figure.draw_without_rendering()
    assert_readable(figure)
    for axes in figure.axes[1::2]:
        assert len(axes.get_xticks()) >= 2


@pytest.mark.parametrize(
    "arguments",
    [
        ("plan", "Z=1", "--plot"), ("compare", "Z=1", "--plot"), ("simulate", "Z=1", "--plot"),
        ("map", "--axis", "Z", "--length", "1", "-o"),
    ],
)  # fmt: skip
def test_names_are_no_mathematics_and_no_longer_than_the_page(command, tmp_path, arguments):
    (tmp_path / "m.yaml").write_text(
        f"name: 'Mill $_$ {25 * 'wide '}'\ninterval: 0.001\npositioning: linear\naxes:\n"
        "  Z: {rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}, modes: "
        "[{name: 'a $_{ mode$', frequency: 30, damping: 0, participation: 1}]}\n"
    )
    assert command(*arguments, "p.png", "-m", "m.yaml")[0] == 0
    assert (tmp_path / "p.png").stat().st_size > 10_000

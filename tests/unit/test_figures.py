"""What figures say, line by line: no word over another, everything named, every line there."""

import functools
from itertools import combinations

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from gcodejerk.machine import Machine, find_machine
from gcodejerk.report.map_figure import ONE, THREE, draw_conditions, draw_map
from gcodejerk.studies.amplitude_map import Survey

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
    box = text.get_window_extent()
    text.set_rotation(angle)
    upright = np.array([[box.x0, box.y0], [box.x1, box.y0], [box.x1, box.y1], [box.x0, box.y1]])
    turned = text.get_window_extent()
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
    assert "nulls of 9, 32 Hz (Condition III): too many to be drawn" in words
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

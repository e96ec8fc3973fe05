"""The page in a browser, opened as a file: read, sorted, filtered, chosen in, drawn and printed.

Debian's chromium is driven over WebDriver by its own chromedriver, so that both are of one version,
and nothing is fetched at test time. Each test ends with a look at the console and at the requests.
"""

import base64
import json
import shutil
import time

import numpy as np
import pytest

from gcodejerk.machine import Machine, find_machine
from gcodejerk.report.page.document import write_page
from gcodejerk.rewrite.pipeline import process

BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        BROWSER is None or DRIVER is None,
        reason="there is no chromium with its chromedriver (Debian: chromium, chromium-driver)",
    ),
]
webdriver = pytest.importorskip("selenium.webdriver", reason="there is no selenium to drive it")

DESKTOP, PHONE = (1280, 900), (360, 740)
VMC = find_machine("vmc").read_text()
HEAD = "G21 G90 G94 G17 G64 P0.01\nG1 X0 Y0 Z0 F200\n"
MODES_OF_X = VMC[VMC.index("    modes:") : VMC.index("  Y:")]
EVIL = "G0 Z9 (<img src=http://127.0.0.1/x onerror=alert1></script>)\n"


def many_rapids():
    """A program of more than one page of the table, with rapids left alone."""
    lines = [HEAD]
    for k in range(20):
        lines.append(
            f"G0 X{-3 * k} Y{-5 * (k % 4)}\nG0 Z{-1 - k % 3}\nG1 X{-3 * k - 2} F100\nG0 Z5\n"
        )
    return "".join([*lines, "/G0 X-9\n", EVIL, "G81 X1 Z-5 R2 F100\nX2\nG80\nM2\n"]).encode()


PROGRAMS = {
    "many": (many_rapids(), VMC, {}),
    "own": (
        (HEAD.replace("G21", "G20") + "G0 X1.5 Y-0.5\nG0 Z1.\nM2\n").encode(),
        VMC.replace("positioning: linear", "positioning: independent"),
        {"controller": "csv"},
    ),
    "spectrum": (
        (HEAD + "G0 X-20\nG0 X-50 Y-30\nM2\n").encode(),
        VMC.replace(MODES_OF_X, "    spectrum: x.csv\n"),
        {},
    ),
    "named": (
        many_rapids(),
        VMC.replace("name: rocking", f"name: {'rocking_of_the_column_' * 2}W"),
        {},
    ),
    "none": (b"G21 G90 G1 X0 F100\nM2\n", VMC, {}),
    "unknown": (b"G21 G90\nG0 X1\nM2\n", VMC, {}),
    "left": (b"G21 G91\nG0 X1\nM2\n", VMC, {}),
}


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Addresses of pages and their results, by name."""
    folder = tmp_path_factory.mktemp("pages dir ü")
    lines = [f"{f},{1 / ((f**2 - 55**2) ** 2 + (5.5 * f) ** 2):.6g}" for f in range(20, 120)]
    (folder / "x.csv").write_text("\n".join(["frequency,psd", *lines]) + "\n")
    out = {}
    for name, (data, text, options) in PROGRAMS.items():
        (folder / f"{name}.yaml").write_text(text)
        machine = Machine.load(folder / f"{name}.yaml")
        result = process(data, machine, name=f"{name}.ngc", **options)
        source = folder / f"{name}.ngc"
        source.write_bytes(data)
        path = folder / f"{name}.html"
        with path.open("wb") as file, source.open("rb") as program:
            write_page(file, result, machine, "out.ngc", program, len(result.output))
        out[name] = (path.as_uri(), result)
    return out


class Browser:
    """One window, and what a reader does with it."""

    def __init__(self, driver):
        self.driver = driver

    def open(self, url, size=DESKTOP, theme="light"):
        command = self.driver.execute_cdp_cmd
        width, height = size
        command(
            "Emulation.setDeviceMetricsOverride",
            {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": size == PHONE},
        )
        features = [
            {"name": "prefers-color-scheme", "value": theme},
            {"name": "prefers-reduced-motion", "value": "reduce"},
        ]
        command("Emulation.setEmulatedMedia", {"features": features})
        self.driver.get(url)
        self.settle()

    def settle(self):
        """Two frames, so that all that waits is drawn."""
        self.driver.execute_async_script(
            "const done = arguments[0];"
            "requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done)));"
        )

    def js(self, script, *arguments):
        return self.driver.execute_script(script, *arguments)

    def all(self, selector):
        return self.driver.find_elements("css selector", selector)

    def one(self, selector):
        return self.driver.find_element("css selector", selector)

    def column(self, place):
        return [cell.text for cell in self.all(f"#table tbody tr > :nth-child({place})")]

    def keys(self, *names):
        from selenium.webdriver.common.action_chains import ActionChains
        from selenium.webdriver.common.keys import Keys

        chain = ActionChains(self.driver)
        for name in names:
            chain.send_keys(getattr(Keys, name, name))
        chain.perform()

    def colours(self, selector):
        """How many different colours a canvas has."""
        return self.js(
            "const c = document.querySelector(arguments[0]);"
            "const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
            "const s = new Set(); for (let i = 0; i < d.length; i += 4)"
            " s.add(d[i] << 16 | d[i + 1] << 8 | d[i + 2]); return s.size",
            selector,
        )

    def complaints(self):
        """What the console says, and every request but those for the file itself."""
        said = [entry["message"] for entry in self.driver.get_log("browser")]
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                url = message["params"]["request"]["url"]
                if not url.startswith(("file:", "data:")):
                    said.append(url)
        return said


@pytest.fixture(scope="module")
def browser():
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = BROWSER
    for argument in (
        *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"),
        *("--disable-background-networking", "--no-first-run", "--disable-component-update"),
    ):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    driver.set_script_timeout(20)
    yield Browser(driver)
    driver.quit()


@pytest.fixture(autouse=True)
def no_complaints(browser):
    browser.complaints()
    yield
    assert browser.complaints() == []


@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_a_reader_opens_sorts_filters_and_chooses(browser, pages, size):
    browser.open(pages["many"][0], size)
    assert browser.js("return document.documentElement.scrollWidth") <= size[0]
    assert "rapids were rewritten" in browser.one(".sentence").text
    assert len(browser.all("#table tbody tr")) == 25
    after = 5
    numbers = [float(text) for text in browser.column(after)]
    assert numbers == sorted(numbers, reverse=True)
    head = browser.one("#table thead th:nth-child(1)")
    head.find_element("css selector", "button").click()
    assert head.get_attribute("aria-sort") == "ascending"
    lines = [int(text) for text in browser.column(1)]
    assert lines == sorted(lines)
    head.find_element("css selector", "button").click()
    assert head.get_attribute("aria-sort") == "descending"

    row = browser.all("#table tbody tr")[4]
    row.click()
    browser.settle()
    assert len(browser.all("#table tr[aria-current]")) == 1
    line = browser.one("#table tr[aria-current] th").text
    assert browser.one("#chosen-title").text == f"Rapid of line {line}"
    assert f"Line {line}," in browser.one("#said").get_attribute("textContent")

    reason = browser.all(".show")[0]
    browser.js("arguments[0].scrollIntoView()", reason)
    reason.click()
    browser.settle()
    count = browser.one("#count").text
    assert count == f"{len(browser.all('#table tbody tr'))} of 64 rapids"
    browser.one("#filter button[type=reset]").click()
    browser.settle()
    assert browser.one("#count").text.startswith("64 rapids; rows 1 to 25")
    browser.one("#filter-lines").send_keys("3-5")
    assert sorted(browser.column(1)) == ["3", "4"]
    browser.one("#filter-text").send_keys("nothing like it")
    assert "No rapid matches" in browser.one("#table tbody").text


def test_the_keyboard_alone_is_enough(browser, pages):
    browser.open(pages["many"][0])
    browser.js("document.querySelector('#table tbody button').focus()")
    first = browser.one("#chosen-title").text
    browser.keys("ARROW_DOWN")
    second = browser.one("#chosen-title").text
    assert second != first
    assert browser.js("return document.activeElement.closest('tr').ariaCurrent") == "true"
    browser.keys("END")
    assert browser.one("#pages span").text == "page 3 of 3"
    browser.keys("HOME")
    assert browser.one("#chosen-title").text == first
    browser.js("document.querySelector('#space-view canvas').focus()")
    before = browser.js("return document.querySelector('#space-view canvas').toDataURL()")
    browser.keys("ARROW_LEFT", "+")
    browser.settle()
    assert browser.js("return document.querySelector('#space-view canvas').toDataURL()") != before


def test_every_picture_and_control_has_a_name(browser, pages):
    browser.open(pages["many"][0])
    for canvas in browser.all(".view canvas"):
        assert "rapids are rewritten" in canvas.get_attribute("aria-label")
    assert "Acceleration along the path" in browser.one("#acceleration").get_attribute("aria-label")
    assert "after arrival at" in browser.one("#vibration").get_attribute("aria-label")
    nameless = browser.js(
        "return [...document.querySelectorAll('button, select, input')].filter((e) =>"
        " !(e.textContent.trim() || e.getAttribute('aria-label') || (e.labels || []).length))"
        ".map((e) => e.outerHTML)"
    )
    assert nameless == []
    assert all(cell.get_attribute("scope") == "col" for cell in browser.all("#table thead th"))


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_click_on_the_path_chooses_and_both_themes_are_drawn(browser, pages, theme):
    from selenium.webdriver.common.action_chains import ActionChains

    browser.open(pages["many"][0], theme=theme)
    assert browser.colours("#top-view canvas") > 10
    assert browser.colours("#space-view canvas") > 10
    assert len(browser.all(".chart canvas")) == 2
    paper = browser.js("return getComputedStyle(document.body).backgroundColor")
    assert (paper == "rgb(255, 255, 255)") == (theme == "light")
    browser.js("window.gcodejerkReport.choose(0)")
    title = browser.one("#chosen-title").text
    canvas = browser.one("#top-view canvas")
    browser.js("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", canvas)
    for part in (0.3, 0.1, -0.1, -0.3):
        chain = ActionChains(browser.driver)
        chain.move_to_element_with_offset(canvas, int(part * canvas.size["width"]), 0)
        chain.click().perform()
    browser.settle()
    assert browser.one("#chosen-title").text != title


@pytest.mark.parametrize("name", ["none", "left", "own"])
@pytest.mark.parametrize("size", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_pages_with_little_on_them(browser, pages, name, size):
    browser.open(pages[name][0], size)
    assert browser.js("return document.documentElement.scrollWidth") <= size[0]
    shown = browser.one("main").text
    assert {"none": "no rapids", "left": "No curves", "own": "thou"}[name] in shown
    if name == "own":
        choice = browser.one("#axis")
        choice.find_element("css selector", "option:nth-child(2)").click()
        assert "of Y over time" in browser.one("#acceleration").get_attribute("aria-label")


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_a_mode_of_a_long_name_stands_beside_the_head_of_its_curve(browser, pages, size):
    browser.open(pages["named"][0], size)
    head, choice = browser.one("#vibration-title"), browser.one("#mode")
    assert "column_rocking" in choice.get_attribute("title")
    middle = choice.rect["y"] + choice.rect["height"] / 2
    assert head.rect["y"] < middle < head.rect["y"] + head.rect["height"]
    assert browser.js("return document.documentElement.scrollWidth <= innerWidth")
    assert head.rect["x"] + head.rect["width"] <= choice.rect["x"]
    assert choice.rect["x"] + choice.rect["width"] <= size[0]
    assert browser.one("#mode-choice").rect["height"] < choice.rect["height"] + 2


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
def test_the_heads_of_the_table_do_not_run_into_each_other(browser, pages, size):
    browser.open(pages["many"][0], size)
    wide = browser.js(
        "return [...document.querySelectorAll('.rapids thead button')]"
        ".filter((b) => b.scrollWidth > b.clientWidth).map((b) => b.textContent)"
    )
    assert wide == []


def test_a_length_that_is_not_known_has_no_unit(browser, pages):
    browser.open(pages["unknown"][0])
    assert browser.column(3) == ["\N{EN DASH}"]
    browser.one("#table tbody th button").click()
    assert "not known" in browser.one("#facts").text
    assert "deg" not in browser.one("#facts").text


def response(profiles, k, way, pole, times):
    """z(t), the integral of a(s) exp(pole (t - s)), as a sum over the steps of one profile."""
    begin, end = profiles.first[k : k + 2]
    t0, d = profiles.begin[begin:end], profiles.duration[begin:end]
    a, j = profiles.acceleration[begin:end], profiles.jerk[begin:end]
    edges = np.append(t0, t0[-1] + d[-1])
    da = np.diff(np.concatenate([[0.0], np.column_stack([a, a + j * d]).ravel(), [0.0]]))[::2]
    dj = np.diff(np.concatenate([[0.0], j, [0.0]]))
    out = np.zeros(len(times), dtype=complex)
    for tk, x, y in zip(edges, da, dj, strict=True):
        h = np.maximum(times - tk, 0.0)
        e = np.exp(pole * h)
        step = x * (e - 1.0) / pole + y * ((e - 1.0) / pole - h) / pole
        out += np.where(times > tk, step, 0.0)
    return way * out


@pytest.mark.parametrize("name", ["many", "own", "spectrum"])
def test_vibration_in_the_page_is_that_of_the_profiles(browser, pages, name):
    url, result = pages[name]
    browser.open(url)
    plans = result.plans
    modes = plans.modes
    checked = 0
    for rapid in np.flatnonzero(plans.planned)[:: 12 if name == "many" else 1].tolist():
        times = np.linspace(0.0, 1.7 * plans.times[rapid], 97)
        for mode in plans.excited(rapid):
            members = np.flatnonzero(modes.group == mode)
            for when, profiles in (("before", plans.conventional), ("after", plans.profiles)):
                shown = browser.js(
                    "const r = window.gcodejerkReport, [i, when, mode, times] = arguments;"
                    "return Array.from(r.vibration(r.carriedBy(i, when), r.modes, mode, times))",
                    *(rapid, when, mode, times.tolist()),
                )
                z = np.array([
                    sum(response(profiles, k, plans.share[k] @ modes.participation[m],
                                 modes.poles[m], times) for k in plans.profiles_of(rapid))
                    / modes.poles[m].imag
                    for m in members
                ])  # fmt: skip
                # The lines of a spectrum count together: the envelope of them all.
                own = -z[0].imag if len(z) == 1 else np.sqrt((np.abs(z) ** 2).sum(axis=0))
                assert shown == pytest.approx(own, abs=1e-6 * np.abs(own).max())
                checked += 1
    assert checked >= 4


def test_it_prints_on_paper(browser, pages):
    browser.open(pages["many"][0], theme="dark")
    start = time.monotonic()
    pdf = base64.b64decode(browser.driver.print_page())
    assert pdf.startswith(b"%PDF")
    assert len(pdf) > 20_000
    assert time.monotonic() - start < 30
    paper = browser.js("return getComputedStyle(document.body).backgroundColor")
    assert paper != "rgb(255, 255, 255)", "the screen has its theme again"

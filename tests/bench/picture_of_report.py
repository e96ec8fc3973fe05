"""The picture of the page in docs/report.md: plate.ngc on the machine vmc, in Debian's chromium.

Run it where the page has changed: ``python tests/bench/picture_of_report.py``.
"""

import base64
import io
import tempfile
from pathlib import Path

from PIL import Image
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

from gcodejerk.machine import Machine, find_machine
from gcodejerk.report.page.document import write_page
from gcodejerk.rewrite.pipeline import process

ROOT = Path(__file__).parents[2]
PICTURE = ROOT / "docs" / "report.png"
WIDTH, HEIGHT = 1180, 1940
COLOURS = 256


def page(folder):
    """The page, as a file in a folder."""
    data = (ROOT / "samples" / "plate.ngc").read_bytes()
    machine = Machine.load(find_machine("vmc"))
    result = process(data, machine, name="plate.ngc")
    path = Path(folder) / "plate.html"
    with path.open("wb") as file:
        write_page(file, result, machine, "plate.jerk.ngc", io.BytesIO(data), len(result.output))
    return path


def main():
    """Open the page, and keep what is seen of it."""
    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    for argument in ("--headless=new", "--no-sandbox", "--hide-scrollbars"):
        options.add_argument(argument)
    with tempfile.TemporaryDirectory() as folder:
        driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
        size = {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False}
        driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        driver.get(page(folder).as_uri())
        driver.execute_async_script(
            "const done = arguments[0];"
            "requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done, 100)))"
        )
        shown = driver.execute_cdp_cmd("Page.captureScreenshot", {})["data"]
        driver.quit()
    picture = Image.open(io.BytesIO(base64.b64decode(shown))).convert("RGB")
    picture = picture.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    picture.save(PICTURE, optimize=True)
    print(f"{PICTURE}: {PICTURE.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()

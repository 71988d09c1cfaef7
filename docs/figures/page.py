"""The picture of a run's page in the README: ``python docs/figures/page.py runs/src-dish_seed3.html run_page.png``.

Not made with the site, because it needs a browser: Debian's chromium, driven by playwright.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

WIDTH_PX, HEIGHT_PX = 1100, 1240


def main() -> None:
    """Photograph the top of a page, in few colours."""
    page_path, out = Path(sys.argv[1]).resolve(), Path(sys.argv[2])
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": WIDTH_PX, "height": HEIGHT_PX}, color_scheme="light")
        page.goto(page_path.as_uri())
        page.screenshot(path=out)
        browser.close()
    with Image.open(out) as taken:
        taken.convert("RGB").quantize(96).save(out, optimize=True)


if __name__ == "__main__":
    main()

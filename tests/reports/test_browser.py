"""The page in a browser, from disk and with the network off: nothing leaves, nothing is complained of, all works.

Real runs: the dish, and a door with the biggest crew. The system's Chromium is used; without one these tests fail.
"""

import json
import shutil
from contextlib import contextmanager

import pytest
from playwright.sync_api import sync_playwright

from teleop_sim.core.records import PacketEnded, RunStarted, Scored
from teleop_sim.log.writer import LogWriter
from teleop_sim.reports.page import write_run
from teleop_sim.reports.sweep_page import write_sweep_view
from teleop_sim.run import run_scenario
from teleop_sim.scenarios.files import load_scenario

RUNS = {"dish": ("src-dish", {"autonomy": "low"}), "door": ("drc-door-day1", {})}
MOST_BYTES = 3_000_000
LEAST_CONTRAST = 4.5
"""WCAG 2.2, success criterion 1.4.3, of text."""
LEAST_TARGET_PX = 24
"""WCAG 2.2, success criterion 2.5.8, of what is pressed."""
EVIL = "</script><script>window.evil = 1</script><img src=x onerror='window.evil = 1'>"


@pytest.fixture(scope="module")
def browser():
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    assert found, "no chromium on the path: install the system's (Debian: apt-get install chromium)"
    with sync_playwright() as playwright:
        # A container's root has no sandbox; the page is our own.
        started = playwright.chromium.launch(executable_path=found, args=["--no-sandbox"])
        yield started
        started.close()


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    made = {}
    for name, (scenario, changes) in RUNS.items():
        done = run_scenario(load_scenario(scenario, changes), 3, folder)
        [made[name]] = write_run(done.log)
    return made


@pytest.fixture
def look(browser):
    """Open a page; at the end: only it was asked for, nothing was complained of, and its policy was kept."""

    @contextmanager
    def opened(path, width=1200, height=900, **settings):
        told = []
        context = browser.new_context(viewport={"width": width, "height": height}, offline=True, **settings)
        page = context.new_page()
        page.on("console", lambda message: told.append(f"console {message.type}: {message.text}"))
        page.on("pageerror", lambda error: told.append(f"error: {error}"))
        page.on("request", lambda request: told.append(request.url))
        page.add_init_script(
            "addEventListener('securitypolicyviolation', e => console.error('policy', e.violatedDirective))"
        )
        page.goto(path.as_uri())
        settled(page)
        yield page
        settled(page)
        context.close()
        assert told == [path.as_uri()]

    return opened


def settled(page):
    """Until what was asked to be drawn is drawn."""
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def shown(page):
    """From, to [s] of the timeline."""
    settled(page)
    data = page.locator(".lanes").evaluate("box => [box.dataset.from, box.dataset.to]")
    return tuple(map(float, data))


def span(page):
    start, end = shown(page)
    return end - start


def axis_width(page):
    """Width of the timeline's axis [pixel]."""
    return float(page.locator(".lanes").get_attribute("data-wide"))


@pytest.mark.parametrize("name", RUNS)
def test_a_page_is_small_and_has_all_its_parts(pages, look, name):
    assert pages[name].stat().st_size < MOST_BYTES
    with look(pages[name]) as page:
        titles = page.locator("main h2").all_text_contents()
        assert titles[0] == "Timeline"
        assert {"States", "Packets by topic", "Where the time went"} <= set(titles)
        links = page.locator("nav a").all_text_contents()
        assert links == titles
        lanes = page.locator(".fold").all_text_contents()
        assert {"Events", "Machine", "Robot", "Operators", "Level of autonomy", "Downlink"} <= set(lanes)
        assert "teleop-sim report" in page.locator("footer").inner_text()


def test_the_timeline_zooms_by_wheel_button_and_key_and_goes_back(pages, look):
    with look(pages["door"]) as page:
        whole = shown(page)
        assert whole[0] == 0.0
        box = page.locator(".lanes")
        # Not before the reader has clicked into it: the page scrolls.
        box.hover(position={"x": 700, "y": 60})
        page.mouse.wheel(0, -300)
        assert shown(page) == whole
        page.mouse.wheel(0, 300)
        box.click(position={"x": 700, "y": 60})
        page.mouse.wheel(0, -600)
        by_wheel = shown(page)
        assert by_wheel[0] > 0.0
        assert by_wheel[1] < whole[1]
        page.get_by_role("button", name="Show all").click()
        assert shown(page) == whole
        page.get_by_role("button", name="Zoom in").click()
        assert span(page) == pytest.approx(whole[1] / 2)
        page.get_by_role("button", name="Later").click()
        assert shown(page)[0] > whole[1] / 4
        box.focus()
        page.keyboard.press("0")
        assert shown(page) == whole
        page.keyboard.press("+")
        page.keyboard.press("ArrowRight")
        after = shown(page)
        assert after[1] - after[0] < whole[1]
        page.keyboard.press("-")
        page.keyboard.press("-")
        assert shown(page) == whole
        for _ in range(40):
            page.keyboard.press("+")
        # Ticks go down to a tenth of a second and below.
        assert 0.0 < span(page) < 0.1
        assert "." in page.locator(".range").inner_text()


def test_the_time_under_the_pointer_stays_when_zooming_and_moves_with_a_drag(pages, look):
    with look(pages["dish"]) as page:
        box = page.locator(".lanes")
        box.click(position={"x": 800, "y": 60})
        before = page.locator(".cross span").inner_text()
        page.mouse.wheel(0, -500)
        settled(page)
        at = box.bounding_box()
        page.mouse.move(at["x"] + 800, at["y"] + 61)
        after = page.locator(".cross span").inner_text()
        assert after.startswith(before.split(".")[0])
        start = shown(page)
        page.mouse.down()
        page.mouse.move(at["x"] + 700, at["y"] + 61, steps=4)
        page.mouse.up()
        moved = shown(page)
        assert moved[0] > start[0]
        assert moved[1] - moved[0] == pytest.approx(start[1] - start[0])


def test_a_bar_tells_what_it_is_to_mouse_and_keys(pages, look):
    with look(pages["dish"]) as page:
        tip = page.locator(".tip")
        assert tip.is_hidden()
        box = page.locator(".lanes")
        box.focus()
        page.keyboard.press("ArrowDown")
        page.keyboard.press("ArrowDown")
        assert "STATE_" in tip.inner_text()
        first = tip.inner_text()
        page.keyboard.press(".")
        assert tip.inner_text() != first
        assert page.locator(".said").inner_text().startswith("Machine: STATE_")
        page.keyboard.press("Escape")
        assert tip.is_hidden()
        data = json.loads(page.locator("#timeline--data").text_content())
        bars = next(found for found in data["lanes"] if found["name"] == "machine")["bars"]
        canvas = page.locator("[data-lane=machine] canvas").last
        canvas.scroll_into_view_if_needed()
        size = canvas.bounding_box()
        wide = axis_width(page)
        left = size["width"] - wide
        for number in (2, 5, 8, 11):
            middle_s = (sum(bars["start"][: number + 1]) + bars["took"][number] / 2) / 1e6
            x = left + wide * middle_s / data["end_s"]
            # Rows of 15 pixels, the first 2 below the top.
            page.mouse.move(size["x"] + x, size["y"] + 2 + 15 * bars["row"][number] + 7)
            assert tip.inner_text().splitlines()[0] == data["texts"][bars["text"][number]].splitlines()[0]


def test_lanes_fold(pages, look):
    with look(pages["dish"]) as page:
        fold = page.locator("[data-lane=machine] .fold")
        canvas = page.locator("[data-lane=machine] canvas").last
        assert fold.get_attribute("aria-expanded") == "true"
        fold.focus()
        page.keyboard.press("Enter")
        assert fold.get_attribute("aria-expanded") == "false"
        assert canvas.is_hidden()
        fold.click()
        assert canvas.is_visible()


def test_fingers_move_pinch_and_tap(pages, look):
    with look(pages["dish"], width=400, height=800, has_touch=True, is_mobile=True) as page:
        whole = shown(page)
        lane = page.locator("[data-lane=machine] canvas").last
        lane.scroll_into_view_if_needed()
        at = lane.bounding_box()
        session = page.context.new_cdp_session(page)

        def touch(kind, *xs):
            points = [{"x": at["x"] + x, "y": at["y"] + 40, "id": i} for i, x in enumerate(xs)]
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

        touch("touchStart", 150)
        touch("touchStart", 150, 200)
        for spread in range(0, 100, 20):
            touch("touchMove", 150 - spread, 200 + spread)
        touch("touchEnd")
        pinched = shown(page)
        assert pinched[1] - pinched[0] < whole[1] / 2
        touch("touchStart", 200)
        for x in range(200, 100, -20):
            touch("touchMove", x)
        touch("touchEnd")
        assert shown(page)[0] > pinched[0]
        page.get_by_role("button", name="Show all").tap()
        data = json.loads(page.locator("#timeline--data").text_content())["lanes"]
        bars = next(found for found in data if found["name"] == "robot")["bars"]
        wide = max(range(len(bars["took"])), key=lambda i: bars["took"][i])
        middle_s = (sum(bars["start"][: wide + 1]) + bars["took"][wide] / 2) / 1e6
        robot = page.locator("[data-lane=robot] canvas").last
        robot.scroll_into_view_if_needed()
        # On a narrow screen a name of 13 pixels stands above each row of 15.
        y = 2 + (bars["row"][wide] + 1) * (13 + 15) - 7
        robot.tap(position={"x": robot.bounding_box()["width"] * middle_s / whole[1], "y": y})
        assert page.locator(".tip").is_visible()


def column(page, table, number):
    cells = page.locator(f"{table} tbody tr").evaluate_all(
        "(rows, n) => rows.map(r => r.cells[n].dataset.v ?? r.cells[n].innerText)", number
    )
    return [cell for cell in cells if cell != ""]


def test_tables_sort_by_mouse_and_keys(pages, look):
    with look(pages["dish"]) as page:
        table = "#states table"
        as_written = column(page, table, 0)
        headings = page.locator(f"{table} thead tr").last.locator("th")
        number = page.locator(f"{table} thead tr").last.locator("th.n").count()
        assert number > 3
        time = next(i for i in range(headings.count()) if headings.nth(i).inner_text().startswith("time"))
        headings.nth(time).locator("button").click()
        assert headings.nth(time).get_attribute("aria-sort") == "descending"
        down = [float(cell) for cell in column(page, table, time)]
        assert down == sorted(down, reverse=True)
        headings.nth(time).locator("button").focus()
        page.keyboard.press("Enter")
        assert headings.nth(time).get_attribute("aria-sort") == "ascending"
        up = [float(cell) for cell in column(page, table, time)]
        assert up == sorted(up)
        headings.nth(0).locator("button").click()
        assert headings.nth(time).get_attribute("aria-sort") == "none"
        names = column(page, table, 0)
        assert [name.lower() for name in names] == sorted(name.lower() for name in as_written)


CONTRASTS = """() => {
  const parse = (text) => {
    const canvas = document.createElement('canvas'); canvas.width = canvas.height = 1;
    const ctx = canvas.getContext('2d', { willReadFrequently: true });
    ctx.fillStyle = text; ctx.fillRect(0, 0, 1, 1);
    return [...ctx.getImageData(0, 0, 1, 1).data];
  };
  const light = ([r, g, b]) => {
    const part = (v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
    return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
  };
  const paper = parse(getComputedStyle(document.body).backgroundColor);
  const over = (top, below) => top.slice(0, 3).map((v, i) => (v * top[3] + below[i] * (255 - top[3])) / 255);
  const ratio = (one, two) => {
    const [high, low] = [light(one), light(two)].sort((a, b) => b - a);
    return (high + 0.05) / (low + 0.05);
  };
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const own = parse(getComputedStyle(e).backgroundColor);
      if (own[3] === 255) return own;
    }
    return paper;
  };
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const element = node.parentElement;
    if (!node.textContent.trim() || element.closest('script, noscript') || !element.checkVisibility()) continue;
    const style = getComputedStyle(element);
    let ground = paper;
    if (element.closest('svg')) {
      const at = element.getBoundingClientRect();
      const below = document.elementsFromPoint(at.x + at.width / 2, at.y + at.height / 2);
      const shape = below.find((e) => e.closest('svg') && !['text', 'tspan', 'svg'].includes(e.tagName)
        && getComputedStyle(e).fill !== 'none');
      ground = behind(element);
      if (shape) ground = over(parse(getComputedStyle(shape).fill), ground);
    } else {
      ground = behind(element);
    }
    const ink = over(parse(element.closest('svg') ? style.fill : style.color), ground);
    found.push([ratio(ink, ground), node.textContent.trim().slice(0, 40)]);
  }
  for (const ink of ['ink', 'muted', 'link', 'good', 'bad']) {
    for (const ground of ['paper', 'shade', 'tip']) {
      const value = (name) => parse(getComputedStyle(document.documentElement).getPropertyValue('--' + name));
      found.push([ratio(value(ink), value(ground)), ink + ' on ' + ground]);
    }
  }
  return found;
}"""


def poor_texts(page):
    """Texts that do not stand out enough; all of the page is in view, as only what is can be asked what lies there."""
    page.set_viewport_size({"width": 1200, "height": page.evaluate("document.documentElement.scrollHeight")})
    measured = page.evaluate(CONTRASTS)
    assert len(measured) > 50
    return [(round(ratio, 2), text) for ratio, text in measured if ratio < LEAST_CONTRAST]


@pytest.mark.parametrize("name", RUNS)
def test_light_and_dark_read_well_and_the_button_changes_them(pages, look, name):
    grounds = []
    with look(pages[name], color_scheme="light") as page:
        for theme in ("light", "dark"):
            grounds.append(page.evaluate("getComputedStyle(document.body).backgroundColor"))
            assert poor_texts(page) == [], theme
            page.locator("#theme").click()
            settled(page)
    assert len(set(grounds)) == 2
    with look(pages[name], color_scheme="dark") as page:
        assert page.evaluate("getComputedStyle(document.body).backgroundColor") == grounds[1]


def small_targets(page):
    """What is pressed and too small for a finger."""
    return page.evaluate(
        """(least) => [...document.querySelectorAll('button, summary, nav a, th button')]
          .filter(e => e.checkVisibility())
          .map(e => [e.textContent, e.getBoundingClientRect()])
          .filter(([_, at]) => at.width < least || at.height < least)
          .map(([text, at]) => `${text} ${at.width} x ${at.height}`)""",
        LEAST_TARGET_PX,
    )


@pytest.mark.parametrize("name", RUNS)
def test_it_is_usable_at_400_pixels(pages, look, name):
    with look(pages[name], width=400, height=800, has_touch=True, is_mobile=True) as page:
        assert page.evaluate("document.documentElement.scrollWidth") == 400
        assert small_targets(page) == []
        # What is wider scrolls in its own box, its first column stays, and keys reach it.
        box = page.locator("#packets .scroll")
        assert box.evaluate("box => box.scrollWidth > box.clientWidth && box.tabIndex === 0")
        first = box.locator("tbody th").first
        before = first.bounding_box()["x"]
        box.evaluate("box => { box.scrollLeft = 120; }")
        assert first.bounding_box()["x"] == pytest.approx(before, abs=1.0)


def test_a_sweep_s_page_does_as_well(tmp_path, look, make_sweep):
    sweep = make_sweep({"latency_s": [0.0, 2.0, 10.0], "autonomy": ["off", "full"]})
    [file] = write_sweep_view(sweep, tmp_path, "sweep", ("html",))
    for theme in ("light", "dark"):
        with look(file, color_scheme=theme) as page:
            assert poor_texts(page) == [], theme
    with look(file, width=400, height=800, has_touch=True, is_mobile=True) as page:
        assert page.evaluate("document.documentElement.scrollWidth") == 400
        assert small_targets(page) == []
        heading = page.locator("#cells thead tr").last.locator("th").first
        heading.locator("button").tap()
        assert heading.get_attribute("aria-sort") != "none"


def test_what_a_log_says_does_not_run(tmp_path, look):
    path = tmp_path / "run.mcap"
    with LogWriter(path) as log:
        log(RunStarted(0.0, EVIL, "", 1, 0, 9.0, EVIL))
        log(Scored(4.0, 1, EVIL))
    [file] = write_run(path)
    with look(file) as page:
        assert page.evaluate("window.evil === undefined")
        assert page.locator("h1").inner_text() == f"{EVIL}, seed 1"
        page.locator(".lanes").focus()
        page.keyboard.press("ArrowDown")
        assert EVIL in page.locator(".tip").inner_text()


def test_many_packets_are_one_page_too(tmp_path, look):
    """7,500 packets each way, three bars each: the page stays small and its timeline moves."""
    path = tmp_path / "run.mcap"
    with LogWriter(path) as log:
        log(RunStarted(0.0, "many", "", 1, 0, 9.0, ""))
        for n in range(7_500):
            for way in ("up", "down"):
                t_s = 0.5 * n
                times = (t_s, t_s + 0.1, t_s + 1.3, 0.1, 0.0, 0.2, 1.0)
                log(PacketEnded(t_s + 1.3, way, n, "log", 20, 200, *times, "delivered", "", f"words {n}"))
    [file] = write_run(path)
    assert file.stat().st_size < MOST_BYTES
    with look(file) as page:
        assert shown(page) == (0.0, pytest.approx(3750.8))
        page.get_by_role("button", name="Zoom in").click()
        assert span(page) == pytest.approx(1875.4)
        # An hour and more: with hours.
        assert page.locator(".range").inner_text() == "0:15:38 – 0:46:53"

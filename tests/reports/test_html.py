"""The page as text: what a log says is data in it, and nothing outside it is needed."""

import base64
import hashlib
import json
import re
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from teleop_sim.core.records import OperatorActed, PacketEnded, RunEnded, RunStarted, Scored, TransitionTaken
from teleop_sim.log.writer import LogWriter
from teleop_sim.reports.formats.files import Made
from teleop_sim.reports.formats.html import Page, json_text, page_html
from teleop_sim.reports.formats.web import chart_svg, embedded
from teleop_sim.reports.page import write_run
from teleop_sim.reports.parts import Chart, Column, Drawing, Picture, Pictures, Sheet
from teleop_sim.reports.style import NEUTRALS

EVIL = "</script><script>evil()</script><img src=x onerror=evil()>\"'&<!--{{ 7 * 7 }}"


class Reader(HTMLParser):
    """Elements with their attributes, texts, and whether they pair."""

    def __init__(self):
        super().__init__()
        self.elements, self.texts, self.ids = [], [], []

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        self.ids += [value for name, value in attributes if name == "id"]

    def handle_data(self, data):
        self.texts.append(data)


def read(page):
    reader = Reader()
    reader.feed(page)
    return reader


def shown(content, name="part"):
    return page_html(Page("t", "", "open", "", (), (Made(name, "Title", content),)))


def evil_log(path):
    nan = float("nan")
    with LogWriter(path) as log:
        log(RunStarted(0.0, EVIL, f"question = {json.dumps(EVIL)}\nrobot = {json.dumps(EVIL)}", 1, 0, 9.0, EVIL))
        log(OperatorActed(2.0, 1.0, EVIL, EVIL, 1, EVIL))
        row = (EVIL, 4, 32, 1.0, 1.0, 2.0, 0.0, 0.0, 0.5, 0.5, "delivered", "", EVIL)
        log(PacketEnded(2.0, "down", 1, *row))
        log(TransitionTaken(3.0, EVIL, EVIL, f"{EVIL}2", 0.0, "autonomous", "normal", 0, 0, 3, 0.0, EVIL))
        log(Scored(4.0, 1, EVIL))
        log(RunEnded(5.0, "failed", EVIL, nan, 0, 0))
    return path


def test_what_a_log_says_is_text(tmp_path):
    [page] = write_run(evil_log(tmp_path / "run.mcap"))
    reader = read(page.read_text())
    scripts = [attributes for tag, attributes in reader.elements if tag == "script"]
    assert scripts == [{"type": "application/json", "id": "timeline--data"}, {}]
    assert not [a for _, a in reader.elements if any(name.startswith("on") for name in a)]
    assert not [a for tag, a in reader.elements if tag == "img"]
    # The parser undoes the escaping: the name is shown as it is.
    assert any(text == f"{EVIL}, seed 1" for text in reader.texts)
    assert sum(EVIL in text for text in reader.texts) >= 5


def test_the_policy_allows_this_page_s_script_and_nothing_else(tmp_path):
    [page] = write_run(evil_log(tmp_path / "run.mcap"))
    text = page.read_text()
    policy = next(a["content"] for tag, a in read(text).elements if a.get("http-equiv") == "Content-Security-Policy")
    script = re.search(r"<script>(.*?)</script>", text, re.DOTALL)[1]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy.split("; ") == [
        "default-src 'none'",
        "style-src 'unsafe-inline'",
        f"script-src 'sha256-{digest}'",
        "img-src data:",
        "base-uri 'none'",
        "form-action 'none'",
    ]
    assert not re.search(r"\beval\(|new Function|innerHTML|document\.write", script)


@given(st.recursive(st.none() | st.booleans() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
                    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner), max_leaves=8))  # fmt: skip
def test_json_comes_back_and_cannot_end_its_element(value):
    text = json_text(value)
    assert json.loads(text) == value
    assert not set(text) & set("<>&\u2028\u2029")


def test_json_has_null_for_what_is_no_number():
    assert json_text({"a": [float("nan"), float("inf"), 1.5]}) == '{"a":[null,null,1.5]}'


def test_nothing_leads_out_of_the_page(tmp_path, make_run):
    log = tmp_path / "run.mcap"
    with LogWriter(log) as writer:
        for record in make_run(ask=True):
            writer(record)
    [page] = write_run(log)
    text = page.read_text()
    reader = read(text)
    for tag, attributes in reader.elements:
        for name in ("src", "href", "xlink:href", "action", "srcset", "data"):
            value = attributes.get(name)
            assert value is None or value.startswith(("#", "data:")), (tag, name, value)
    assert "@import" not in text
    assert not re.search(r"url\((?!#)", text)
    assert len(reader.ids) == len(set(reader.ids))
    targets = {a["href"][1:] for tag, a in reader.elements if tag == "a" and a.get("href", "").startswith("#")}
    assert targets <= set(reader.ids)


def test_a_table_sorts_by_full_numbers_and_leads_only_to_its_neighbours():
    links = {(0, 0): "a/run.html", (1, 0): "javascript:evil()", (2, 0): "https://example.org", (3, 0): "/etc/passwd"}
    columns = (Column("a", "A"), Column("b", "B", decimals=1, help="what <b> is"))
    rows = (("one", 1 / 3), ("two", None), ("three", 2.0), ("four", float("nan")))
    reader = read(shown(Sheet(columns, rows, links=links)))
    assert [a["href"] for tag, a in reader.elements if tag == "a" and a["href"][0] != "#"] == ["a/run.html"]
    cells = [a for tag, a in reader.elements if tag == "td"]
    assert [a.get("data-v") for a in cells] == ["0.3333333", None, "2", None]
    assert all(a["class"] == "n" for a in cells)
    headings = [a for tag, a in reader.elements if tag == "th" and a["scope"] == "col"]
    assert [a["aria-sort"] for a in headings] == ["none", "none"]
    assert any("what <b> is" in text for text in reader.texts)


def test_pictures_have_words():
    reader = read(shown(Pictures((Picture(b"\x89x", "image/png", "<state>"),))))
    [image] = [a for tag, a in reader.elements if tag == "img"]
    assert image == {"src": "data:image/png;base64,iXg=", "alt": "<state>"}


def figure():
    made = Figure(figsize=(3, 2))
    ax = made.subplots()
    ax.plot([0, 1], [0, 1], marker="o", label="a & b")
    ax.set_title('id="x" #010203 url(#y)', parse_math=False)
    ax.grid(True)
    ax.legend()
    ax.text(0.5, 0.5, "black", color="black")
    return made


def test_a_chart_takes_the_page_s_colours_and_clashes_with_no_other():
    one, two = (chart_svg(Chart(figure, "x"), prefix) for prefix in ("one", "two"))
    ids = re.findall(r' id="([^"]+)"', one)
    assert ids
    assert all(name.startswith("one-") for name in ids)
    used = re.findall(r'(?:url\(#|href="#)([^)"]+)', re.sub(r">[^<]*<", "><", one))
    assert used
    assert set(used) <= set(ids)
    # Texts stay as they are, though they look like references and colours.
    assert 'id="x" #010203 url(#y)' in one
    styles = " ".join(re.findall(r'style="([^"]*)"', one))
    assert "var(--ink)" in styles
    assert "var(--sans)" in styles
    assert not [colour for colour in NEUTRALS if colour in styles.lower()]
    assert not re.search(r'<svg[^>]* (width|height)="', one)
    assert 'viewBox="' in one
    assert one.replace("one-", "two-") == two


def test_a_picture_in_a_chart_stays():
    def draw():
        made = Figure(figsize=(3, 2))
        made.subplots().imshow([[0, 1], [1, 0]])
        return made

    assert re.search(r'<image [^>]*href="data:image/png;base64,', chart_svg(Chart(draw, "x"), "p"))


def test_a_drawing_cannot_run_or_lead_away():
    evil = (
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="72pt" height="9pt">'
        '<script>evil()</script><a xlink:href="https://example.org" onclick="evil()"><text id="t">x</text></a>'
        '<use href="#t"/></svg>'
    )
    made = embedded(evil.encode(), "d", neutral=False)
    assert "evil" not in made
    assert "example.org" not in made
    assert 'id="d-t"' in made
    assert 'href="#d-t"' in made
    assert "--wide: 6rem" in made


@pytest.mark.parametrize("content", [Drawing(lambda _: b'<svg xmlns="http://www.w3.org/2000/svg"/>', "what it shows")])
def test_figures_have_words(content):
    reader = read(shown(content))
    assert [a["aria-label"] for tag, a in reader.elements if tag == "figure"] == ["what it shows"]

"""The report page: whole, offline, and honest about what was not reached."""

import subprocess
from base64 import b64encode
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from cluster.comparison.html import page
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.summary import Reporting, Row
from tests import chromium


def rows(methods: dict[str, float], first_seed: int, runs: int = 2) -> list[Row]:
    """Runs of five trials each, of that objective."""
    return [
        Row(name, first_seed + run, index, f, success=False)
        for name, f in methods.items()
        for run in range(runs)
        for index in range(5)
    ]


def reaching(rows: list[Row]) -> list[Row]:
    """The same trials of another method, which all succeed."""
    return [replace(row, method="lucky", success=True) for row in rows if row.method == "se"]


def summary(rows: list[Row]):
    return summarize(rows, Reporting(), np.random.default_rng(0))


class Elements(HTMLParser):
    """Links and cells of a page; closing tags must match."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.cells: list[str] = []
        self.small: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.links += [value for name, value in attrs if name in {"src", "href", "data"}]
        if tag not in {"meta", "img"}:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in {"td", "small"}:
            (self.cells if self.open[-1] == "td" else self.small).append(data)
        if self.open[-2:] == ["tr", "th"] and "tbody" in self.open:
            self.cells.append(data)


def test_the_page_is_whole_and_loads_nothing_from_elsewhere(tmp_path):
    figure = tmp_path / "figure.png"
    figure.write_bytes(b"not really a picture")
    text = page("a < b", summary(rows({"se": 0.5, "random": -0.25}, 0)), [figure], 2, {"gap": "<paper>"})
    found = Elements(text)
    assert found.open == []
    assert found.links == ["data:image/png;base64," + b64encode(figure.read_bytes()).decode()]
    assert "http" not in text
    assert "<script" not in text
    assert "a &lt; b" in text
    assert "<paper>" in found.cells
    assert "tuning" not in text
    # Best first; intervals of equal values have no width.
    assert found.cells[:4] == ["se", "2", "+0.500", "+0.500"]
    assert found.small[:3] == ["[+0.500, +0.500]", "[+0.500, +0.500]", "0 of 2"]
    assert "+0.750" in found.cells
    assert "[+0.750, +0.750]" in found.small


def test_a_verdict_in_words_stands_above_the_first_table():
    apart = {"se": 0.5, "random": -0.25}
    text = page("title", summary(rows(apart, 0, runs=10)), [], 2, {})
    verdict = "se ends highest after 5 trials: it is better than random."
    assert 0 < text.index(verdict) < text.index("<table")
    assert "<li>se ends 0.75 above random (90 % interval 0.75 to 0.75, 10 paired runs): better.</li>" in text
    assert "better" in Elements(text).cells
    few = page("title", summary(rows(apart, 0)), [], 2, {})
    assert "too few runs to tell it from random" in few
    assert "too few runs" in Elements(few).cells


def test_the_page_says_so_when_nobody_reaches_the_threshold_or_seeds_are_for_tuning():
    text = page("title", summary(rows({"se": 0.5}, 1000)), [], 2, {})
    assert "not reached" in Elements(text).cells
    assert "0 of 2" in Elements(text).small
    assert "Nobody reached the threshold of success" in text
    assert "tuning seeds" in text


def test_the_page_is_silent_about_the_threshold_when_one_run_reaches_it():
    given = [*rows({"se": 0.5, "random": 0.1}, 0)]
    reached = page("title", summary([*given, *reaching(given)]), [], 2, {})
    assert "Nobody" not in reached
    assert "gave no objective" not in reached


def test_the_page_counts_trials_without_an_objective():
    given = [replace(row, f=float("nan")) if row.trial == 3 else row for row in rows({"se": 0.5}, 0)]
    text = page("title", summary(given), [], 2, {})
    assert "2 of 10 trials failed: they gave no objective. They teach no method anything" in text
    assert "2 of 10" in Elements(text).cells


def test_the_page_shows_a_method_without_a_whole_run_last_and_says_what_is_missing():
    given = [*rows({"se": 0.5}, 0), Row("botorch", 0, 0, 0.0, success=False)]
    text = page("title", summary(given), [], 2, {}, "1 run is missing")
    found = Elements(text)
    assert found.cells[0] == "se"
    last = found.cells.index("botorch")
    assert found.cells[last : last + 3] == ["botorch", "0", "–"]
    assert "1 not whole" in found.small
    assert "1 run is missing." in text


@pytest.mark.parametrize("f", [0.5, float("nan")])
def test_one_run_and_failed_ones_leave_no_nan_and_no_empty_interval_on_the_page(f):
    text = page("title", summary(rows({"se": 0.5, "random": f}, 0, runs=1)), [], 2, {})
    assert "nan" not in text
    assert "[" not in "".join(Elements(text).small)


WIDTHS = """<script>
const boxes = [document.documentElement, ...document.querySelectorAll("table.stacked")].map(
  each => each.matches("table") ? each.parentElement : each)
document.title = "cut: " + boxes.filter(each => each.scrollWidth > each.clientWidth).length
</script>"""


@pytest.mark.parametrize("width", [1300, 390])
def test_nothing_is_cut_on_a_screen_or_on_a_phone(width, tmp_path):
    rng = np.random.default_rng(0)
    names = ("random", "svae-dc-matern-acqf", "screened-random")
    given = [
        Row(name, run, index, -1000 * rng.random(), success=False)
        for name in names
        for run in range(6)
        for index in range(42)
    ]
    reporting = Reporting(broken_below=-500.0)
    figure = tmp_path / "figure.svg"
    figure.write_text('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 960 440"></svg>')
    settings = {"setup_digest": "0123456789abcdef" * 4, "a setting": "a value of several words " * 9}
    text = page("title", summarize(given, reporting, rng), [figure], 2, settings)
    path = tmp_path / "report.html"
    path.write_text(text.replace("</body>", f"{WIDTHS}</body>").replace("<details", "<details open"))
    options = (f"--user-data-dir={tmp_path / 'profile'}", f"--window-size={width},900")
    command = chromium.command(*options, "--dump-dom", path.as_uri())
    shown = subprocess.run(command, capture_output=True, text=True, check=True, timeout=240).stdout
    assert "<title>cut: 0</title>" in shown

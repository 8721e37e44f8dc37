"""The report page: whole, offline, and honest about what was not reached."""

from base64 import b64encode
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np

from cluster.comparison.html import page
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.summary import Reporting, Row


def rows(methods: dict[str, float], first_seed: int) -> list[Row]:
    """Two runs of five trials each, of that objective."""
    return [
        Row(name, first_seed + run, index, f, success=False)
        for name, f in methods.items()
        for run in range(2)
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
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.links += [value for name, value in attrs if name in {"src", "href", "data"}]
        if tag not in {"meta", "img"}:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] == "td":
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
    assert found.cells[:4] == ["se", "2", "0", "+0.500 [+0.500, +0.500]"]
    assert "+0.750 [+0.750, +0.750]" in found.cells


def test_the_page_says_so_when_nobody_reaches_the_threshold_or_seeds_are_for_tuning():
    text = page("title", summary(rows({"se": 0.5}, 1000)), [], 2, {})
    assert "not reached (0 of 2 runs)" in Elements(text).cells
    assert "Nobody reached the threshold of success" in text
    assert "tuning seeds" in text


def test_the_page_is_silent_about_the_threshold_when_one_run_reaches_it():
    given = [*rows({"se": 0.5, "random": 0.1}, 0)]
    reached = page("title", summary([*given, *reaching(given)]), [], 2, {})
    assert "Nobody" not in reached
    assert "gave no objective" not in reached


def test_the_page_explains_trials_without_an_objective():
    given = [replace(row, f=float("nan")) if row.trial == 3 else row for row in rows({"se": 0.5}, 0)]
    text = page("title", summary(given), [], 2, {})
    assert "Some trials gave no objective. They teach no method anything" in text
    # One of three suggested trials.
    assert Elements(text).cells[8] == "33%"


def test_the_page_shows_a_method_without_a_whole_run_last():
    given = [*rows({"se": 0.5}, 0), Row("botorch", 0, 0, 0.0, success=False)]
    cells = Elements(page("title", summary(given), [], 2, {})).cells
    assert cells[0] == "se"
    last = cells.index("botorch")
    assert cells[last : last + 4] == ["botorch", "0", "1", "–"]

"""The figure of a comparison: the same bytes every time, and every method told apart."""

import math
import re

import numpy as np
from matplotlib.markers import MarkerStyle

from cluster.comparison import figure
from svaedc.analysis.aggregation import best_of_runs, summarize
from svaedc.analysis.summary import Reporting, Row
from svaedc.bo.methods import names


def rows_of(runs: dict[str, int], trials: int = 5) -> list[Row]:
    rng = np.random.default_rng(0)
    return [
        Row(name, run, index, float(rng.uniform(-1, 1)), success=False)
        for name, count in runs.items()
        for run in range(count)
        for index in range(trials)
    ]


def drawn(path, rows: list[Row]):
    """The PNG and the SVG of a comparison."""
    summary = summarize(rows, Reporting(), np.random.default_rng(0))
    return figure.best_so_far(
        path, summary, best_of_runs(rows), title="some title", initial=2, limits=(-1.0, 1.0)
    )


def texts(path, rows: list[Row]) -> list[str]:
    """What is written in the figure."""
    return re.findall(r"<!-- (.*?) -->", drawn(path, rows)[1].read_text())


def paths(path, rows: list[Row], color: str) -> int:
    """How many lines have a colour."""
    return len(re.findall(f'style="fill: none; stroke: {color}', drawn(path, rows)[1].read_text()))


def test_the_figure_has_the_same_bytes_every_time_and_names_every_method(tmp_path):
    rows = rows_of(dict.fromkeys(names(), 6))
    for one, other in zip(drawn(tmp_path / "one.png", rows), drawn(tmp_path / "two.png", rows), strict=True):
        assert one.read_bytes() == other.read_bytes()
    assert set(names()) <= set(texts(tmp_path / "one.png", rows))


def test_how_many_runs_there_are_is_said_once_where_all_methods_have_as_many(tmp_path):
    same = texts(tmp_path / "same.png", rows_of({"random": 6, "se": 6}))
    assert [text for text in same if "n = " in text] == ["n = 6 runs each"]
    assert "shades and bars: 90 % intervals" in same
    other = texts(tmp_path / "other.png", rows_of({"random": 6, "se": 7}))
    assert {text for text in other if "n = " in text} == {"se (n = 7)", "random (n = 6)"}


def test_few_runs_are_drawn_one_by_one_and_many_are_not(tmp_path):
    few, many = (
        paths(tmp_path / "figure.png", rows_of({"se": count}), figure.STYLES["se"][0]) for count in (3, 8)
    )
    assert few == many + 3
    assert "thin lines, dots: single runs" in texts(tmp_path / "figure.png", rows_of({"se": 3}))


def test_one_run_has_no_interval_and_needs_no_mean(tmp_path):
    found = texts(tmp_path / "figure.png", rows_of({"se": 1}))
    assert {"n = 1 run each:", "no interval", "best objective f so far"} <= set(found)
    assert "nan" not in drawn(tmp_path / "figure.png", rows_of({"se": 1}))[1].read_text()


def test_methods_without_a_whole_run_or_an_objective_are_named_and_not_drawn(tmp_path):
    rows = [*rows_of({"se": 2}), Row("unfinished", 0, 0, 0.0, success=False)]
    rows += [Row("dead", run, index, math.nan, success=False) for run in range(2) for index in range(5)]
    found = texts(tmp_path / "figure.png", rows)
    assert {"unfinished: no whole run", "dead: no objective", "se"} <= set(found)
    only_dead = texts(tmp_path / "figure.png", [row for row in rows if row.method == "dead"])
    assert {"nothing to draw yet", "dead: no objective"} <= set(only_dead)


def test_every_method_has_a_marker_of_its_own_that_shows_without_an_edge():
    markers = [figure.STYLES[name][1] for name in figure.STYLES]
    assert all(MarkerStyle(marker).is_filled() for marker in markers)
    assert len(set(markers)) == len(markers)

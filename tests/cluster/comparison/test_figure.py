"""The figure of a comparison: the same bytes every time, and every method told apart."""

import numpy as np
from matplotlib.markers import MarkerStyle

from cluster.comparison import figure
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.summary import Reporting, Row
from svaedc.bo.methods import names


def test_the_figure_has_the_same_bytes_every_time_and_names_every_method(tmp_path):
    rng = np.random.default_rng(0)
    rows = [
        Row(name, run, index, float(rng.uniform(-1, 1)), success=False)
        for name, run, index in ((n, r, t) for n in names() for r in range(3) for t in range(5))
    ]
    summary = summarize([*rows, Row("unfinished", 0, 0, 0.0, success=False)], Reporting(), rng)
    drawn = [
        figure.best_so_far(tmp_path / name, summary, title="some title", initial=2, limits=(-1.0, 1.0))
        for name in ("one.png", "other.png")
    ]
    for one, other in zip(*drawn, strict=True):
        assert one.read_bytes() == other.read_bytes()
    svg = drawn[0][1].read_text()
    assert all(f"<!-- {name} (n = 3) -->" in svg for name in names())
    assert "unfinished (n" not in svg


def test_every_method_has_a_marker_of_its_own_that_shows_without_an_edge():
    markers = [figure.STYLES[name][1] for name in figure.STYLES]
    assert all(MarkerStyle(marker).is_filled() for marker in markers)
    assert len(set(markers)) == len(markers)

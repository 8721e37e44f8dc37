"""The table of a reproduction: numbers against claims."""

import json
import math

import numpy as np
import pytest

from cluster.reproduction.report import publish, table
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.summary import Reporting, Row
from tests.cluster.reproduction.tiny import TINY, plan_of


def compared(ends: dict[str, list[float]]):
    rows = [
        Row(method, run, trial, end, success=end > 0.4)
        for method, all_f in ends.items()
        for run, end in enumerate(all_f)
        for trial in range(4)
    ]
    return summarize(rows, Reporting(), np.random.default_rng(0))


def test_the_table_holds_numbers_against_claims_and_calls_a_stand_in_one(tmp_path):
    found = table(TINY, {"push": compared({"random": [0.0, 0.1, 0.2], "svae-dc": [0.5, 0.5, 0.5]})}, 2)
    text, data = publish(made(tmp_path), found)
    page, content = text.read_text(), json.loads(data.read_text())
    assert page.startswith("# figure-0: a walk (simulated stand-in)\n")
    assert "*a push (simulated stand-in); all numbers in" in page
    assert "| better | section 0 | svae-dc − random, best after 2 | +0.400 [" in page
    assert page.count("| holds |") == 2
    assert content["title"] == "a walk (simulated stand-in)"
    assert content["stand_in"] is True
    assert content["episodes"] == 300
    assert [claim["verdict"] for claim in content["claims"]] == ["holds", "holds"]
    assert content["claims"][0]["mean"] == pytest.approx(0.4)


def test_what_was_not_compared_is_said_to_be_not_measured(tmp_path):
    found = table(TINY, {}, 2)
    assert [entry.finding.verdict for entry in found.entries] == ["not measured"] * 2
    assert math.isnan(found.entries[0].finding.value.mean)
    _, data = publish(made(tmp_path), found)
    assert json.loads(data.read_text())["claims"][0]["mean"] is None


def made(folder):
    """A reproduction whose folder exists."""
    reproduction = plan_of(TINY, folder)
    reproduction.results.mkdir(parents=True)
    return reproduction

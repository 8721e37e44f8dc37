"""What there is by name is listed, and a broken plug-in is a line that says why."""

import sys

import pytest

from cluster.listing import Listed, listed_methods, listed_robots, listed_setups
from svaedc.bo.method_names import names
from tests.packages import install
from workers.hardware.robots import ROBOTS
from workers.setups import SETUPS

SOURCE = '''
"""Parts of a lab."""
from dataclasses import replace
from workers import setups
from workers.hardware.robots import Robot

def setup():
    """A quadratic that lasts three steps.

    And more that is not listed.
    """
    return replace(setups.load("quadratic-30d"), horizon=3)

def broken():
    return {}["mass"]

class Latent:
    """Looks at latent paths."""
    needs_model = True
    def __init__(self, problem):
        pass

ARM = Robot("arm", "lab-quadratic", "lab_parts:Arm")
'''
OFFERS = {
    "svaedc.setups": {
        "lab-quadratic": "lab_parts:setup",
        "lab-broken": "lab_parts:broken",
        "lab-gone": "lab_gone:setup",
        "franka": "lab_parts:setup",
        "shared": "lab_parts:setup",
    },
    "svaedc.methods": {"lab-latent": "lab_parts:Latent"},
    "svaedc.robots": {"lab-arm": "lab_parts:ARM"},
}


@pytest.fixture(autouse=True)
def lab(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    install(tmp_path, "lab", OFFERS, lab_parts=SOURCE)
    install(tmp_path, "other", {"svaedc.setups": {"shared": "lab_parts:setup"}})
    yield
    sys.modules.pop("lab_parts", None)


def test_setups_that_ship_come_first_and_plug_ins_say_where_they_are_from():
    rows = list(listed_setups())
    assert [row.name for row in rows[: len(SETUPS)]] == list(SETUPS)
    assert rows[0].facts == "48-D, 500 steps"
    assert all(row.summary for row in rows)
    assert (
        Listed(
            "lab-quadratic",
            "30-D, 3 steps",
            "A quadratic that lasts three steps.",
            "lab 1.0: lab_parts:setup",
        )
        in rows
    )


def test_a_broken_plug_in_is_listed_with_its_error_and_ends_nothing():
    said = {row.name: row.summary for row in listed_setups() if row.source}
    assert list(said) == ["franka", "lab-broken", "lab-gone", "lab-quadratic", "shared"]
    assert said["lab-broken"].startswith("error: lab-broken failed with KeyError: 'mass', at ")
    assert 'lab_parts.py:15 in broken: return {}["mass"]' in said["lab-broken"]
    assert said["lab-gone"].startswith(
        "error: cannot import the module 'lab_gone': No module named 'lab_gone'"
    )
    assert said["franka"].startswith("error: svaedc ships a setup 'franka'")
    assert said["shared"].startswith("error: lab 1.0 and other 1.0 both offer a setup 'shared'")


def test_methods_and_robots_are_listed_with_what_they_need():
    methods = {row.name: row for row in listed_methods()}
    assert tuple(methods)[:-1] == names()
    assert methods["svae-dc"].facts == methods["lab-latent"].facts == "needs a model"
    assert methods["simulated-best"].facts == "needs candidates"
    assert methods["prior-svae-dc"].facts == "needs candidates and a model"
    assert (methods["random"].facts, methods["lab-latent"].summary) == ("", "Looks at latent paths.")
    robots = {row.name: row for row in listed_robots()}
    assert list(robots) == [*ROBOTS, "rehearsal:SETUP", "lab-arm"]
    assert robots["franka-rehearsal"].summary == "simulated stand-in"
    assert (robots["lab-arm"].facts, robots["lab-arm"].summary) == (
        "realises lab-quadratic",
        "Parts of a lab.",
    )

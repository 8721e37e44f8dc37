"""One rule finds every part by name: that of a package, or anything in a module; and says what is wrong."""

import hashlib
import sys

import pytest

from tests.packages import install
from workers.plug_ins import Kind, file_name, find, module_part, offer, package_of

KIND = Kind("gait", "svaedc.gaits", ("walk", "trot"))
SOURCE = '''"""Gaits of a lab."""

class Pace:
    """Left legs, then right legs."""
    fast = 3

def gallop():
    """All at once."""

SLOW = 1
'''


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


@pytest.fixture
def lab(folder):
    offers = {"svaedc.gaits": {"pace": "lab_gaits:Pace", "gallop": "lab_gaits:gallop"}}
    return install(folder, "lab-gaits", offers, lab_gaits=SOURCE)


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("pace", "Left legs, then right legs."),
        ("lab_gaits:Pace", "Left legs, then right legs."),
        ("gallop", "All at once."),
        ("lab_gaits:SLOW", "Gaits of a lab."),
        ("lab_gaits:Pace.fast", "Gaits of a lab."),
    ],
)
def test_a_name_of_a_package_or_of_a_module_leads_to_what_is_there(lab, name, said):
    part = find(name, KIND)
    assert (part.name, part.summary) == (name, said)
    assert part.code == hashlib.sha256((lab / "lab_gaits.py").read_bytes()).hexdigest()
    assert part.file == lab / "lab_gaits.py"


@pytest.mark.usefixtures("lab")
def test_what_a_part_leads_to_is_imported_and_no_earlier():
    assert offer("pace", KIND).value == "lab_gaits:Pace"
    assert "lab_gaits" not in sys.modules
    assert file_name("pace", KIND) == "the file of the gait 'pace'"
    assert find("pace", KIND).value.fast == 3
    assert file_name("pace", KIND) == file_name("lab_gaits:SLOW", KIND) == "lab_gaits.py"


def test_two_packages_that_offer_one_name_are_both_named(lab):
    install(lab, "other-gaits", {"svaedc.gaits": {"pace": "other_gaits:pace"}}, other_gaits="pace = 1\n")
    with pytest.raises(
        LookupError, match=r"lab-gaits 1\.0 and other-gaits 1\.0 both offer a gait 'pace'.*lab_gaits:Pace or"
    ):
        find("pace", KIND)
    assert find("other_gaits:pace", KIND).value == 1


def test_a_name_that_ships_cannot_be_taken_by_a_package(folder):
    install(
        folder, "thief", {"svaedc.gaits": {"walk": "thief:walk", "a/b": "thief:walk"}}, thief="walk = 1\n"
    )
    with pytest.raises(LookupError, match=r"svaedc ships a gait 'walk'.*say thief:walk"):
        offer("walk", KIND)
    with pytest.raises(LookupError, match=r"thief 1\.0 offers a gait 'a/b'.* say thief:walk"):
        offer("a/b", KIND)


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("pase", r"unknown gait 'pase'; did you mean 'pace'\? known: walk, trot, gallop, pace"),
        ("wakl", "did you mean 'walk'"),
        ("lab_gaits:Pase", "module 'lab_gaits' has no 'Pase'; did you mean 'Pace'"),
        ("lab_gaits:Pace.fats", r"module 'lab_gaits' has no 'Pace\.fats'; did you mean 'fast'"),
        ("lab_gait:Pace", "cannot import the module 'lab_gait': No module named 'lab_gait'; .*PYTHONPATH"),
        ("lab_gaits:", "must be named as module:name, such as my_module:my_name, got 'lab_gaits:'"),
        (":Pace", "must be named as module:name"),
        ("lab-gaits:Pace", "must be named as module:name"),
    ],
)
def test_a_name_that_leads_to_nothing_is_refused_with_the_nearest(name, message):
    with pytest.raises(LookupError, match=message):
        find(name, KIND)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("import not_there\n", r"ModuleNotFoundError: No module named 'not_there', at .*wrong\.py:1"),
        ("x = 1\ndef f(:\n", r"SyntaxError: .*wrong\.py:2"),
        ("\n\nx = {}['mass']\n", r"KeyError: 'mass', at .*wrong\.py:3"),
        ("import numpy\nnumpy.zeros(-1)\n", r"ValueError: .*wrong\.py:2"),
        ("import json\n\njson.loads('{')\n", r"JSONDecodeError: .*wrong\.py:3"),
    ],
)
def test_a_module_that_fails_is_told_with_kind_file_and_line_of_the_error(folder, source, message):
    (folder / "wrong.py").write_text(source)
    with pytest.raises(LookupError, match=r"cannot import the module 'wrong': " + message):
        find("wrong:x", KIND)


def test_what_has_no_file_has_no_digest():
    with pytest.raises(LookupError, match="sys must be Python code in a file"):
        _ = module_part("sys").code


def test_a_package_without_metadata_still_offers_something(folder):
    facts = folder / "bare-2.0.dist-info"
    facts.mkdir()
    (facts / "entry_points.txt").write_text("[svaedc.gaits]\nbare = bare:gait\n")
    assert package_of(offer("bare", KIND)) == "a package without a name"

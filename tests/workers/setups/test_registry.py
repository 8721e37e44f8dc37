"""Setups from users' own modules: found by name, refused with a reason, and told apart by their code."""

import hashlib
import sys

import pytest

from tests.packages import install
from workers import setups
from workers.dataset.identity import identity_of
from workers.setups.names import SETUPS, require_known
from workers.setups.registry import file_digest

OWN = """
from dataclasses import replace
from workers import setups

def setup():
    return replace(setups.load("quadratic-30d"), name="whatever")

def short():
    return replace(setup(), horizon=3)

LONG = replace(setup(), horizon=4)

def needy(size):
    return setup()

def misspelt():
    return {"mass": 1}["maas"]
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder on Python's path, with modules and a package in it."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "box").mkdir()
    files = {
        "mine": OWN,
        "box/mine": OWN,
        "box/__init__": "",
        "no_setup": "",
        "number": "def setup():\n    return 3\n",
    }
    files |= {"lame": "import not_installed\n", "broken": "def setup(:\n"}
    for name, text in files.items():
        (tmp_path / f"{name}.py").write_text(text)
    yield tmp_path
    for name in ("box", *(name.replace("/", ".") for name in files)):
        sys.modules.pop(name, None)


@pytest.mark.parametrize("name", ["mine", "box.mine"])
def test_a_module_is_a_setup_under_its_own_name(name):
    assert setups.load(name).name == name
    assert setups.load(name).dimensions == 30


@pytest.mark.parametrize(("name", "horizon"), [("mine:setup", 2), ("mine:short", 3), ("box.mine:LONG", 4)])
def test_anything_in_a_module_is_a_setup_under_the_name_that_was_asked_for(folder, name, horizon):
    setup = setups.load(name)
    assert (setup.name, setup.horizon) == (name, horizon)
    assert setup.code == hashlib.sha256((folder / "mine.py").read_bytes()).hexdigest()


def test_a_setup_of_a_package_is_known_by_its_name_and_by_its_code(folder):
    install(folder, "lab-arms", {"svaedc.setups": {"lab-arm": "mine:short", "franka": "mine:short"}})
    setup = setups.load("lab-arm")
    assert (setup.name, setup.horizon, setup.code) == ("lab-arm", 3, setups.load("mine").code)
    assert setups.load("franka").code == ""
    with pytest.raises(
        LookupError, match=r"unknown setup 'lab-am'; did you mean 'lab-arm'.* nor is there a module"
    ):
        setups.load("lab-am")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("mine:needy", r"mine:needy failed with TypeError: needy\(\) missing 1 required .*'size'"),
        ("mine:misspelt", r"mine:misspelt failed with KeyError: 'maas', at .*mine\.py:17"),
        ("mine:OWN", "module 'mine' has no 'OWN'; did you mean"),
        ("number:setup", r"number:setup must be a workers\.setups\.Setup or a function .* got int"),
        (
            "no_setup",
            r"module 'no_setup' must offer a function setup\(\) that returns a workers\.setups\.Setup",
        ),
        ("number", r"module 'number' must offer a function setup\(\)"),
        (
            "lame",
            r"cannot import the module 'lame': ModuleNotFoundError: .*'not_installed', at .*lame\.py:1",
        ),
        ("broken", r"cannot import the module 'broken': SyntaxError: .*broken\.py:1"),
        ("box.other", r"cannot import the module 'box\.other': No module named 'box\.other'; .*PYTHONPATH"),
        ("mien", "unknown setup 'mien'; did you mean"),
        ("", "unknown setup ''"),
        ("franka-2", "unknown setup 'franka-2'; did you mean 'franka'"),
    ],
)
def test_a_module_that_is_no_setup_is_refused_with_the_reason(name, message):
    with pytest.raises(LookupError, match=message):
        setups.load(name)


def test_another_version_of_a_users_module_has_another_identity(folder):
    def identity():
        return identity_of(setups.load("mine"), seed=0, episodes_per_shard=8)

    before = identity()
    assert identity().digest == before.digest
    (folder / "mine.py").write_text(OWN + "# changed\n")
    assert [line.split(":")[0] for line in before.differences(identity())] == ["the code of mine.py"]


def test_setups_that_ship_leave_no_trace_of_their_code_in_the_identity():
    identity = identity_of(setups.load("quadratic-30d"), seed=0, episodes_per_shard=8)
    assert "setup_digest" not in identity.to_json()


def test_every_name_that_ships_leads_to_the_setup_of_that_name():
    assert [setups.load(name).name for name in SETUPS] == list(SETUPS)


def test_the_digest_is_that_of_the_bytes_of_the_file(folder):
    module = setups.import_user_module("mine")
    assert file_digest(module) == hashlib.sha256((folder / "mine.py").read_bytes()).hexdigest()


def test_an_unknown_name_is_refused_with_the_nearest_and_all_that_are_known():
    with pytest.raises(LookupError, match=r"unknown gait 'trott'; did you mean 'trot'[?] known: walk, trot"):
        require_known("trott", "gait", {"walk": 1, "trot": 2})
    with pytest.raises(LookupError, match=r"unknown gait 'trot'; known: $"):
        require_known("trot", "gait", {})

"""A folder of another dataset is refused with what differs, a user's changed file with what changed in it."""

import sys

import pytest

from workers import setups
from workers.dataset.folder import create
from workers.dataset.identity import identity_of
from workers.setups.user_bad import with_bad

CART = """
from dataclasses import replace
from workers import setups

def setup():
    return replace(setups.load("quadratic-30d"), horizon=2)

def bad(observed):
    return observed.xi[0] > 0.5
"""


@pytest.fixture
def cart_pole(tmp_path, monkeypatch):
    """Writes another version of a user's module."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(source):
        (tmp_path / "cart_pole.py").write_text(source)
        sys.modules.pop("cart_pole", None)

    write(CART)
    yield write
    sys.modules.pop("cart_pole", None)


def begin(folder, name="cart_pole", bad="", seed=0):
    return create(folder, identity_of(with_bad(setups.load(name), bad), seed=seed, episodes_per_shard=4))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("xi[0] > 0.5", "xi[0] > 0.6", r"\(nothing that its setup declares: its code did\)"),
        ("horizon=2", "horizon=3", r"\(horizon was 2, is 3\)"),
        (
            "horizon=2",
            "control_step=0.5, horizon=4",
            r"\(horizon was 2, is 4; control_step was [\d.]+, is 0\.5\)",
        ),
    ],
)
@pytest.mark.parametrize("name", ["cart_pole", "cart_pole:setup"])
def test_a_changed_file_is_named_with_what_changed_in_it(tmp_path, cart_pole, name, old, new, said):
    begin(tmp_path / "data", name)
    cart_pole(CART.replace(old, new))
    message = (
        rf"^cart_pole\.py has changed since the dataset in .*data was begun {said}\. "
        r"Choose another folder, or put the file back as it was$"
    )
    with pytest.raises(ValueError, match=message):
        begin(tmp_path / "data", name)
    cart_pole(CART)
    begin(tmp_path / "data", name)


def test_what_else_was_asked_for_differently_is_said_as_well(tmp_path, cart_pole):
    begin(tmp_path / "data")
    cart_pole(CART.replace("horizon=2", "horizon=3"))
    with pytest.raises(
        ValueError, match=r"is 3\); it and what was asked for also differ in seed: 0 and 1\. Choose"
    ):
        begin(tmp_path / "data", seed=1)


def test_a_changed_file_of_g_bad_is_named(tmp_path, cart_pole):
    begin(tmp_path / "data", "quadratic-30d", "cart_pole:bad")
    cart_pole(CART.replace("0.5", "0.6"))
    with pytest.raises(
        ValueError,
        match=r"^cart_pole\.py has changed since .* \(nothing that its G_bad declares: its code did\)\.",
    ):
        begin(tmp_path / "data", "quadratic-30d", "cart_pole:bad")


def test_another_setup_is_no_changed_file(tmp_path, cart_pole):  # noqa: ARG001
    begin(tmp_path / "data")
    with pytest.raises(
        ValueError, match=r"holds another dataset; .* differ in setup: cart_pole and quadratic-30d\."
    ):
        begin(tmp_path / "data", "quadratic-30d")


def test_the_file_of_a_module_that_is_not_loaded_is_told_by_the_name_of_its_setup(tmp_path, cart_pole):
    one = begin(tmp_path / "one").identity
    cart_pole(CART + "# changed\n")
    other = begin(tmp_path / "other").identity
    sys.modules.pop("cart_pole")
    [line] = one.differences(other)
    before, now = one.setup_digest[:12], other.setup_digest[:12]
    assert line == f"the code of the file of the setup 'cart_pole': {before} and {now}"

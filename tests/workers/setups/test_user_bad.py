"""A user's G_bad is found by its name, or named with what is wrong."""

from dataclasses import replace

import pytest

from workers import setups
from workers.dataset.identity import identity_of
from workers.setups.user_bad import with_bad

pytestmark = pytest.mark.usefixtures("gentle")


@pytest.fixture(scope="module")
def franka():
    return replace(setups.load("franka"), horizon=60)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("gentle", "must be named as module:function, got 'gentle'"),
        ("gentle:ruogh", "module 'gentle' has no 'ruogh'; did you mean 'rough'"),
        ("gentle:np", "gentle:np must be a function of what an episode showed, got <module"),
        ("gentel:rough", "cannot import the module 'gentel': No module named 'gentel'.*PYTHONPATH"),
    ],
)
def test_a_function_that_is_not_there_is_named(franka, name, message):
    with pytest.raises(LookupError, match=message):
        with_bad(franka, name)


def test_a_module_that_is_no_python_is_refused_with_the_place(franka, gentle):
    (gentle.parent / "broken.py").write_text("def rough(:\n")
    with pytest.raises(LookupError, match=r"cannot import the module 'broken': .*broken\.py:1"):
        with_bad(franka, "broken:rough")


def test_a_setups_own_g_bad_leaves_no_trace_in_the_identity(franka):
    identity = identity_of(with_bad(franka, ""), seed=0, episodes_per_shard=8)
    assert identity == identity_of(franka, seed=0, episodes_per_shard=8)
    assert "bad_" not in identity.to_json()

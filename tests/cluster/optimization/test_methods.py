"""Methods by name: a user's own beside those that ship, and held to the same."""

import sys

import numpy as np
import pytest

from cluster.optimization import methods
from svaedc.bo.candidates import Problem
from svaedc.bo.history import History
from tests.packages import install

SOURCE = '''
import numpy as np

class Greedy:
    """Steps from the best controller so far."""
    def __init__(self, problem):
        self.pool = problem.pool
    def suggest(self, history, rng):
        if not len(history):
            return rng.choice(self.pool)
        best = history.x[history.f.argmax()]
        return np.clip(best + 0.1 * rng.normal(size=best.shape), 0, 1)

class Latent(Greedy):
    needs_model = True
    def __init__(self, problem):
        super().__init__(problem)
        self.tau = problem.known_latents().tau

class Fixed:
    def __init__(self, x):
        self.x = x
    def suggest(self, history, rng):
        return self.x

def outside(problem):
    return Fixed(np.full(problem.dimensions, 1.5))

def short(problem):
    return Fixed(np.zeros(problem.dimensions - 1))

def nothing(problem):
    return Fixed(np.full(problem.dimensions, np.nan))

def mute(problem):
    return object()

def misspelt(problem):
    return problem.pol

number = 3
'''


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    install(tmp_path, "my-methods", {"svaedc.methods": {"greedy": "my_methods:Greedy"}}, my_methods=SOURCE)
    yield tmp_path
    sys.modules.pop("my_methods", None)


@pytest.fixture
def problem():
    return Problem(4, (0.0, 1.0), np.random.default_rng(0).random((30, 4), dtype=np.float32))


@pytest.mark.parametrize("name", ["greedy", "my_methods:Greedy"])
def test_a_method_of_ones_own_suggests_as_its_author_wrote_it(problem, name):
    method = methods.build(name, problem)
    history = History.empty(4).append(problem.pool[3], 1.0).append(problem.pool[4], 0.5)
    x = method.suggest(history, np.random.default_rng(1))
    expected = np.clip(problem.pool[3] + 0.1 * np.random.default_rng(1).normal(size=4), 0, 1)
    np.testing.assert_array_equal(x, expected.astype(np.float32))
    assert x.dtype == np.float32
    assert (method.suggest(History.empty(4), np.random.default_rng(1)) == problem.pool).all(axis=1).any()
    assert not methods.needs_model(name)
    methods.require(name, problem, trials=1000)


def test_only_a_users_method_has_a_code_and_says_itself_that_it_needs_a_model(problem):
    assert methods.code("greedy") == methods.code("my_methods:Latent") != ""
    assert methods.code("svae-dc-acqf-ei") == ""
    assert methods.needs_model("my_methods:Latent")
    with pytest.raises(
        LookupError, match=r"my_methods:Latent failed with ValueError: latents .*my_methods\.py:"
    ):
        methods.build("my_methods:Latent", problem)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("outside", r"'my_methods:outside' must suggest numbers in \[0, 1\], got 1\.5 in place 0; clip them"),
        ("nothing", r"must suggest numbers in \[0, 1\], got nan in place 0"),
        ("short", r"must suggest 4 numbers, shape \(4,\), got shape \(3,\)"),
    ],
)
def test_a_suggestion_that_is_no_controller_is_refused_naming_the_method(problem, name, message):
    method = methods.build(f"my_methods:{name}", problem)
    with pytest.raises(ValueError, match=message):
        method.suggest(History.empty(4), np.random.default_rng(0))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("my_methods:mute", r"my_methods:mute must give an object with suggest\(history, rng\), got object"),
        ("my_methods:misspelt", r"failed with AttributeError: .*'pol'.*my_methods\.py:39"),
        ("my_methods:number", "my_methods:number must be a class or function .* got int"),
        ("my_methods:Gredy", "module 'my_methods' has no 'Gredy'; did you mean 'Greedy'"),
        ("gredy", "unknown method 'gredy'; did you mean 'greedy'.*known: bbk-kl"),
        ("se-pool", "repeat what 'se' does anyway"),
        ("se-ei-acqf", "unknown method 'se-ei-acqf'"),
    ],
)
def test_what_is_no_method_is_refused_with_the_reason(problem, name, message):
    with pytest.raises(LookupError, match=message):
        methods.require(name, problem, 1)

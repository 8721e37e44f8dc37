"""What simulation showed of candidates, looked up by their controllers."""

import numpy as np
import pytest
import torch

from svaedc.bo.simulated.outcomes import Lookup, SimulatedLatents, SimulatedOutcomes

X = np.random.default_rng(0).random((5, 3), dtype=np.float32)


def test_controllers_are_found_whatever_their_order_and_precision():
    lookup = Lookup(X)
    assert lookup.rows(torch.tensor(X[[3, 0, 3]]).double()).tolist() == [3, 0, 3]


def test_of_equal_controllers_the_first_counts():
    assert Lookup(X[[1, 1, 0]]).rows(torch.tensor(X[:2])).tolist() == [2, 0]


def test_a_controller_that_was_not_simulated_is_refused_with_the_remedy():
    with pytest.raises(ValueError, match=r"not simulated has neither.*search"):
        Lookup(X).rows(torch.full((1, 3), 0.5))


def test_outcomes_and_latents_are_those_of_the_controllers_asked_for():
    f, y = torch.arange(10.0).reshape(5, 2), torch.linspace(0, 1, 10).reshape(5, 2)
    outcomes = SimulatedOutcomes(f, y, Lookup(X))
    asked = torch.tensor(X[[4, 1]])
    assert torch.equal(outcomes.objectives(asked), f[[4, 1]])
    assert torch.equal(outcomes.badness(asked), y[[4, 1]])
    tau, badness = SimulatedLatents(f, y[:, 0], Lookup(X))(asked)
    assert torch.equal(tau, f[[4, 1]])
    assert torch.equal(badness, y[[4, 1], 0])


@pytest.mark.parametrize("f", [torch.zeros(5, 0), torch.full((5, 2), float("nan"))])
def test_outcomes_that_are_none_are_refused(f):
    y = torch.zeros(5, 0) if not f.shape[1] else torch.zeros(5, 2)
    with pytest.raises(ValueError, match="must be"):
        SimulatedOutcomes(f, y, Lookup(X))

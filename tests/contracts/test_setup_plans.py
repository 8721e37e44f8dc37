"""What shipped controllers say they want is what they command, for many at once and with gradients."""

import numpy as np
import pytest
import torch

from workers import setups
from workers.controllers.constant import Constant
from workers.controllers.controller import PlanTimes
from workers.controllers.cpg import PatternGenerator
from workers.controllers.end_effector import EndEffectorWaypoints
from workers.controllers.joint_speed import JointSpeedWaypoints
from workers.setups import SETUPS

X = np.random.default_rng(3).random((6, 64), dtype=np.float32)
PLANNED = [name for name in SETUPS if setups.load(name).controller.planned]
every_plan = pytest.mark.parametrize("name", PLANNED)


def moments_of(setup, samples=50):
    steps = np.arange(1, samples + 1) * (setup.horizon // samples)
    return PlanTimes(steps, setup.horizon, setup.control_step)


def told(name, kind=np.float32):
    setup = setups.load(name)
    return setup, setup.controller.plans(X[:, : setup.dimensions].astype(kind), moments_of(setup))


def test_all_robots_that_ship_offer_a_plan():
    assert set(SETUPS) == set(PLANNED)


@every_plan
def test_a_plan_has_a_row_per_channel_and_is_the_same_alone_and_among_others(name):
    setup, plans = told(name)
    assert plans.shape == (6, len(setup.controller.planned), 50)
    assert plans.dtype == np.float32
    assert np.isfinite(plans).all()
    alone = setup.controller.plans(X[2:3, : setup.dimensions], moments_of(setup))
    np.testing.assert_allclose(alone[0], plans[2], rtol=1e-4, atol=1e-4)


@every_plan
def test_torch_tells_the_same_and_its_gradients_reach_every_parameter(name):
    setup, plans = told(name, np.float64)
    x = torch.tensor(X[:, : setup.dimensions]).double().requires_grad_()
    same = setup.controller.plans(x, moments_of(setup))
    np.testing.assert_allclose(same.detach().numpy(), plans, rtol=1e-9, atol=1e-9)
    same.square().sum().backward()
    assert (x.grad.abs().sum(dim=0) > 0).all()


@every_plan
def test_controllers_that_differ_in_one_parameter_differ_in_their_plans(name):
    setup = setups.load(name)
    x = np.tile(X[:1, : setup.dimensions], (setup.dimensions, 1))
    x[np.diag_indices(setup.dimensions)] = 1.0 - x[np.diag_indices(setup.dimensions)]
    plans = setup.controller.plans(np.concatenate([X[:1, : setup.dimensions], x]), moments_of(setup))
    assert (np.abs(plans[1:] - plans[0]).max(axis=(1, 2)) > 1e-4).all()


@every_plan
def test_the_plan_is_what_is_commanded(name):
    """A hand's plan is followed by torques: its reference is compared; a gait's integrates more coarsely."""
    setup, plans = told(name)
    steps, x = moments_of(setup).steps - 1, X[:, : setup.dimensions]
    match setup.controller:
        case PatternGenerator():
            wanted = np.stack([setup.controller.commands(each, setup.horizon)[steps].T for each in x])
            assert np.median(np.abs(plans - wanted)) < 0.03
        case JointSpeedWaypoints():
            wanted = np.stack([setup.controller.plan(each, setup.horizon)[steps].T for each in x])
            np.testing.assert_allclose(plans[:, :7], wanted, atol=1e-4)
            whole = np.stack([setup.controller.plan(each, setup.horizon).T for each in x])
            turned = np.cumsum(whole, axis=2)[:, :, steps] * setup.control_step
            np.testing.assert_allclose(plans[:, 7:], turned, atol=0.01)
        case EndEffectorWaypoints():
            with setup.open() as environment:
                environment.reset(setup.physics.middle())
                rows = [setup.controller.start(each, environment, setup.horizon).plan.rows for each in x]
            wanted = np.stack([each[steps].T for each in rows])
            np.testing.assert_allclose(plans[:, :3], wanted[:, :3], atol=5e-3)
            seconds = setup.horizon * setup.control_step
            np.testing.assert_allclose(plans[:, 3:6] / seconds, wanted[:, 3:6], atol=0.1)
            np.testing.assert_allclose(plans[:, 9:11], wanted[:, 16:18], rtol=1e-5)
        case Constant():
            values = np.stack([setup.controller.values(each) for each in x])
            np.testing.assert_allclose(plans, np.repeat(values[:, :, None], 50, axis=2), rtol=1e-5)
        case _:
            pytest.fail(f"say here how the plan of {name} is what is commanded")

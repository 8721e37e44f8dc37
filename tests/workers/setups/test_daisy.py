"""The setups of the Daisy: what is varied, and how the rehearsal differs from what it stands in for."""

import pytest

from workers.setups.daisy import daisy_11d, daisy_11d_rehearsal, daisy_27d, gaps
from workers.tasks.stop import STOPPED, WalkGuard, never


def test_the_papers_gap_varies_restitution_alone():
    levels = gaps({"friction": 2.0, "restitution": 0.5})
    assert levels["paper"].intervals["friction"] == (2.0, 2.0)
    assert levels["paper"].intervals["restitution"] == levels["training"].intervals["restitution"]
    assert levels["training"].intervals["friction"] == pytest.approx((1.6, 2.4))
    assert levels["wide"].intervals["friction"] == pytest.approx((1.0, 3.0))


def test_each_setup_has_the_dimensions_of_its_name_and_the_papers_duration():
    assert (daisy_27d().dimensions, daisy_27d().horizon) == (27, 1000)
    assert (daisy_11d().dimensions, daisy_11d().horizon) == (11, 1500)


def test_only_the_rehearsal_is_stopped_when_it_falls():
    stand_in, simulated = daisy_11d_rehearsal(), daisy_11d()
    assert stand_in.stop == WalkGuard(simulated.task)
    assert simulated.stop is never
    assert stand_in.conditions == (*simulated.conditions, STOPPED)
    assert stand_in.controller.parameters == simulated.controller.parameters

"""The Daisy's description: its solids and their moments."""

import pytest

from workers.environments import daisy_body


def test_combined_solids_obey_the_parallel_axis_theorem():
    ball = daisy_body.Solid(2.0, (0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
    other = daisy_body.Solid(2.0, (1.0, 0.0, 0.0), (0.1, 0.1, 0.1))
    mass, center, inertia = daisy_body.combine((ball, other))
    assert (mass, center) == (4.0, (0.5, 0.0, 0.0))
    assert inertia == pytest.approx((0.2, 1.2, 1.2))


def test_the_center_of_mass_of_femur_and_tibia_is_the_manufacturer_s():
    assert daisy_body._femur().center[0] == pytest.approx(0.251, abs=1e-3)
    assert daisy_body._tibia(1.0).center[0] == pytest.approx(0.184, abs=1e-3)

"""What a network tells of bad conditions, against data whose answer is known because it was made."""

import numpy as np

from studies.conditions import told


def test_what_follows_from_x_is_told_and_what_does_not_is_not():
    rng = np.random.default_rng(3)
    x = rng.random((1_500, 3), dtype=np.float32)
    values = np.stack([x[:, 0] > 0.5, rng.random(1_500), np.ones(1_500)], axis=1).astype(np.float64)
    known, noise, constant = told(x, values)
    assert known > 0.8
    assert abs(noise) < 0.25
    assert np.isnan(constant)

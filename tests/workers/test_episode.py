"""How bad steps are, and which steps a model sees."""

import numpy as np
import pytest

from workers.episode import degrees, stride_steps


def test_any_bit_makes_a_step_entirely_bad_and_a_degree_is_itself():
    assert degrees(np.array([0, 1, 6], dtype=np.uint8)).tolist() == [0.0, 1.0, 1.0]
    graded = np.array([[0.0, 0.25], [1.0, 0.5]], dtype=np.float32)
    assert degrees(graded) is graded


@pytest.mark.parametrize(
    ("horizon", "stride", "steps"), [(10, 1, list(range(10))), (10, 5, [4, 9]), (11, 5, [4, 9]), (4, 4, [3])]
)
def test_a_model_sees_the_last_step_of_every_whole_stride(horizon, stride, steps):
    assert np.arange(horizon)[stride_steps(horizon, stride)].tolist() == steps

"""The pattern generator against a plain integration of its equations, and the commands made of it."""

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workers.controllers import cpg

W, A, DT = 10.0, 1.0, 0.01
RING = ["LF", "LM", "LB", "RB", "RM", "RF"]
FREE = (pi, pi, pi)
CLAMPS = (0.6, 1.0, 1.5)


def _integrated(phases, lags, v, amplitude, offset, steps):
    """Every oscillator and every coupling one by one, as the equations stand; [steps, 18], base to elbow."""
    couplings = {}
    for i in range(6):
        for j in range(6):
            couplings[i, j] = phases[j] - phases[i]
        for joint in (1, 2):
            couplings[i, 6 * joint + i] = -lags[joint - 1][i]
            couplings[6 * joint + i, i] = lags[joint - 1][i]
    theta, r, speed, seen = [0.0] * 18, [amplitude[i // 6] for i in range(18)], [0.0] * 18, []
    for _ in range(steps):
        rates = [2 * pi * v[i // 6] for i in range(18)]
        for (i, j), bias in couplings.items():
            rates[i] += W * sin(theta[j] - theta[i] - bias)
        for i in range(18):
            theta[i] += DT * rates[i]
            speed[i] += DT * A * (A / 4 * (amplitude[i // 6] - r[i]) - speed[i])
            r[i] += DT * speed[i]
        seen.append([r[i] * (1 + cos(theta[i])) - offset[i // 6] for i in range(18)])
    return np.array(seen)


def _angle(x):
    return [2 * pi * float(number) - pi for number in x]


@pytest.mark.parametrize("seed", range(4))
def test_27d_commands_are_those_of_the_integrated_equations(seed):
    x = np.random.default_rng(seed).random(27, dtype=np.float32)
    lags = [_angle(x[6:12]), _angle(x[12:18])]
    v, amplitude, offset = (x[18:21] * 2.0).tolist(), x[21:24].tolist(), x[24:27].tolist()
    seen = _integrated(_angle(x[:6]), lags, v, amplitude, offset, 250)
    commands = cpg.cpg_27d(FREE).commands(x, 250)
    for number, leg in enumerate(["LF", "RF", "LM", "RM", "LB", "RB"]):
        place = RING.index(leg)
        left = np.stack([seen[:, place], seen[:, 6 + place], -1 + seen[:, 12 + place]], axis=1)
        expected = left if leg[0] == "L" else -left
        assert commands[:, 3 * number : 3 * number + 3] == pytest.approx(expected, abs=1e-5), leg


@pytest.mark.parametrize("seed", range(4))
def test_11d_commands_are_those_of_the_integrated_equations_clamped(seed):
    x = np.random.default_rng(seed).random(11, dtype=np.float32)
    lags = [_angle(x[6:7]) * 6, _angle(x[7:8]) * 6]
    v, amplitude, offset = ([0.5 + 0.5 * float(number)] * 3 for number in x[8:])
    seen = _integrated(_angle(x[:6]), lags, v, amplitude, offset, 250)
    commands = cpg.cpg_11d(CLAMPS).commands(x, 250)
    for number, leg in enumerate(["LF", "RF", "LM", "RM", "LB", "RB"]):
        place = RING.index(leg)
        base, shoulder = np.clip(seen[:, place], -0.6, 0.6), np.clip(seen[:, 6 + place], -1.0, 1.0)
        elbow = np.clip(-1 + seen[:, 12 + place], -1.5, 1.5)
        left = np.stack([-base, -shoulder, elbow], axis=1)
        expected = left if leg[0] == "L" else -left
        assert commands[:, 3 * number : 3 * number + 3] == pytest.approx(expected, abs=1e-5), leg


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(0, 1, width=32), min_size=11, max_size=11))
def test_11d_commands_never_leave_the_hardware_s_clamps(numbers):
    commands = cpg.cpg_11d(CLAMPS).commands(np.array(numbers, dtype=np.float32), 100)
    assert np.all(np.abs(commands) <= CLAMPS * 6)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.sampled_from([0.0, 0.5, 1.0]), min_size=27, max_size=27))
def test_27d_commands_stay_within_one_and_two_radians_of_their_centers(numbers):
    commands = cpg.cpg_27d(FREE).commands(np.array(numbers, dtype=np.float32), 100).reshape(100, 6, 3)
    left = commands * np.array([1, -1, 1, -1, 1, -1])[:, None]
    assert left[:, :, :2].min() >= -1.0
    assert left[:, :, :2].max() <= 2.0
    assert left[:, :, 2].min() >= -2.0
    assert left[:, :, 2].max() <= 1.0


def test_commands_never_leave_narrow_limits_either():
    x = np.random.default_rng(0).random(27, dtype=np.float32)
    assert np.abs(cpg.cpg_27d((0.1, 0.2, 0.3)).commands(x, 100)).max(axis=0) == pytest.approx(
        (0.1, 0.2, 0.3) * 6
    )


def test_oscillators_of_one_frequency_settle_at_the_wanted_phases():
    x = np.full(27, 0.5, dtype=np.float32)
    x[:6] = [0.1, 0.4, 0.6, 0.9, 0.3, 0.5]
    x[6:12], x[12:18] = 0.75, 0.25  # shoulders π/2 behind their base, elbows π/2 ahead
    gait = cpg.cpg_27d(FREE)._gait(cpg.cpg_27d(FREE).values(x))
    theta = cpg.phases(gait, 1500)[-1]
    wanted = 2 * pi * x[:6]
    assert np.exp(1j * (theta[0] - theta[0, 0])) == pytest.approx(np.exp(1j * (wanted - wanted[0])), abs=1e-6)
    assert np.exp(1j * (theta[1] - theta[0])) == pytest.approx(np.exp(-0.5j * pi), abs=1e-6)
    assert np.exp(1j * (theta[2] - theta[0])) == pytest.approx(np.exp(0.5j * pi), abs=1e-6)


def test_without_amplitude_the_robot_stands_still_at_minus_its_offsets():
    x = np.full(27, 0.3, dtype=np.float32)
    x[21:24], x[24:27] = 0.0, (0.25, 0.5, 0.75)
    left_front = cpg.cpg_27d(FREE).commands(x, 50)[:, :3]
    assert left_front == pytest.approx(np.tile([-0.25, -0.5, -1.75], (50, 1)))


def test_parameters_name_their_leg_and_joint():
    names = [parameter.name for parameter in cpg.cpg_27d(FREE).parameters]
    assert names[:2] == ["LF_base_phase", "LM_base_phase"]
    assert (names[6], names[17]) == ("LF_shoulder_phase", "RF_elbow_phase")
    assert names[18:22] == ["base_frequency", "shoulder_frequency", "elbow_frequency", "base_amplitude"]
    assert len(set(names)) == 27
    assert [parameter.name for parameter in cpg.cpg_11d(CLAMPS).parameters[6:]] == [
        "shoulder_phase",
        "elbow_phase",
        "frequency",
        "amplitude",
        "offset",
    ]

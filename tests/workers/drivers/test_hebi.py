"""The paper's hexapod against its maker's imitation: order, units, rests; its page says what that is not."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.workers.drivers.hexapod import WALKED, hexapod
from workers import setups
from workers.hardware.driver import RobotBroke, RobotFault
from workers.host.home import RobotHome
from workers.host.limits import RobotLimits

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[3]
X = np.full(11, 0.5, np.float32)


def asked(python, script):
    """What a few lines in the driver's environment print, as JSON."""
    start = (
        "import json, numpy as np\nfrom workers.drivers import hebi as driver\nrobot = driver.HebiHexapod()\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.fspath(ROOT)}
    done = subprocess.run(
        [python, "-c", start + script], capture_output=True, text=True, env=environment, check=False
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def connected(python, folder, **settings):
    limits = RobotLimits.read({"silence": 60}, "limits")
    return hexapod(python, **settings).connect(0, 0.0, RobotHome(folder, "hebi").make(), limits)


def test_its_numbers_are_those_of_the_setup(hebi_python):
    setup = setups.load("daisy-11d")
    period, steps, reach = asked(
        hebi_python, "print(json.dumps([driver.PERIOD, driver.STEPS, driver.REACH]))"
    )
    assert (period, steps) == (setup.control_step, setup.horizon)
    assert [channel.high for channel in setup.controller.planned[:3]] == reach


def test_the_gait_is_the_one_that_is_simulated_after_a_ramp_from_the_stance(hebi_python):
    rows, names = asked(
        hebi_python,
        f"plan = robot.plan({X.tolist()})\nprint(json.dumps([plan.rows, [c.name for c in plan.channels]]))",
    )
    setup = setups.load("daisy-11d")
    assert names == [channel.name for channel in setup.controller.planned]
    expected = setup.controller.commands(X, setup.horizon)
    assert np.allclose(rows[-setup.horizon :], expected, atol=1e-6)
    assert np.abs(np.diff(rows[: -setup.horizon + 1], axis=0)).max() < 0.02  # rad in a sixtieth of a second


def test_each_command_reaches_the_module_of_its_joint(hebi_python):
    moved = asked(
        hebi_python,
        "found = []\n"
        "for joint in range(18):\n"
        "    robot.send(driver.STANCE.tolist())\n"
        "    command = driver.STANCE.copy(); command[joint] += 0.5\n"
        "    robot.send(command.tolist())\n"
        "    import time; time.sleep(0.05)\n"
        "    away = np.abs(robot._look()[:18] - driver.STANCE)\n"
        "    found.append([int(i) for i in np.flatnonzero(away > 0.4)])\n"
        "print(json.dumps(found))",
    )
    assert moved == [[joint] for joint in range(18)]


def test_modules_let_go_when_they_hear_nothing(hebi_python):
    assert asked(hebi_python, "print(json.dumps(robot._group.command_lifetime))") == 100


def test_what_it_walked_is_measured_and_what_it_saw_is_kept(hebi_python, tmp_path):
    driver = connected(hebi_python, tmp_path)
    measured = driver.run("a", X)
    driver.stop()
    assert (measured.f, measured.y) == (pytest.approx(10 * WALKED), 0.0)
    header, *rows = (tmp_path / "trials" / "a" / "feedback.csv").read_text().splitlines()
    assert header.split(",")[0] == "LF_base_rad"
    assert len(rows) == 120 + 30


@pytest.mark.parametrize(
    ("settings", "kind", "reason"),
    [
        ({"measure": ""}, RobotBroke, "measure how far it walked, and resolve the trial"),
        ({"hottest": 30.0}, RobotFault, "a winding has 35 °C, more than 30"),
        ({"names": ["a", "b"]}, RobotFault, "of the modules a, b of Daisy some do not answer"),
    ],
)
def test_what_goes_wrong_is_told(hebi_python, tmp_path, settings, kind, reason):
    driver = connected(hebi_python, tmp_path, **settings)
    with pytest.raises(kind, match=reason):
        driver.run("a", X)
    driver.stop()


def test_a_robot_that_does_not_stand_is_not_moved(hebi_python):
    said = asked(
        hebi_python,
        "robot.send((driver.STANCE + 0.3).tolist())\nimport time; time.sleep(0.05)\n"
        f"try: robot.begin({X.tolist()})\n"
        "except driver.Fault as fault: print(json.dumps(str(fault)))",
    )
    assert said == "joint LF_base is 0.30 rad away from the stance: put the robot into it"

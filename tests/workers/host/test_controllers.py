"""Controllers of every kind, through a whole host: what lies outside the limits never reaches the robot."""

import json
import math
import random
import struct

import pytest

from workers.host.home import RobotHome
from workers.host.limits import HostChannel, RobotLimits
from workers.host.machine import Plan, Rest, RobotMachine
from workers.host.serve import Host

JOINTS = (HostChannel("hip", "position", "rad"), HostChannel("knee", "position", "rad"))
LIMITS = RobotLimits.read(
    {"position": {"*": [-1.0, 1.0]}, "speed": {"*": 20.0}, "acceleration": {"*": 4000.0}, "duration": 1.0},
    "test",
)
STEPS, PERIOD = 8, 0.01
NUMBERS = (math.nan, math.inf, -math.inf, 1e308, -0.0, 5e-324, 1.0, math.nextafter(1.0, 2.0), -1.0)
ODD = (*NUMBERS, 1, True, "1", None)


class Liar(RobotMachine):
    """Its plans are x, and its commands are x or something else; it keeps what it was sent."""

    rest = Rest("hold", "hold", "hold", "hold")
    period = PERIOD
    channels = JOINTS

    def __init__(self, rng):
        self.rng, self.sent, self.lies = rng, [], 0

    def plan(self, x):
        return Plan(JOINTS, PERIOD, [self._row(x, step) for step in range(STEPS)], STEPS * PERIOD)

    def begin(self, x):
        self.x = x
        self.sent.append([])

    def command(self, step):
        if step == STEPS:
            return None
        row = self._row(self.x, step)
        if self.rng.random() < 0.05:
            self.lies += 1
            row[self.rng.randrange(2)] = self.rng.choice(ODD)
        return row if self.rng.random() > 0.005 else row * 2

    def send(self, command):
        self.sent[-1].append(command)

    def stop(self):
        pass

    def end(self):
        return {"f": 0.5, "y": 0.25, "stop": "", "evidence": "a" * 64}

    def _row(self, x, step):
        """Two joints that swing by x, beyond the limits where it asks for much."""
        return [1.4 * x[0] * math.sin(step * x[2] / 2), 1.1 * x[1] * step / STEPS]


def adversarial(rng):
    """A controller as a driver of a host would send it, and sometimes what is none."""
    x = [rng.random() for _ in range(3)]
    if rng.random() < 0.1:
        x[rng.randrange(3)] = rng.choice([math.nan, math.inf, -5e-324, 1.0 + 2**-52, 1e308, -1.0])
    text = struct.pack("<3d", *x).hex()
    return rng.choice([text[:-1], text.upper(), 7, None, "zz" * 24, ""]) if rng.random() < 0.02 else text


@pytest.mark.parametrize("times", [300, pytest.param(10_000, marks=pytest.mark.slow)])
def test_nothing_outside_the_limits_reaches_the_robot(times, tmp_path):
    rng, said = random.Random(times), []
    machine, host = Liar(rng), None
    for number in range(times):
        if host is None or number % 500 == 0:
            home = RobotHome(tmp_path / f"home-{number}", "desk").make()
            host = Host(home, machine, LIMITS, said.append, 0.0)
        host.answer({"do": "run", "trial": f"desk-{number}", "x": adversarial(rng), "seconds": 5.0})
        json.dumps(said[-1], allow_nan=False)
    ends = [message["say"] for message in said if message["say"] != "started"]
    assert len(ends) == times
    assert {"ended", "stopped", "refused"} == set(ends)
    assert min(ends.count(end) for end in set(ends)) > times / 20
    assert machine.lies > times / 20
    for rows in machine.sent:
        rates = [0.0, 0.0]
        for number, row in enumerate(rows):
            assert all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in row)
            assert all(-1.0 <= value <= 1.0 for value in row)
            if number:
                new = [(value - before) / PERIOD for value, before in zip(row, rows[number - 1], strict=True)]
                assert max(map(abs, new)) <= 20.0
                if number > 1:
                    assert max(abs(a - b) / PERIOD for a, b in zip(new, rates, strict=True)) <= 4000.0
                rates = new


class Unready(Liar):
    """It gets ready once, and never again."""

    def begin(self, x):
        if self.sent:
            raise RuntimeError("the arm is not homed")
        super().begin(x)


def test_a_motion_that_does_not_begin_has_none_of_the_commands_of_the_one_before(tmp_path):
    said, home = [], RobotHome(tmp_path / "home", "desk").make()
    host = Host(home, Unready(random.Random(2)), RobotLimits(), said.append, 0.0)
    for number in range(2):
        x = struct.pack("<3d", 0.1, 0.1, 0.1).hex()
        host.answer({"do": "run", "trial": f"desk-{number}", "x": x, "seconds": 5.0})
    assert said[-1]["say"] == "broke"
    assert home.ledger.entries()[-1].facts["commands"] == 0
    rows = (home.trials / "desk-1" / "commands.csv").read_text(encoding="utf-8").splitlines()
    assert rows == ["seconds,hip,knee"]


def test_once_a_trial_has_started_nothing_calls_it_unmoved(tmp_path, monkeypatch):
    said, home = [], RobotHome(tmp_path / "home", "desk").make()
    host = Host(home, Liar(random.Random(2)), RobotLimits(), said.append, 0.0)

    def fails(*_):
        raise RuntimeError("a mistake of ours")

    for name in ("travel", "write_table"):
        monkeypatch.setattr(f"workers.host.serve.{name}", fails)
    host.answer(
        {"do": "run", "trial": "desk-0", "x": struct.pack("<3d", 0.1, 0.1, 0.1).hex(), "seconds": 5.0}
    )
    assert [message["say"] for message in said] == ["started", "broke"]

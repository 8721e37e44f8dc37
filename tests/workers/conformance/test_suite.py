"""Mistakes planted in a sound robot: each is found, by a line that names the remedy."""

import re

import pytest

from workers.conformance.remark import Severity
from workers.conformance.sample import sample
from workers.conformance.suite import CHECKS, find

FORCE = "force = command[0]"
AT_START = "self.position, self.speed = 0.0, 0.0"
RETURN = "return (self.position, self.speed)"
PLANTED = {
    "transposed": (
        ("np.array(records, dtype=np.float32).T", "np.array(records, dtype=np.float32)"),
        "episodes",
        "20 steps: transpose it",
    ),
    "raises": (
        (FORCE, "force = {True: command[0]}[command[0] < 0.9]"),
        "episodes",
        "with KeyError: False, at ",
    ),
    "aborts": (
        (FORCE, "force = command[0] if command[0] < 0.9 else exit_()"),
        "episodes",
        "it ended its process",
    ),
    "hangs": (
        (FORCE, "force = command[0] if command[0] < 0.9 else hang()"),
        "episodes",
        "it took longer than 2 s",
    ),
    "leaves its bounds": (('"m/s", -5.0, 5.0', '"m/s", -0.1, 0.1'), "episodes", "widen the bounds"),
    "not finite": (
        (RETURN, "return (self.position / 0.0 if self.speed > 1 else self.position, self.speed)"),
        "episodes",
        "ZeroDivisionError",
    ),
    "random": (
        (FORCE, "force = command[0] + 1e-3 * np.random.default_rng().random()"),
        "determinism",
        "random numbers but those",
    ),
    "state": (
        (AT_START, "self.position, self.speed = getattr(self, 'position', 0.0), 0.0"),
        "state",
        "reset() must bring back everything",
    ),
    "another step": (
        ("    control_step = 0.1", "    control_step = 0.01"),
        "commands",
        "control_step of the environment is 0.01, that of the setup 0.1",
    ),
    "another observation": (
        ("    observation = CHANNELS", "    observation = CHANNELS[::-1]"),
        "commands",
        "observation of the environment is",
    ),
    "two commands": (
        ("(values[step * len(values) // horizon],)", "(values[0], values[1])"),
        "commands",
        "commands 2 numbers, the environment's action has 1 (force); make them agree",
    ),
    "too strong": (
        ('f"force_{number}", "N", -1.0, 1.0', 'f"force_{number}", "N", -3.0, 3.0'),
        "commands",
        "whose bounds are [-1, 1]; clip it",
    ),
    "unused physics": ((' + self.physics["wind"]', ""), "physics", "wind changes nothing in"),
    "unused parameter": (
        ("len(values) // horizon", "(len(values) - 1) // horizon"),
        "parameters",
        "parameter force_3 of the controller changes nothing",
    ),
    "wide bounds": (('"m/s", -5.0, 5.0', '"m/s", -5e6, 5e6'), "worth", "bring the bounds near the"),
    "constant f": (
        ("return float(observed.xi[0, -1])", "return 0.1"),
        "worth",
        "so there is nothing to optimise",
    ),
    "constant y": (("> 0.5", "> 4.5"), "worth", "make the bad conditions stricter or looser"),
    "odd limits": (("(-2.0, 2.0)", "(100.0, 200.0)"), "worth", "set the limits by them"),
    "never solved": (("success=0.5", "success=2.0"), "worth", "lower success, or raise the limit"),
    "always solved": (("success=0.5", "success=-5.0"), "worth", "raise success or make the task harder"),
    "angles jump": (
        (
            ('Channel("position", "m", -5.0, 5.0)', 'Channel("position", "rad", -5.0, 5.0)'),
            (RETURN, "return ((self.position * 20 + 3.1) % 6.28 - 3.14, self.speed)"),
        ),
        "angles",
        "give sine and cosine instead",
    ),
}
HELPERS = (
    "STEPS = 20",
    "STEPS = 20\n\n\ndef exit_():\n    import os; os.abort()\n\n\n"
    "def hang():\n    import time; time.sleep(1000)",
)


def findings(setup):
    with sample(setup, seed=0, timeout=2.0, time_limit=1.0) as looked_at:
        return [finding for check in CHECKS for finding in find(check, looked_at)]


def test_of_a_sound_robot_only_facts_are_said(own_robot):
    worth, cost = findings(own_robot())
    assert {each.severity for each in (worth, cost)} == {Severity.FACT}
    assert re.search(r"from .* to .*: \d+% of them above success, 0\.5, and 2% outside", worth.text)
    assert "an episode, so 500,000 take" in cost.text


def test_channels_that_use_little_of_their_bounds_are_named(own_robot):
    found = findings(own_robot(('"m", -5.0, 5.0)', '"m", -50.0, 50.0)'), name="roomy_glider"))
    told = [each for each in found if "bounds use least" in each.text]
    assert [each.severity for each in told] == [Severity.FACT]
    assert re.search(r"least: position \d%", told[0].text)


# One mistake of each kind of check; the others are left to make test-slow.
FAST = ("transposed", "raises", "state", "two commands", "unused physics", "constant f", "angles jump")


@pytest.mark.parametrize(
    "mistake",
    [name if name in FAST else pytest.param(name, marks=pytest.mark.slow) for name in PLANTED],
)
def test_each_planted_mistake_is_found_by_a_line_that_names_the_remedy(own_robot, mistake):
    changes, check, told = PLANTED[mistake]
    several = changes if isinstance(changes[0], tuple) else (changes,)
    found = findings(own_robot(HELPERS, *several, name=f"planted_{mistake.replace(' ', '_')}"))
    assert [finding for finding in found if finding.check == check and told in finding.text], found
    others = {finding.check for finding in found if finding.severity is Severity.MISTAKE} - {check}
    told_again = {"determinism": {"gymnasium"}, "state": {"gymnasium"}, "episodes": others}
    assert others <= told_again.get(check, set()), found

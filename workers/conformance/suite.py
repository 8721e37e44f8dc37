"""All checks of a robot, one after the other, about a minute in all."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from workers.conformance import checks, effects
from workers.conformance.remark import Remark, Severity
from workers.conformance.sample import Sample
from workers.user_code import describe


@dataclass(frozen=True)
class Check:
    """One check.

    Attributes:
        name: of it, which its findings bear.
        passed: what is said where it finds nothing.
        find: yields what it finds in a sample.
    """

    name: str
    passed: str
    find: Callable[[Sample], Iterator[Remark]]


CHECKS = (
    Check(
        "episodes",
        "every episode came to its end, in the shapes and bounds of its channels",
        checks.check_episodes,
    ),
    Check("determinism", "an episode has the same bytes in another process", checks.check_determinism),
    Check("state", "no episode depends on those before it", checks.check_state),
    Check("commands", "commands are what the environment's action channels say", effects.check_commands),
    Check("physics", "every physics parameter changes something", effects.check_physics),
    Check("parameters", "every parameter of the controller changes something", effects.check_parameters),
    Check("worth", "objective, badness and channels vary, and fit their limits", checks.check_worth),
    Check("angles", "no angle jumps from one end of its range to the other", checks.check_angles),
    Check("gymnasium", "Gymnasium's checker has nothing against it", effects.check_gymnasium),
    Check("cost", "", checks.check_cost),
)
"""They are made in this order; a later one supposes what the earlier ones found."""


def find(check: Check, sample: Sample) -> list[Remark]:
    """Make one check.

    Args:
        check: which.
        sample: of the robot.

    Returns:
        What it found; a check that users' code breaks off is a mistake of theirs.
    """
    try:
        return list(check.find(sample))
    except Exception as error:  # noqa: BLE001 - users' code may raise anything
        return [Remark(check.name, Severity.MISTAKE, f"broken off by {describe(error)}")]

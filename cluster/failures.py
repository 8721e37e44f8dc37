"""What a person reads of an episode or trial whose code raised, hung or ended its process."""

from collections.abc import Sequence

from workers.episode import Failure
from workers.physics import Physics


def failure_text(
    what: str, setup: str, bad: str, x: Sequence[float], physics: Physics, failure: Failure
) -> str:
    """Tell what failed, of what, under which controller and physics, and how to see it again.

    Args:
        what: failed, with its seed, such as `episode 12 of seed 0`.
        setup: its name.
        bad: G_bad of a user's own, as `module:function`; "" for the setup's.
        x: the controller, D numbers in [0, 1].
        physics: that it ran under.
        failure: what was raised.

    Returns:
        A text of one screen.
    """
    numbers = ",".join(f"{value:.9g}" for value in x)
    values = ",".join(f"{name}={value!r}" for name, value in sorted(physics.items()))
    again = ["svaedc render", f"--setup {setup}", f"--x {numbers}"]
    again += [f"--physics {values}"] if values else []
    return "\n".join(
        [
            f"{what} of {setup} failed: {failure.reason}",
            "",
            *([f"G_bad: {bad}"] if bad else []),
            "To see it again:",
            "  " + " ".join([*again, "--out again.gif"]),
            "",
            failure.text.strip(),
            "",
        ]
    )

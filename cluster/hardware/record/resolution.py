"""What a person may say of a trial whose outcome nobody recorded, or which was recorded wrongly."""

from typing import Final

from cluster.errors import UsageError
from cluster.hardware.states import State
from workers import setups

OUTCOMES: Final = (State.MEASURED, State.FAILED, State.ABORTED)


def resolution_of(
    outcome: str, note: str, f: float | None, y: float | None
) -> tuple[State, dict[str, str | float | None]]:
    """The state that a trial enters, and what its event says.

    Args:
        outcome: one of `OUTCOMES`.
        note: what was seen.
        f: objective of a measured trial; None otherwise.
        y: badness in [0, 1] of a measured trial; None otherwise.

    Returns:
        The state, and plain values.

    Raises:
        UsageError: an argument is missing, too much, or out of its range.
    """
    if outcome not in OUTCOMES:
        raise UsageError(f"outcome must be one of {', '.join(OUTCOMES)}, got {outcome!r}")
    if not note.strip():
        raise UsageError("a resolution needs a note that says what was seen, got nothing; give --note TEXT")
    if outcome != State.MEASURED:
        if f is not None or y is not None:
            raise UsageError(f"f and y belong to the outcome measured, got f {f} and y {y} for {outcome}")
        return State(outcome), {"note": note}
    if f is None or not abs(f) < float("inf"):
        raise UsageError(f"a measured trial needs a finite objective, got {f}; give --f NUMBER")
    if y is None or not 0.0 <= y <= 1.0:
        raise UsageError(f"a measured trial needs a badness in [0, 1], got {y}; give --y NUMBER")
    return State.MEASURED, {"f": f, "y": y, "note": note}


def objective_limits(setup: str) -> tuple[float, float] | None:
    """The objectives that a setup says are possible; None where its module is not here, so nobody knows."""
    try:
        return setups.load(setup).objective_limits
    except LookupError:
        return None


def require_possible(setup: str, f: float | None, confirmed: float | None) -> None:
    """Refuse an objective that the setup rules out, unless it is typed twice.

    Args:
        setup: name of the robot's.
        f: objective; None for none.
        confirmed: the objective once more.

    Raises:
        UsageError: it is ruled out, and was typed once.
    """
    limits = objective_limits(setup)
    if f is None or confirmed == f or limits is None:
        return
    low, high = limits
    if not low <= f <= high:
        raise UsageError(
            f"the objective of {setup} must lie in [{low:g}, {high:g}], got {f:g}, and one "
            f"outside misleads every later suggestion; if it is meant, type it again with --confirm {f:g}"
        )

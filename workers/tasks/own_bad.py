"""G_bad supplied by a user: any importable function of what an episode showed, in place of the task's own.

Example, in a module `gentle.py`, for `svaedc collect --setup franka --bad gentle:reach`:
    >>> import numpy as np
    >>> def reach(observed):
    ...     x, y, _ = observed.signals["hand_position"]
    ...     return np.clip(np.hypot(x, y) - 0.5, 0.0, 1.0)  # one degree of badness per step
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool, Float32

from workers.environments.environment import Observed
from workers.tasks.task import Bad, Task
from workers.user_code import UserCodeError, describe

Function = Callable[[Observed], Any]
_Marked = TypeVar("_Marked", bound=Function)

_NAMES = "bad_conditions"
_MISTAKES = (ArithmeticError, AttributeError, LookupError, NameError, TypeError, ValueError)


def conditions(*names: str) -> Callable[[_Marked], _Marked]:
    """Marks a function that returns one row of booleans per condition; 1 to 7 names, in the rows' order."""
    if not 1 <= len(names) <= 7:
        raise UserCodeError(f"a function has 1 to 7 conditions, got {len(names)}: {names}")

    def mark(function: _Marked) -> _Marked:
        setattr(function, _NAMES, names)
        return function

    return mark


def marked_conditions(function: Function) -> tuple[str, ...]:
    """Names that `conditions` gave to the rows of a function; () for one that returns one degree per step."""
    names: tuple[str, ...] = getattr(function, _NAMES, ())
    return names


@dataclass(frozen=True)
class OwnBad(Task):
    """The objective of a task with another G_bad; f does not depend on it.

    Attributes:
        task: gives the objective.
        function: G_bad. It sees arrays that it cannot write to.
        conditions: names of its rows; the function's own name when it is graded.
        graded: whether it returns one degree per step instead of rows of booleans.
        bad_name: how the function is imported, `module:function`.
        bad_digest: SHA-256 of the file that defines it.
    """

    task: Task
    function: Function
    conditions: tuple[str, ...]
    graded: bool
    bad_name: str
    bad_digest: str

    def is_bad(self, observed: Observed) -> Bad:
        """The function's own values, checked.

        Raises:
            UserCodeError: the function fails, or its values have another type, shape or range than they must.
        """
        try:
            values = np.asarray(self.function(_read_only(observed)))
        except _MISTAKES as error:
            raise UserCodeError(
                f"{self.bad_name} failed with {describe(error)}. It gets xi "
                f"{observed.xi.shape} and the signals {', '.join(observed.signals) or '(none)'}"
            ) from error
        steps = observed.xi.shape[1]
        return self._degrees(values, steps) if self.graded else self._rows(values, steps)

    def objective(self, observed: Observed, bad: Bad) -> float:  # noqa: ARG002
        """Value an episode by the task's own objective, with its own bad steps.

        Args:
            observed: all steps of the episode.
            bad: not looked at.

        Returns:
            f.
        """
        return self.task.objective(observed, self.task.is_bad(observed))

    def stopped_objective(self, observed: Observed, bad: Bad) -> float:  # noqa: ARG002
        """Value a stopped episode by the task's own objective, with its own bad steps.

        Args:
            observed: the steps that were run.
            bad: not looked at.

        Returns:
            f.
        """
        return self.task.stopped_objective(observed, self.task.is_bad(observed))

    def _degrees(self, values: np.ndarray, steps: int) -> Float32[np.ndarray, "1 time"]:
        if values.dtype.kind not in "bfiu" or values.shape != (steps,):
            raise UserCodeError(
                f"{self.bad_name} must return one number per step, shape ({steps},), got {values.dtype} of "
                f"shape {values.shape}; reduce the other axes, or mark it with "
                "workers.tasks.own_bad.conditions to return one row of booleans per condition"
            )
        outside = np.flatnonzero(~((values >= 0) & (values <= 1)))
        if outside.size:
            raise UserCodeError(
                f"{self.bad_name} must return numbers in [0, 1], got {values[outside[0]]} in step "
                f"{outside[0]}; scale them, or clip them with np.clip(values, 0, 1)"
            )
        return values.astype(np.float32)[None]

    def _rows(self, values: np.ndarray, steps: int) -> Bool[np.ndarray, "conditions time"]:
        expected = (len(self.conditions), steps)
        if values.dtype != np.bool_ or values.shape != expected:
            raise UserCodeError(
                f"{self.bad_name} is marked with {len(self.conditions)} conditions and must return bool of "
                f"shape {expected}, got {values.dtype} of shape {values.shape}; stack one comparison per "
                "condition, or unmark it to return one degree in [0, 1] per step"
            )
        return values


def _read_only(observed: Observed) -> Observed:
    return Observed(_frozen(observed.xi), {name: _frozen(each) for name, each in observed.signals.items()})


def _frozen(array: np.ndarray) -> np.ndarray:
    view = array.view()
    view.flags.writeable = False
    return view

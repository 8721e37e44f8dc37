"""Why a group of training processes ended: some were lost, which another try survives, or one made an error.

A process that is killed reaches the driver as a failed health check around an error of Ray, or as an error of
the controller if that was just asking it for something; what its code raises arrives as it is. When one is
lost, the others' exchange of gradients breaks off, and which of both is noticed first is chance.
"""

import errno
from pathlib import Path

from ray.exceptions import RayActorError, RayError, RayTaskError
from ray.train import ControllerError, TrainingFailedError, WorkerGroupError
from torch.distributed import DistError

from cluster.runtime.ray_internals import health_check_failure, is_train_error

DEATHS = 3
"""One command survives so many deaths of training processes, each from the last checkpoint."""
_TRANSPORTS = ("gloo", "nccl")
"""Torch names one of these in the plain RuntimeErrors which say that another process no longer answers."""


def is_death(error: TrainingFailedError) -> bool:
    """Whether processes were lost; the errors that only follow from that do not count."""
    causes = _causes(error)
    if isinstance(error, ControllerError):
        # Its other errors are of a group that never started.
        return isinstance(causes[0], RayActorError)
    if not causes:
        return False
    if any(map(_is_loss, causes)):
        # How torch words what the others then run into depends on where it meets them.
        return all(_is_consequence(cause) or type(cause) is RuntimeError for cause in causes)
    return all(map(_is_consequence, causes))


def explanation(error: TrainingFailedError, model: Path) -> str:
    """Say why a training ended.

    Args:
        error: that ended the training.
        model: folder of the model.

    Returns:
        One sentence and the remedy.
    """
    causes = _causes(error) or [error]
    if is_death(error):
        told = _first_line(next(filter(_is_loss, causes), causes[0]))
        return (
            f"training processes keep dying, one of them with {told}; when that has an end, the same command "
            f"goes on from the last checkpoint in {model}"
        )
    if isinstance(error, ControllerError):
        reason = str(error.controller_failure).partition("\n")[0]
        return f"the training processes could not start: {reason}; try again when the cluster has room"
    cause = next((each for each in causes if not _is_consequence(each)), causes[0])
    if isinstance(cause, OSError) and cause.errno in (errno.ENOSPC, errno.EDQUOT):
        return (
            f"training stopped: {cause}; free some space and run the same command: it goes on from the last "
            f"checkpoint in {model}"
        )
    return f"training failed: {_first_line(cause)}"


def _causes(error: TrainingFailedError) -> list[Exception]:
    """What ended the controller, or each of the processes."""
    if isinstance(error, ControllerError):
        return [_cause(error.controller_failure)]
    failures = error.worker_failures if isinstance(error, WorkerGroupError) else {}
    return [_cause(failure) for failure in failures.values()]


def _cause(failure: Exception) -> Exception:
    """What is inside Ray's wrappings."""
    inner = failure.cause if isinstance(failure, RayTaskError) else health_check_failure(failure)
    return _cause(inner) if isinstance(inner, Exception) else failure


def _is_loss(cause: Exception) -> bool:
    """Whether a process is gone, or answers no longer; errors inside Ray's tasks are none of that."""
    return (isinstance(cause, RayError) or is_train_error(cause)) and not isinstance(cause, RayTaskError)


def _is_consequence(cause: Exception) -> bool:
    """Whether this is a loss, or what another's loss looks like from here."""
    if type(cause) is RuntimeError:
        return any(transport in str(cause).lower() for transport in _TRANSPORTS)
    return _is_loss(cause) or isinstance(cause, (ConnectionError, DistError))


def _first_line(cause: Exception) -> str:
    """Its first line; a ValueError's is a sentence by itself, all others need their kind."""
    lines = str(cause).strip().splitlines()
    kind = type(cause).__name__
    if not lines:
        return kind
    line = lines[0].rstrip(".")
    return line if isinstance(cause, ValueError) else f"{kind}: {line}"

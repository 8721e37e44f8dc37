"""Where a run comes from, as MLflow shows it: the command that made it, and what that command does."""

import re
import shlex
import sys
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from platform import python_version
from typing import Final

DESCRIPTIONS: Final = {
    "collect": "Simulated episodes of random controllers, collected into a dataset.",
    "plan": "The first few shards of a dataset, and what all of it will cost.",
    "train": "A model of a dataset: the latent space in which Bayesian optimisation runs.",
    "sweep": "Models around a preset, ranked by a cheap proxy of their worth for Bayesian optimisation.",
    "compare": "Methods of Bayesian optimisation side by side in simulation, with a run for each seed.",
    "hardware": "A campaign on one robot: random trials first, then suggested ones.",
    "child": "One of the runs that the run above this one is made of.",
}
"""What MLflow shows of a run, by its kind."""

_PASSWORD: Final = re.compile(r"(?<=://)([^/\s@:]*):[^/\s@]+@")
"""It stands between a colon and an @ in an address."""


def command_line() -> str:
    """What was typed, ready to be typed again; a server's password is left out."""
    program, *arguments = sys.argv or [""]
    return _PASSWORD.sub(r"\1:***@", shlex.join([Path(program).name, *arguments]))


def origin(kind: str) -> dict[str, str]:
    """The tags of a run that say where it comes from, under MLflow's own names."""
    command = command_line()
    described = (
        f"{DESCRIPTIONS.get(kind, kind)}\n\n"
        f"    {command}\n\n"
        f"In `{Path.cwd()}`, by svaedc {_version()} on Python {python_version()}."
    )
    return {
        "mlflow.source.name": command,
        "mlflow.source.type": "LOCAL",
        "mlflow.note.content": described,
    }


def _version() -> str:
    try:
        return version("svaedc")
    except PackageNotFoundError:  # it runs from its sources
        return "unknown"

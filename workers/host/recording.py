"""What a host keeps of a trial: a folder for its driver, and every command that was sent."""

import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from workers.host.limits import HostChannel

COMMANDS = "commands.csv"


def make_folder(trials: Path, trial: str) -> Path:
    """Make the folder of one trial; what an earlier attempt left in it is removed.

    Args:
        trials: folder of all trials.
        trial: its name.

    Returns:
        The folder.

    Raises:
        OSError: it cannot be made.
        ValueError: the name is no name of a folder.
    """
    if not trial or trial != Path(trial).name or trial.startswith("."):
        raise ValueError(f"a trial must have a name that a folder can have, got {trial!r}")
    folder = trials / trial
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def write_table(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write numbers as text from which the same ones are read, to the last bit.

    Args:
        path: of the file.
        header: a name for each column; a comma in it becomes a space.
        rows: numbers, one for each column.

    Raises:
        OSError: the disk is full or broken.
    """
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(name.replace(",", " ") for name in header) + "\n")
        for row in rows:
            file.write(",".join(repr(float(value)) for value in row) + "\n")


def travel(
    channels: Sequence[HostChannel], period: float, sent: Sequence[Sequence[float]]
) -> "dict[str, float]":
    """How far each joint, or the hand along each coordinate, was sent: what wears a robot out.

    Args:
        channels: of every command, in order.
        period: s between two commands.
        sent: commands, each behind the time at which it was sent.

    Returns:
        The sum of all changes by name, in rad or m; nothing for channels that tell no position and no speed.
    """
    found = {}
    for number, channel in enumerate(channels, start=1):
        values = [row[number] for row in sent]
        if channel.kind == "speed":
            found[channel.name] = float(sum(map(abs, values))) * period
        elif channel.kind in ("position", "workspace"):
            found[channel.name] = float(sum(abs(new - old) for old, new in zip(values, values[1:])))  # noqa: B905, RUF007
    return found

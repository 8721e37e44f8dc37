"""A hardware campaign on the terminal: its trials, and what the one that waits for a person will do."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cluster.cli.output import show
from cluster.progress import say

if TYPE_CHECKING:
    from cluster.hardware.status import Status

PER_LINE = 3
"""So many parameters of a controller stand on a line."""


def report_progress(now: "Status") -> None:
    """Say how far a campaign has come."""
    best = "" if now.best is None else f", best objective {now.best:+.3f}"
    say(f"{now.name}: {now.measured} of {now.planned} trials measured{best}")


def show_campaign(now: "Status") -> None:
    """Show a campaign, and what it needs next."""
    from rich.table import Table

    table = Table("trial", "state", "kind", "f", "y", title=f"{now.name}: {now.phase}", title_justify="left")
    for trial in now.trials:
        f, y = ("" if value is None else f"{value:+.3f}" for value in (trial.f, trial.y))
        table.add_row(str(trial.number), str(trial.state), trial.kind, f, y)
    show(table)
    for line in motion_lines(now.motion):
        say(line)
    if now.advice:
        say(now.advice)


def motion_lines(motion: Mapping[str, Any]) -> Iterator[str]:
    """Say what a trial will do, for the person who approves it.

    Args:
        motion: what its check found: `plan`, `predicted_y`, `x`, `simulated`, `clip`, as far as it is known.

    Yields:
        Lines.
    """
    plan = motion.get("plan", {})
    if plan:
        predicted = motion.get("predicted_y")
        expected = "" if predicted is None else f"; badness as the model expects it: {predicted:.2f}"
        yield f"what it will do: {plan['seconds']:g} s of motion{expected}"
        yield from map(_channel, plan["channels"])
    yield from _simulation_lines(motion.get("simulated", {}))
    if motion.get("x"):
        yield "its controller:"
        yield from _parameters(motion["x"])
    if motion.get("clip"):
        yield f"its first simulation, drawn: {motion['clip']}"
    if motion.get("clip_missing"):
        yield f"not drawn: {motion['clip_missing']}"
    if plan.get("rest"):
        rests = ", ".join(f"after {event} they {rest}" for event, rest in plan["rest"].items())
        yield f"what its motors do without commands: {rests}"


def _channel(channel: Mapping[str, Any]) -> str:
    """One joint or coordinate of a plan, how fast it goes, and how near it comes to the robot's limits."""
    said = f"  {channel['name']:<20} {channel['low']:+9.3f} to {channel['high']:+9.3f} {channel['unit']}"
    if channel.get("fastest"):
        said += f", changing by up to {channel['fastest']:.3f} {channel['unit']} in 1 s"
    if channel.get("margin") is not None:
        said += f", {channel['margin']:.3f} {channel['unit']} inside its limits"
    return said


def _simulation_lines(found: Mapping[str, Any]) -> Iterator[str]:
    if not found:
        return
    count, failed = found["simulations"], found["failed"]
    broken = f", {failed} of which failed" if failed else ""
    yield f"simulated {count} times, under physics drawn anew each time{broken}:"
    for name, word in (("y", "badness"), ("f", "objective")):
        if found.get(name):
            mean, low, high = (found[name][part] for part in ("mean", "low", "high"))
            yield f"  {word} {mean:.2f}, in 9 of 10 from {low:.2f} to {high:.2f}"
    held = [f"{name} in {share:.0%}" for name, share in found.get("conditions", {}).items() if share > 0]
    if held:
        yield f"  bad: {', '.join(held)}"
    if found.get("clearance") is not None:
        yield f"  least distance to what it must keep away from: {found['clearance']:.3f} m"
    speeds = [f"{speed:.2f} {unit}" for unit, speed in found.get("fastest", {}).items()]
    if speeds:
        yield f"  fastest change of what is seen: {', '.join(speeds)}"


def _parameters(x: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    units = {each["unit"]: "" if each["unit"] == "1" else each["unit"] for each in x}
    shown = [f"{each['name']} {each['value']:+.3f} {units[each['unit']]}".rstrip() for each in x]
    width = max(map(len, shown)) + 2
    for first in range(0, len(shown), PER_LINE):
        yield "  " + "".join(each.ljust(width) for each in shown[first : first + PER_LINE]).rstrip()

"""`svaedc hardware`: campaigns on one robot, and what a person decides in them."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cluster.cli.documents import one_document
from cluster.cli.options import (
    Address,
    Config,
    Overrides,
    Seed,
    SimulatedCandidates,
    TrainedModel,
    services,
    settings_of,
)
from cluster.cli.output import show
from cluster.hardware.states import Approval
from cluster.inputs import durable
from cluster.progress import say

if TYPE_CHECKING:
    from cluster.hardware.status import Status

app = typer.Typer(
    no_args_is_help=True,
    help="Spend a few precious trials on one robot. Every trial is in a durable journal before it starts and "
    "after it ends; whatever dies, the same `start` command goes on, and no trial runs twice.",
)

Folder = Annotated[
    Path,
    typer.Argument(help="Folder of the campaign, on a local disk of the robot's machine.", callback=durable),
]
TrialNumber = Annotated[int, typer.Option("--trial", min=0, help="Its number, as `status` shows it.")]
Who = Annotated[str, typer.Option("--who", help="Your name; kept in the journal.")]
Note = Annotated[str, typer.Option("--note", help="What you saw, or why; kept in the journal.")]
RobotName = Annotated[str, typer.Argument(help="Which robot, as `svaedc robots` names it.")]
Home = Annotated[
    Path | None,
    typer.Option(
        "--home",
        help="Folder of all that is true of the robot; by default that in /var/lib/svaedc/robots, "
        "or else one in the user's state folder.",
        callback=durable,
    ),
]
Confirmed = Annotated[
    float | None,
    typer.Option("--confirm", help="The objective again, where it lies outside what the setup allows."),
]

AsJson = Annotated[
    bool,
    typer.Option(
        "--json",
        help="Print one JSON document, and nothing else, on standard output: campaign, robot, setup, method, "
        "seed, model, pool, approval, phase, measured, planned, best, advice, trials (number, state, kind, "
        "x, f, y). What was not measured is null.",
    ),
]


@app.command()
def start(
    folder: Folder,
    robot: Annotated[
        str,
        typer.Option(
            "--robot",
            help="Which robot, such as franka-rehearsal (see `svaedc robots`); rehearsal:SETUP simulates any "
            "setup; your own as MODULE:NAME.",
        ),
    ],
    method: Annotated[str, typer.Option("--method", help="How controllers are suggested.")] = "svae-dc",
    model: TrainedModel = None,
    candidates: SimulatedCandidates = None,
    trials: Annotated[
        int, typer.Option("--trials", min=0, help="Suggested trials, after 2 random ones.")
    ] = 10,
    approval: Annotated[
        Approval,
        typer.Option(
            "--approval", help="policy: a rehearsal runs by itself; operator: a person approves each trial."
        ),
    ] = Approval.POLICY,
    pace: Annotated[
        float, typer.Option("--pace", min=0.0, help="Least seconds of a rehearsal's trial.")
    ] = 0.0,
    home: Home = None,
    seed: Seed = 0,
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
) -> None:
    """Carry a campaign out, or go on with it: 2 random trials, then suggested ones."""
    from cluster.hardware.driver import start as run_start
    from cluster.hardware.plan import CampaignPlan, identify
    from cluster.optimization.candidates import TABLE
    from svaedc.model.checkpoint import checkpoint_path

    settings = settings_of(config, overrides)
    checkpoint = checkpoint_path(model) if model else None
    table = candidates / TABLE if candidates else None
    pool = settings.hardware.pool_size
    identity = identify(robot, method, trials, seed, pool, checkpoint, approval, table)
    plan = CampaignPlan(identity, folder, checkpoint, pace, table, home)
    with services(settings, address) as (session, tracker):
        last = run_start(settings.hardware, session, tracker, plan, _report, say)
    _show(last)


@app.command()
def status(folder: Folder, *, as_json: AsJson = False) -> None:
    """How a campaign stands, trial by trial, and what it needs next."""
    from cluster.hardware import operator

    if not as_json:
        _show(operator.status(folder))
        return
    with one_document() as document:
        document |= operator.status(folder).as_json()


@app.command()
def stop(
    robot: RobotName,
    who: Annotated[str, typer.Option("--who", help="Your name.")] = "somebody",
    reason: Annotated[str, typer.Option("--reason", help="Why.")] = "asked for",
    home: Home = None,
) -> None:
    """Stop a robot, whatever else hangs. NO SAFETY FUNCTION: a robot needs an emergency stop of its own."""
    from cluster.hardware.robot import stopping

    found = stopping.stop(robot, home, who, reason)
    say(found.advice)


@app.command()
def clear(robot: RobotName, who: Who, note: Note, home: Home = None) -> None:
    """Let a stopped robot move again, once you have seen that it stands still and is reset."""
    from cluster.hardware.robot import stopping

    why = stopping.clear(robot, home, who, note)
    say(f"{robot} may move again; it had been {why}" if why else f"{robot} was not stopped")


@app.command()
def approve(
    folder: Folder,
    trial: TrialNumber,
    who: Who,
    minutes: Annotated[float, typer.Option("--minutes", help="The approval holds so long.")] = 60.0,
) -> None:
    """Let a checked trial onto the robot: this controller, under these limits, for a while."""
    from cluster.hardware import operator

    operator.approve(folder, trial, who, minutes)
    _show(operator.status(folder))


@app.command()
def withdraw(folder: Folder, trial: TrialNumber, who: Who) -> None:
    """Take an approval back, as long as the trial has not begun."""
    from cluster.hardware import operator

    operator.withdraw(folder, trial, who)
    _show(operator.status(folder))


@app.command()
def reject(folder: Folder, trial: TrialNumber, who: Who, note: Note) -> None:
    """Keep a trial off the robot; neither it nor one near it is suggested again."""
    from cluster.hardware import operator

    operator.reject(folder, trial, who, note)
    _show(operator.status(folder))


@app.command()
def adopt(folder: Folder, who: Who, home: Home = None) -> None:
    """Vouch for a campaign that moved the robot under another home."""
    from cluster.hardware import operator

    operator.adopt(folder, who, home)
    _show(operator.status(folder))


@app.command()
def resolve(
    folder: Folder,
    trial: TrialNumber,
    outcome: Annotated[str, typer.Option("--outcome", help="measured, failed or aborted.")],
    who: Who,
    note: Note,
    f: Annotated[float | None, typer.Option("--f", help="Objective, of a measured trial.")] = None,
    y: Annotated[float | None, typer.Option("--y", help="Badness in [0, 1], of a measured trial.")] = None,
    confirm: Confirmed = None,
) -> None:
    """Say what became of an unknown trial, once the robot stands still and is reset."""
    from cluster.hardware import operator

    operator.resolve(folder, trial, outcome, who, note, f, y, confirm)
    _show(operator.status(folder))


@app.command()
def amend(
    folder: Folder,
    trial: TrialNumber,
    who: Who,
    note: Note,
    f: Annotated[float, typer.Option("--f", help="Objective.")],
    y: Annotated[float, typer.Option("--y", help="Badness in [0, 1].")],
    confirm: Confirmed = None,
) -> None:
    """Correct what a trial measured; the old value stays in the journal."""
    from cluster.hardware import operator

    operator.amend(folder, trial, who, note, f, y, confirm)
    _show(operator.status(folder))


@app.command()
def export(folder: Folder) -> None:
    """Print the whole journal as JSON lines: the campaign, then every event."""
    from cluster.hardware import operator

    for line in operator.export(folder):
        typer.echo(line)


def _report(now: "Status") -> None:
    best = "" if now.best is None else f", best objective {now.best:+.3f}"
    say(f"{now.name}: {now.measured} of {now.planned} trials measured{best}")


def _show(now: "Status") -> None:
    from rich.table import Table

    table = Table("trial", "state", "kind", "f", "y", title=f"{now.name}: {now.phase}", title_justify="left")
    for trial in now.trials:
        f, y = ("" if value is None else f"{value:+.3f}" for value in (trial.f, trial.y))
        table.add_row(str(trial.number), str(trial.state), trial.kind, f, y)
    show(table)
    for line in _motion_lines(now):
        say(line)
    if now.advice:
        say(now.advice)


def _motion_lines(now: "Status") -> Iterator[str]:
    """What the trial that waits will do, for the person who approves it."""
    plan = now.motion.get("plan", {})
    if not plan:
        return
    predicted = now.motion.get("predicted_y")
    expected = "" if predicted is None else f"; badness as the model expects it: {predicted:.2f}"
    yield f"what it will do: {plan['seconds']:g} s of motion{expected}"
    for channel in plan["channels"]:
        yield f"  {channel['name']:<20} {channel['low']:+9.3f} to {channel['high']:+9.3f} {channel['unit']}"
    if plan.get("rest"):
        rests = ", ".join(f"after {event} they {rest}" for event, rest in plan["rest"].items())
        yield f"what its motors do without commands: {rests}"

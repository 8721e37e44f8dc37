"""`svaedc hardware start` and `status`: a campaign is carried out, and looked at."""

from pathlib import Path
from typing import Annotated

import typer

from cluster.cli.documents import one_document
from cluster.cli.hardware.arguments import AsJson, Folder, Home
from cluster.cli.hardware.campaigns import report_progress, show_campaign
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
from cluster.hardware.states import Approval
from cluster.inputs import durable
from cluster.progress import say


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
    first_trials: Annotated[
        Path | None,
        typer.Option(
            "--first-trials",
            help="Folder of a campaign on the same robot; its first 2 trials count here too, nothing moves.",
            callback=durable,
        ),
    ] = None,
    home: Home = None,
    seed: Seed = 0,
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
) -> None:
    """Carry a campaign out, or go on with it: 2 random trials, then suggested ones."""
    from cluster.hardware.driver import start as run_start
    from cluster.hardware.plan import CampaignPlan, identify
    from cluster.hardware.record.first_trials import first_trials as shared
    from cluster.hardware.record.foresight import Foresight
    from cluster.hardware.status import RANDOM_TRIALS
    from cluster.optimization.candidates import TABLE
    from svaedc.model.checkpoint import checkpoint_path

    settings = settings_of(config, overrides)
    checkpoint = checkpoint_path(model) if model else None
    table = candidates / TABLE if candidates else None
    ours = settings.hardware
    first = shared(first_trials, robot, RANDOM_TRIALS) if first_trials else ()
    identity = identify(
        robot, method, trials, seed, ours.pool_size, checkpoint, approval, table, ours.avoid_distance, first
    )
    foresight = Foresight(ours.simulations, ours.clip)
    plan = CampaignPlan(identity, folder, checkpoint, pace, table, home, first, foresight)
    with services(settings, address) as (session, tracker):
        last = run_start(settings.hardware, session, tracker, plan, report_progress, say)
    show_campaign(last)


def status(folder: Folder, *, as_json: AsJson = False) -> None:
    """How a campaign stands, trial by trial, and what it needs next."""
    from cluster.hardware import operator

    if not as_json:
        show_campaign(operator.status(folder))
        return
    with one_document() as document:
        document |= operator.status(folder).as_json()

"""`svaedc render`: an episode to look at."""

from pathlib import Path
from typing import Annotated

import typer

from cluster.cli.options import SetupName, TrainedModel
from cluster.inputs import durable, setup_of

X_HELP = "random:SEED, dataset:FOLDER:INDEX, an .npy file, or D numbers in [0, 1] separated by commas."
SEED_HELP = "Draws the physics as data collection does. Without it: the dataset episode's own, or nominal."
PHYSICS_HELP = "Physics of the episode, NAME=VALUE,...; what is not named is nominal. Instead of --seed."
SPEED_HELP = "Of a clip; 0.2 is five times slower than life. Without it, a clip lasts 5 to 8 s."


def render(
    setup: SetupName,
    x: Annotated[str, typer.Option("--x", metavar="CONTROLLER", help=X_HELP)],
    out: Annotated[
        Path, typer.Option("--out", help="A clip, .gif or .mp4, or stills, .png.", callback=durable)
    ],
    seed: Annotated[int | None, typer.Option("--seed", min=0, help=SEED_HELP)] = None,
    physics: Annotated[str, typer.Option("--physics", metavar="NAME=VALUE,...", help=PHYSICS_HELP)] = "",
    speed: Annotated[float | None, typer.Option("--speed", help=SPEED_HELP)] = None,
    fps: Annotated[int, typer.Option("--fps", min=1, max=50, help="Pictures per second of a clip.")] = 10,
    stills: Annotated[int, typer.Option("--stills", min=1, max=60, help="Pictures of a .png.")] = 6,
    width: Annotated[int, typer.Option("--width", help="Pixels of each picture.")] = 360,
    height: Annotated[int, typer.Option("--height", help="Pixels of each picture.")] = 270,
    model: TrainedModel = None,
) -> None:
    """Show an episode of any setup as a clip or as stills; needs no screen.

    The episode runs as everywhere else, and its trajectory is drawn afterwards: nothing in it changes. A red
    border and a name mark the steps in which a bad condition holds.

    A random controller, that of episode 0 of datasets with seed 7: `svaedc render --setup franka --x random:7
    --out push.gif`

    An episode as it was recorded: `svaedc render --setup franka --x dataset:data/franka:12 --out push.png`

    Your own controller, under other physics, as fast as life: `svaedc render --setup daisy-11d --x best.npy
    --seed 3 --speed 1 --out walk.mp4`

    An episode beside what a trained model reconstructs of it, and generates from its controller alone:
    `svaedc render --setup franka --x dataset:data/franka:12 --model models/franka --out told.gif`
    """
    from cluster.rendering.episodes import physics_of
    from cluster.rendering.render import Drawing
    from cluster.rendering.render import render as render_episode

    chosen = setup_of(setup)
    given = physics_of(chosen, seed, physics)
    render_episode(chosen, x, given, Drawing(out, width, height, speed, fps, stills), model)

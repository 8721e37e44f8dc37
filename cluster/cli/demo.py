"""`svaedc demo`: the whole pipeline, small and real."""

from pathlib import Path
from typing import Annotated

import typer

from cluster.cli.options import Address, Config, Overrides, services, settings_of
from cluster.inputs import durable


def demo(
    folder: Annotated[Path, typer.Option("--folder", help="Where everything goes.", callback=durable)] = Path(
        "svaedc-demo"
    ),
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
) -> None:
    """The main job, small and real: collect, train and compare on the Franka push, in a few minutes."""
    from cluster.demo import demo as run_demo

    folder.mkdir(parents=True, exist_ok=True)
    settings = settings_of(config, [f"tracking.uri=sqlite:///{folder / 'mlflow.db'}", *(overrides or [])])
    with services(settings, address) as (session, tracker):
        run_demo(folder, settings, session, tracker)

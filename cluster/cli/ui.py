"""`svaedc ui`: everything that was recorded, in a browser."""

from typing import Annotated

import typer

from cluster.cli.options import Config, Overrides, settings_of
from cluster.progress import say


def ui(
    port: Annotated[int, typer.Option("--port", min=1, max=65535, help="On 127.0.0.1.")] = 5000,
    config: Config = None,
    overrides: Overrides = None,
) -> None:
    """Show every run in a browser: serves MLflow on this machine only."""
    from cluster.tracking.server import serve_ui

    serve_ui(settings_of(config, overrides).tracking, port, lambda url: say(f"open {url}  (Ctrl-C ends it)"))

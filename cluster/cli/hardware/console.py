"""The operator's console, and who may enter it."""

from pathlib import Path
from typing import Annotated

import typer

from cluster.cli.hardware.arguments import Folder, Home, RobotName
from cluster.errors import UsageError
from cluster.inputs import durable
from cluster.progress import say


def console(
    folder: Folder,
    port: Annotated[
        int, typer.Option("--port", min=1024, max=65534, help="Of the console; STOP has the next one.")
    ] = 8400,
    address: Annotated[
        str, typer.Option("--address", help="To listen on; any but this machine's own needs a certificate.")
    ] = "127.0.0.1",
    certificate: Annotated[
        Path | None, typer.Option("--certificate", help="For TLS, a PEM file.", callback=durable)
    ] = None,
    key: Annotated[
        Path | None, typer.Option("--key", help="Of the certificate, a PEM file.", callback=durable)
    ] = None,
    name: Annotated[
        list[str] | None,
        typer.Option("--name", help="Host under which browsers reach it; may be repeated."),
    ] = None,
) -> None:
    """Show a campaign in a browser, where people approve, resolve, attach and STOP. NO SAFETY FUNCTION.

    Run it on the robot's computer. STOP is a process of its own, which works when this one does not.
    """
    try:
        from cluster.console.serve import Place, serve
    except ModuleNotFoundError as error:
        raise UsageError(
            f"the console needs the package {error.name}: install svaedc with it, pip install svaedc[console]"
        ) from error

    serve(folder, Place(address, port, certificate, key, tuple(name or ())), say)


def token(
    robot: RobotName,
    add: Annotated[
        str | None, typer.Option("--add", help="Person who gets a token; it is shown once.")
    ] = None,
    role: Annotated[str, typer.Option("--role", help="viewer: may look; operator: may decide.")] = "viewer",
    revoke: Annotated[str | None, typer.Option("--revoke", help="Person whose token ends now.")] = None,
    home: Home = None,
) -> None:
    """Who may enter a robot's console: list them, add one, or revoke one."""
    from cluster.console.tokens import change

    for line in change(robot, home, add, role, revoke):
        say(line)

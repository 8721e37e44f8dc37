"""The host's process: `python workers/host --machine MODULE:NAME --home DIR --robot NAME --settings JSON`.

It is started by `svaedc hardware`, with the Python of the robot's driver. The folder is run as it is: nothing
of the project has to be installed there.
"""

import argparse
import contextlib
import importlib
import json
import os
import sys
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def _let_itself_be_imported() -> None:
    """`workers` without what it imports: only this room's modules are used of it, unless a driver asks."""
    if "workers" in sys.modules:
        return
    package = types.ModuleType("workers")
    package.__path__ = [str(Path(__file__).resolve().parent.parent)]
    sys.modules["workers"] = package


def main() -> int:
    """Serve one robot until nobody asks any more; the exit status is 0 unless it could not begin."""
    _let_itself_be_imported()
    from workers.host import protocol
    from workers.host.home import RobotHome
    from workers.host.limits import RobotLimits
    from workers.host.serve import Host, serve

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machine", required=True)
    parser.add_argument("--home", required=True, type=Path)
    parser.add_argument("--robot", required=True)
    parser.add_argument("--settings", default="{}")
    options = parser.parse_args()
    lines, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # what a driver prints must not be taken for an answer

    def say(message: Mapping[str, Any]) -> None:
        with contextlib.suppress(OSError):  # nobody listens: the end of its input will say so too
            answers.write(protocol.line_of(message))

    try:
        settings = json.loads(options.settings)
        sys.path += [entry for entry in settings.get("path", ()) if entry not in sys.path]
        machine = _machine(options.machine, settings.get("machine", {}))
        limits = RobotLimits.read(settings.get("limits", {}), "limits")
        home = RobotHome(options.home, options.robot)
        period = float(settings.get("period", machine.period))
        host = Host(home, machine, limits, say, period, float(settings["silence"]))
    except Exception as error:  # noqa: BLE001 - a driver may raise anything; it is told, not shown
        say({"say": "absent", "reason": f"{type(error).__name__}: {error}"})
        return 1
    try:
        serve(host, lines)
    finally:
        host.close()
    sys.stderr.flush()
    os._exit(0)  # the robot is at rest: what its libraries do at the end of a process must not delay that


def _machine(name: str, settings: Mapping[str, Any]) -> Any:
    module, _, attribute = name.partition(":")
    sys.path.append(os.getcwd())  # noqa: PTH109 - what a user calls the working directory
    return getattr(importlib.import_module(module), attribute)(**settings)


if __name__ == "__main__":
    sys.exit(main())

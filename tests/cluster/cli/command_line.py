"""The installed command, as a user starts it."""

import os
import subprocess
import sys
from pathlib import Path


def svaedc(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != "RAY_ADDRESS"}
    return subprocess.run(
        [str(Path(sys.executable).parent / "svaedc"), *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=environment,
    )

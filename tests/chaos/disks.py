"""Disks of a few kilobytes: memory mounted in a name space of its own, where the kernel itself says no."""

import errno
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.chaos.drivers import REPOSITORY, collected_here


def alone(arguments: Sequence[str]) -> list[str]:
    """A command that mounts things where nobody else sees them, and needs nobody's leave for it."""
    return ["unshare", "--map-root-user", "--mount", *arguments]


def small(option: str, folder: Path, out: Path, arguments: Sequence[str]) -> list[str]:
    """A command while a folder is a disk, as small as the option of `mount` says; then it is copied out."""
    shell = 'mount -t tmpfs -o "$1" tmpfs "$2" && from="$2" to="$3" && shift 3 && "$@"; code=$?; '
    shell += 'cp -a "$from/." "$to" && exit $code'
    return alone(["sh", "-c", shell, "sh", option, str(folder), str(out), *arguments])


def refusal(folder: Path) -> str:
    """Why no small disk can be had here; "" when one can."""
    command = small("size=8k", folder, folder.parent, ["true"])
    return subprocess.run(command, capture_output=True, text=True, check=False).stderr.strip()


def fill_each(folder: Path, out: Path, options: Sequence[str], episodes: int) -> str:
    """Collect on one small disk after the other until it is full, and copy it to `out`; what went wrong."""
    arguments = [sys.executable, "-m", __name__, str(folder), str(out), str(episodes), *options]
    done = subprocess.run(alone(arguments), cwd=REPOSITORY, capture_output=True, text=True, check=False)
    return done.stderr if done.returncode else ""


def _fill(folder: Path, copy: Path, option: str, episodes: int) -> None:
    subprocess.run(["mount", "-t", "tmpfs", "-o", option, "tmpfs", str(folder)], check=True)
    try:
        collected_here(folder, episodes)
        sys.exit(f"{option} is enough for {episodes} episodes")
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
    finally:
        shutil.copytree(folder, copy)
        subprocess.run(["umount", str(folder)], check=True)


if __name__ == "__main__":
    for each in sys.argv[4:]:
        _fill(Path(sys.argv[1]), Path(sys.argv[2]) / each, each, int(sys.argv[3]))

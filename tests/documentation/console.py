"""A page carried out in a shell, as a reader would, and held against what it says is printed."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.documentation.pages import ROOT, Step

LONGEST_SECONDS = 3600
_MARK = "=== documentation"
_COLOUR = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


@dataclass(frozen=True)
class Done:
    """A step with what it printed and its exit status."""

    step: Step
    printed: str
    status: int

    def complaint(self) -> str:
        """What differs from the page; "" when nothing does.

        Only a command whose output says "error: " may fail, and must; where no output is shown, any will do.
        """
        where = f"line {self.step.line}: $ {self.step.command}"
        fails = bool(re.search(r"^error: ", self.step.expected, re.MULTILINE))
        if fails != (self.status != 0):
            return f"{where}\nends with {self.status}:\n{self.printed}"
        if not self.step.expected or is_printed(self.step.expected, self.printed):
            return ""
        return f"{where}\nprints\n{self.printed}\ninstead of\n{self.step.expected}"


def is_printed(expected: str, printed: str) -> bool:
    """Whether a text is what a page shows: "…" stands for anything, and so do cuts into lines."""
    pieces = [re.escape(" ".join(piece.split())) for piece in expected.split("…")]
    pattern = r"\s*.*?\s*".join(pieces)
    return re.fullmatch(rf"\s*{pattern}\s*", " ".join(printed.split()), re.DOTALL) is not None


def carry_out(steps: Sequence[Step], folder: Path, home: Path) -> list[Done]:
    """All steps in one shell, which starts in a folder with a copy of the examples.

    Args:
        steps: of a page.
        folder: an empty one.
        home: of the user; caches are kept there from page to page.

    Returns:
        What each printed; fewer than steps when the shell ended before.
    """
    shutil.copytree(ROOT / "examples", folder / "examples", ignore=shutil.ignore_patterns("__pycache__"))
    script = folder / ".page.sh"
    script.write_text(_script(steps), encoding="utf-8")
    process = subprocess.Popen(
        ["bash", script.name],
        cwd=folder,
        env=_environment(home),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        start_new_session=True,
    )
    try:
        printed, _ = process.communicate(timeout=LONGEST_SECONDS)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGTERM)
        printed, _ = process.communicate(timeout=60)
    return _parts(steps, printed)


def _script(steps: Sequence[Step]) -> str:
    lines = ["exec 2>&1", "trap 'kill $(jobs -p) 2>/dev/null' EXIT"]
    for number, step in enumerate(steps):
        lines += [f"printf '\\n{_MARK} {number}\\n'", step.command, f"printf '\\n{_MARK} status %s\\n' $?"]
    return "\n".join([*lines, "exit 0", ""])


def _parts(steps: Sequence[Step], printed: str) -> list[Done]:
    """The output, cut at the marks between the steps."""
    plain = _COLOUR.sub("", printed)
    pattern = re.compile(rf"\n{_MARK} (\d+)\n(.*?)\n{_MARK} status (\d+)\n", re.DOTALL)
    return [
        Done(steps[int(part.group(1))], part.group(2), int(part.group(3))) for part in pattern.finditer(plain)
    ]


def _environment(home: Path) -> dict[str, str]:
    kept = {
        key: value for key, value in os.environ.items() if key not in ("RAY_ADDRESS", "CI", "XDG_STATE_HOME")
    }
    path = f"{Path(sys.executable).parent}{os.pathsep}{kept['PATH']}"
    shown = {"COLUMNS": "110", "NO_COLOR": "1", "TERM": "dumb", "LC_ALL": "C.UTF-8"}
    return {**kept, **shown, "HOME": str(home), "PATH": path}

"""Loading PyBullet is nobody's news."""

import subprocess
import sys

LOAD = """
import sys
print("before")
print("before", file=sys.stderr)
from workers.simulation.bullet import pybullet
print("after", pybullet.DIRECT)
print("after", file=sys.stderr)
"""


def test_only_what_the_program_itself_says_is_printed():
    said = subprocess.run([sys.executable, "-c", LOAD], capture_output=True, text=True, check=True)
    assert said.stdout == "before\nafter 2\n"
    assert said.stderr == "before\nafter\n"


def test_it_loads_in_a_process_that_has_closed_standard_error():
    closed = "import os; os.close(2); import workers.simulation.bullet"
    assert subprocess.run([sys.executable, "-c", closed], check=False).returncode == 0

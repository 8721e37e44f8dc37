"""An arm that moves nothing and writes down every command, in the standard library alone."""

import hashlib
import os
import time

from workers.host.limits import HostChannel
from workers.host.machine import Fault, Plan, Rest, RobotMachine

STEPS, PERIOD = 50, 0.01


class Arm(RobotMachine):
    """Joints that swing by x; at step `at`, `trouble` happens."""

    rest = Rest(stop="hold", kill="sag", silence="go on", disconnect="drop")

    def __init__(self, log, trouble="", at=10, steps=STEPS, kill="sag", seed=0, ledger=""):
        del seed  # nothing is hidden here
        self._ledger = ledger
        self.rest = Rest(stop="hold", kill=kill, silence="go on", disconnect="drop")
        self.period = PERIOD
        self.channels = tuple(HostChannel(f"joint{number}", "position", "rad") for number in (1, 2))
        self._log, self._trouble, self._at, self._steps = log, trouble, at, steps
        self._stopped = False
        if trouble == "absent":
            raise OSError("no arm at /dev/ttyUSB0")

    def _row(self, x, step):
        wanted = [0.5 * value * step / self._steps for value in x[:2]]
        if self._trouble in ("beyond", "cannot stop") and step == self._at:
            wanted[1] = 9.0
        if self._trouble == "nan" and step == self._at:
            wanted[0] = float("nan")
        return wanted

    def plan(self, x):
        honest = [[0.5 * value * step / self._steps for value in x[:2]] for step in range(self._steps)]
        return Plan(self.channels, self.period, honest, self._steps * self.period)

    def begin(self, x):
        self._x, self._stopped, self._sent = x, False, 0
        self._write("begin", x)

    def command(self, step):
        return None if step == self._steps else self._row(self._x, step)

    def send(self, command):
        self._write("command", command)
        self._sent += 1
        if self._sent == self._at:
            self._meet_trouble()

    def _meet_trouble(self):
        if self._trouble == "raises":
            raise ZeroDivisionError("a division in the driver")
        if self._trouble == "fault":
            raise Fault("a motor is hot")
        if self._trouble == "hangs":
            while not self._stopped:
                time.sleep(0.001)
            raise Fault("woken by a stop")
        if self._trouble == "hangs for ever":
            time.sleep(3600)
        if self._trouble == "prints":
            print("noise of a library", flush=True)
        if self._trouble == "dies":
            os._exit(9)

    def stop(self):
        self._stopped = True
        self._write("stop", [])
        if self._trouble == "cannot stop":
            raise OSError("the bus is gone")

    def end(self):
        if self._trouble == "fills the disk":
            os.rename(self._ledger, f"{self._ledger}.away")  # noqa: PTH104
            os.mkdir(self._ledger)  # noqa: PTH102 - nothing can be added to a folder
        if self._trouble == "measures nothing":
            return {"f": float("nan"), "y": 0.25, "stop": "", "evidence": "a" * 64}
        if self._trouble == "measures badly":
            return {"f": 0.0, "y": 7, "stop": "", "evidence": "a" * 64}
        return {"f": sum(self._x), "y": 0.25, "stop": "", "evidence": hashlib.sha256(b"arm").hexdigest()}

    def _write(self, what, values):
        with open(self._log, "a") as file:  # noqa: PTH123
            file.write(f"{time.clock_gettime(time.CLOCK_BOOTTIME)} {what} {list(values)}\n")


def commands(log):
    """When each command was sent, in s of CLOCK_BOOTTIME."""
    return [float(line.split()[0]) for line in lines(log) if line.split()[1] == "command"]


def lines(log):
    try:
        with open(log) as file:  # noqa: PTH123
            return file.read().splitlines()
    except FileNotFoundError:
        return []

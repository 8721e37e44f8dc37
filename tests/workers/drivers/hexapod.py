"""The hexapod's driver in an environment of its own, with the maker's imitation of its modules."""

import os

from workers.hardware.robots import Robot

WALKED = 1.5


def hexapod(python, **settings) -> Robot:
    """The robot that the page shows, with a short gait."""
    known = {"steps": 30, "measure": "tape:walked", **settings}
    return Robot("hebi", "daisy-11d", "workers.drivers.hebi:HebiHexapod", os.fspath(python), known)

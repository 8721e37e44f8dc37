"""Ray Tune, kept quiet."""

import logging
import os

_ENVIRONMENT = {
    "TUNE_DISABLE_SIGINT_HANDLER": "1",  # Ctrl-C is ours to handle
    "TUNE_DISABLE_AUTO_CALLBACK_LOGGERS": "1",  # records of our own make its files superfluous
    "RAY_AIR_NEW_OUTPUT": "0",  # the new one prints whatever the verbosity
}


def silence_tune() -> None:
    """Keeps Tune from speaking to the user, who hears of everything from us."""
    os.environ.update(_ENVIRONMENT)
    logging.getLogger("ray.tune").setLevel(logging.CRITICAL)

"""A user's own module with functions of badness, right and wrong ones; the fixture `gentle` writes it."""

SHIFT = 7
SOURCE = f"""
import numpy as np
from workers.tasks.own_bad import conditions

def rough(observed):
    x, y, z = observed.signals["hand_position"]
    return np.clip(np.abs(y) + np.abs(np.sin(200 * x)), 0, 1)

def flipped(observed):
    return 1 - rough(observed)

def shifted(observed):
    return np.concatenate([np.zeros({SHIFT}), rough(observed)[:-{SHIFT}]])

@conditions("left", "high", "never")
def rows(observed):
    x, y, z = observed.signals["hand_position"]
    return np.stack([y > 0.2, z > 0.2, z > 9])

def first_place(observed):
    return np.clip(observed.xi[7], 0, 1)

def yes_or_no(observed):
    return observed.xi[0] > 0.4

def all_channels(observed):
    return np.zeros_like(observed.xi)

def not_a_number(observed):
    return np.where(np.arange(observed.xi.shape[1]) == 17, np.nan, 0.5)

def too_large(observed):
    return np.full(observed.xi.shape[1], 1.5)

def words(observed):
    return np.full(observed.xi.shape[1], "bad")

def misspelt(observed):
    return observed.signals["hand_positions"][0]

def nothing(observed):
    pass

def writes(observed):
    observed.xi[:] = 0.0

@conditions("one", "two")
def one_row(observed):
    return observed.xi[:1] > 0.4

@conditions("one")
def numbers(observed):
    return observed.xi[:1]
"""

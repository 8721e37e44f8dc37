"""What one suggestion costs: CPU time of every method at 22 trials, and as a ratio to `botorch`, in one run.

The model is untrained, of the compact preset's size for the Franka: what it says does not matter here.
"""

import argparse
import os
import statistics
from time import process_time

import numpy as np
import torch

from svaedc.bo import methods
from svaedc.bo.candidates import Problem
from svaedc.bo.distribution_features import Densities
from svaedc.bo.features import Latents
from svaedc.bo.history import History
from svaedc.bo.online import Adjustable
from svaedc.bo.strategies import Method
from svaedc.model.svae_dc import SvaeDc
from svaedc.training.presets import Sizes, compact

DIMENSIONS, OBSERVATIONS, STEPS = 48, 25, 100
REFERENCE = "botorch"
SLOW = ("saasbo",)


def problem(pool_size: int) -> Problem:
    """A run's pool, and what an untrained model says of it."""
    torch.manual_seed(0)
    model = SvaeDc(compact(Sizes(DIMENSIONS, OBSERVATIONS, STEPS)).model).eval()
    model.requires_grad_(requires_grad=False)
    pool = np.random.default_rng(0).random((pool_size, DIMENSIONS), dtype=np.float32)
    latents = Latents.of(torch.from_numpy(pool), model.latent_means)
    return Problem(DIMENSIONS, (-2.0, 2.0), pool, latents, Densities.of(model), Adjustable(model))


def history(trials: int) -> History:
    """Random controllers with a smooth objective."""
    grown = History.empty(DIMENSIONS)
    for x in np.random.default_rng(1).random((trials, DIMENSIONS), dtype=np.float32):
        grown = grown.append(x, float(1 - ((x[:6] - 0.3) ** 2).sum() + 0.3 * np.sin(8 * x[7])))
    return grown


def cpu_seconds(method: Method, past: History, rounds: int) -> float:
    """Median over rounds of one suggestion, after one that is not counted."""
    method.suggest(past, np.random.default_rng(0))
    seconds = []
    for index in range(rounds):
        begin = process_time()
        method.suggest(past, np.random.default_rng(index))
        seconds.append(process_time() - begin)
    return statistics.median(seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--methods", help="names, separated by commas; all but saasbo without it")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--trials", type=int, default=22)
    parser.add_argument("--pool-size", type=int, default=5000)
    options = parser.parse_args()
    torch.set_num_threads(1)
    wanted = options.methods.split(",") if options.methods else [n for n in methods.names() if n not in SLOW]
    given, past = problem(options.pool_size), history(options.trials)
    reference = cpu_seconds(methods.build(REFERENCE, given), past, options.rounds)
    print(f"{options.trials} trials, pool of {options.pool_size}, load {os.getloadavg()[0]:.1f}, one thread")
    print(f"{'method':<20} {'build, ms':>10} {'suggestion, ms':>15} {f'/ {REFERENCE}':>10}")
    for name in wanted:
        begin = process_time()
        method = methods.build(name, given)
        built = process_time() - begin
        seconds = cpu_seconds(method, past, options.rounds)
        print(f"{name:<20} {built * 1e3:>10.0f} {seconds * 1e3:>15.0f} {seconds / reference:>10.2f}")


if __name__ == "__main__":
    main()

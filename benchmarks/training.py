"""Updates per CPU second of training: compact and paper, cache and memory, our loop and a plain one.

Prints ratios of CPU time, medians of interleaved rounds in one run, with one thread; `--rounds N` repeats
more often. The last ratios have our loop as a process of Ray Train runs it, with its checkpoints and reports,
against the plain loop in that same process and in this one. The first epoch is left out there: what a process
does only once, such as loading the optimiser's modules, is no part of a loop.
"""

import argparse
import json
import math
import os
import statistics
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from ray.train import RunConfig, ScalingConfig
from ray.train.torch import TorchTrainer
from torch import nn

from cluster.config import CollectSettings, RaySettings, TrackingSettings
from cluster.datasets.collect import collect
from cluster.datasets.plan import plan_collection
from cluster.runtime.session import connect
from cluster.tracking import open_tracker
from cluster.training.worker import TrainingJob, episodes, train_together
from svaedc.data.episodes import Batch, Episodes, split
from svaedc.model.svae_dc import initialized_model
from svaedc.training.loop import fit
from svaedc.training.objectives import Objective
from svaedc.training.presets import Sizes, compact, paper
from workers import setups

COUNT, D, OBSERVATIONS = 2_000, 48, 25
STEPS = {1: 500, 5: 100}
BOUNDS = ([0.0] * OBSERVATIONS, [1.0] * OBSERVATIONS)
UPDATES = 250  # one epoch with its measures on held-out episodes
EPOCHS = 3  # under Ray Train, the first of them not measured


def arrays(stride):
    rng = np.random.default_rng(0)
    xi = rng.random((COUNT, OBSERVATIONS, STEPS[stride]), dtype=np.float32)
    bad = (rng.random((COUNT, STEPS[stride])) < 0.5).astype(np.float32)
    return rng.random((COUNT, D), dtype=np.float32), xi, bad, bad.mean(1)


def in_memory(stride):
    return split(Episodes(*arrays(stride), np.arange(COUNT)), np.arange(9, COUNT, 10))


def in_cache(folder, stride):
    mapped = []
    for name, array in zip(("x", "xi", "bad", "y"), arrays(stride), strict=True):
        np.save(folder / f"{name}{stride}.npy", array)
        mapped.append(np.load(folder / f"{name}{stride}.npy", mmap_mode="r"))
    return split(Episodes(*mapped, np.arange(COUNT)), np.arange(9, COUNT, 10))


def preset_of(name, stride, updates, batch_size=None, held_out_sample=512):
    model, training = {"compact": compact, "paper": paper}[name](Sizes(D, OBSERVATIONS, STEPS[stride]))
    training = replace(training.with_updates(joint=updates, prior=0), epoch_updates=updates)
    training = replace(training, held_out_sample=held_out_sample)
    return model, replace(training, batch_size=batch_size or training.batch_size)


def head(name, stride, updates, batch_size):
    """For a few updates, measures on held-out episodes would count too much."""
    return preset_of(name, stride, updates, batch_size, held_out_sample=2)


def ours(halves, preset):
    """CPU seconds per update of our loop, its measures included."""
    model = initialized_model(preset[0], halves[0], BOUNDS, seed=0)
    begin = time.process_time()
    reports = list(fit(model, *halves, preset[1]))
    return (time.process_time() - begin) / reports[-1].update


def plain(halves, preset):
    """CPU seconds per update of the leanest loop around the same model: no measures, states or reports."""
    model = initialized_model(preset[0], halves[0], BOUNDS, seed=0)
    settings, training = preset[1], halves[0]
    columns = [
        torch.from_numpy(np.asarray(array)[training.rows])
        for array in (training.x, training.xi, training.bad, training.y)
    ]
    objective = Objective(model, settings.weighting)
    optimiser = torch.optim.AdamW(model.parameters(), settings.joint.learning_rate, weight_decay=0.0)
    elements = OBSERVATIONS * preset[0].time_steps
    begin = time.process_time()
    for update in range(settings.joint.updates):
        for group in optimiser.param_groups:
            group["lr"] = settings.joint.learning_rate_at(update)
        rows = torch.randint(len(training), (settings.batch_size,))
        terms = objective(Batch(*(column[rows] for column in columns)))
        bound = terms["log_p_xi"] + terms["log_p_y"] - terms["kl"]
        loss = -(bound + settings.weighting.from_x(terms)) / elements
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(model.parameters(), settings.joint.gradient_norm)
        optimiser.step()
    return (time.process_time() - begin) / settings.joint.updates


class Clock:
    """Takes the place of the driver: notes the process's CPU time whenever the job reports."""

    def __init__(self):
        self.marks = []

    def __call__(self, message):
        """Note one report."""
        self.marks.append((message.get("stage"), time.process_time()))


def worker(config):
    """CPU seconds per update in a process of Ray Train: ours, checkpoints included, and the plain loop's."""
    import ray.train

    torch.set_num_threads(1)
    job = config["job"]
    cache = job.data()
    clock = Clock()
    train_together(job, clock)
    joint = [seconds for stage, seconds in clock.marks if stage == "joint"]
    seconds = {
        "ours": (joint[-1] - joint[0]) / (job.updates - UPDATES),
        "plain": plain(episodes(cache), shortened(job.settings(cache))),
    }
    (job.model / "seconds.json").write_text(json.dumps(seconds), encoding="utf-8")
    ray.train.report({})


def shortened(preset):
    """One epoch of it."""
    return preset[0], preset[1].with_updates(joint=UPDATES, prior=0)


def under_ray(folder, session):
    """CPU seconds per update under Ray Train, ours and the plain loop's; and the plain loop's here."""
    tracker = open_tracker(TrackingSettings(uri=f"sqlite:///{folder}/mlflow.db"))
    dataset = collect(
        plan_collection(
            setup=setups.load("franka"),
            episodes=512,
            folder=folder / "dataset",
            seed=0,
            settings=CollectSettings(episodes_per_shard=128),
        ),
        CollectSettings(episodes_per_shard=128),
        session,
        tracker,
    )
    (folder / "model").mkdir()
    paths = [(folder / name).resolve() for name in ("dataset", "model", "cache")]
    origin = {"dataset": dataset.fingerprint()}
    job = TrainingJob(*paths, origin, "compact", EPOCHS * UPDATES, 5, 0, math.inf, 1)
    TorchTrainer(
        worker,
        train_loop_config={"job": job},
        scaling_config=ScalingConfig(num_workers=1),
        run_config=RunConfig(storage_path=str(folder / "ray")),
    ).fit()
    found = json.loads((job.model / "seconds.json").read_text(encoding="utf-8"))
    return found["ours"], found["plain"], plain(episodes(job.data()), shortened(job.settings(job.data())))


def ratio(rounds, numerator, denominator):
    """Median over rounds of numerator's updates per second over the denominator's."""
    return statistics.median(denominator() / numerator() for _ in range(rounds))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    rounds = parser.parse_args().rounds
    torch.set_num_threads(1)
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, one thread, {rounds} rounds, CPU time")
    with tempfile.TemporaryDirectory() as name:
        memory = {stride: in_memory(stride) for stride in STEPS}
        cache = in_cache(Path(name), 5)
        small = preset_of("compact", 5, UPDATES)
        rows = [
            (
                "compact (stride 5, batches of 128) / paper (stride 1, 32)",
                ">= 5",
                lambda: ours(memory[5], head("compact", 5, 40, 128)),
                lambda: ours(memory[1], head("paper", 1, 8, 32)),
            ),
            (
                "  the same at equal batches of 32",
                "-",
                lambda: ours(memory[5], head("compact", 5, 60, 32)),
                lambda: ours(memory[1], head("paper", 1, 8, 32)),
            ),
            (
                "  the same at equal stride 5 and batches of 32",
                "-",
                lambda: ours(memory[5], head("compact", 5, 60, 32)),
                lambda: ours(memory[5], head("paper", 5, 20, 32)),
            ),
            (
                "batches from the cache / from memory",
                ">= 0.9",
                lambda: ours(cache, small),
                lambda: ours(memory[5], small),
            ),
            (
                "our loop with its measures / a plain PyTorch loop",
                ">= 0.9",
                lambda: ours(memory[5], small),
                lambda: plain(memory[5], small),
            ),
        ]
        for label, target, numerator, denominator in rows:
            print(f"  {label:<60}{ratio(rounds, numerator, denominator):6.2f}   target {target}", flush=True)
        with connect(RaySettings(num_cpus=2), address=None) as session:
            ours_there, plain_there, plain_here = under_ray(Path(name), session)
        label = "our loop under Ray Train / a plain loop in the same process"
        print(f"  {label:<60}{plain_there / ours_there:6.2f}   target >= 0.9", flush=True)
        label = "  the same / a plain loop in a process without Ray"
        print(f"  {label:<60}{plain_here / ours_there:6.2f}   target >= 0.9", flush=True)
        print(f"  {'CPU time of one update, compact':<60}{1e3 * ours(memory[5], small):6.0f} ms")


if __name__ == "__main__":
    main()

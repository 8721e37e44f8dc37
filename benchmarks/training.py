"""Updates per CPU second of training: compact and paper, cache and memory, our loop and a plain one.

Prints ratios of CPU time, medians of interleaved rounds in one run, with one thread; `--rounds N` repeats
more often. The last ratio has our loop as a process of Ray Train runs it, with its checkpoints and reports.
"""

import argparse
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

from cluster.collect import collect
from cluster.config import CollectSettings, RaySettings, TrackingSettings
from cluster.session import connect
from cluster.tracking import open_tracker
from cluster.training_job import TrainingJob, episodes, trained
from svaedc.episodes import Episodes, split
from svaedc.model import initialised
from svaedc.presets import Sizes, compact, paper
from svaedc.training import fit
from workers import setups

COUNT, D, OBSERVATIONS = 2_000, 48, 25
STEPS = {1: 500, 5: 100}
BOUNDS = ([0.0] * OBSERVATIONS, [1.0] * OBSERVATIONS)
UPDATES = 250  # one epoch with its measures on held-out episodes


def arrays(stride):
    rng = np.random.default_rng(0)
    xi = rng.random((COUNT, OBSERVATIONS, STEPS[stride]), dtype=np.float32)
    bad = (rng.random((COUNT, STEPS[stride])) < 0.5).astype(np.float32)
    return rng.random((COUNT, D), dtype=np.float32), xi, bad, bad.mean(1)


def in_memory(stride):
    return split(Episodes(*arrays(stride), np.arange(COUNT)), np.arange(COUNT))


def in_cache(folder, stride):
    mapped = []
    for name, array in zip(("x", "xi", "bad", "y"), arrays(stride), strict=True):
        np.save(folder / f"{name}{stride}.npy", array)
        mapped.append(np.load(folder / f"{name}{stride}.npy", mmap_mode="r"))
    return split(Episodes(*mapped, np.arange(COUNT)), np.arange(COUNT))


def preset_of(name, stride, updates, batch_size=None):
    model, training = {"compact": compact, "paper": paper}[name](Sizes(D, OBSERVATIONS, STEPS[stride]))
    training = replace(training.with_updates(joint=updates, prior=0), epoch_updates=updates)
    return model, replace(training, batch_size=batch_size or training.batch_size)


def ours(halves, preset):
    """CPU seconds per update of our loop, its measures included."""
    model = initialised(preset[0], halves[0], BOUNDS, seed=0)
    begin = time.process_time()
    reports = list(fit(model, *halves, preset[1]))
    return (time.process_time() - begin) / reports[-1].update


def plain(halves, preset):
    """CPU seconds per update of the leanest loop around the same model: no measures, states or reports."""
    model = initialised(preset[0], halves[0], BOUNDS, seed=0)
    settings, training = preset[1], halves[0]
    columns = [
        torch.from_numpy(np.asarray(array)[training.rows])
        for array in (training.x, training.xi, training.bad, training.y)
    ]
    optimiser = torch.optim.AdamW(model.parameters(), settings.joint.learning_rate, weight_decay=0.0)
    elements = OBSERVATIONS * preset[0].time_steps
    begin = time.process_time()
    for update in range(settings.joint.updates):
        for group in optimiser.param_groups:
            group["lr"] = settings.joint.learning_rate_at(update)
        rows = torch.randint(len(training), (settings.batch_size,))
        log_p_xi, log_p_y, kl = model(*(column[rows] for column in columns))
        loss = -(log_p_xi + log_p_y - kl).mean() / elements
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(model.parameters(), settings.joint.gradient_norm)
        optimiser.step()
    return (time.process_time() - begin) / settings.joint.updates


class Clock:
    """Takes the place of the mailbox: notes the process's CPU time whenever the job reports."""

    def __init__(self):
        self.put, self.marks = self, []

    def remote(self, message):
        """Note one report."""
        self.marks.append((message.get("stage"), time.process_time()))


def worker(config):
    """CPU seconds per update of the joint stage in a process of Ray Train, checkpoints included."""
    import ray.train

    torch.set_num_threads(1)
    config["job"].data()
    clock = Clock()
    trained(config["job"], clock)
    last = [seconds for stage, seconds in clock.marks if stage == "joint"][-1]
    (config["job"].model / "seconds").write_text(str((last - clock.marks[0][1]) / UPDATES))
    ray.train.report({})


def under_ray(folder, session):
    """CPU seconds per update under Ray Train, and of the plain loop on the same episodes here."""
    tracker = open_tracker(TrackingSettings(uri=f"sqlite:///{folder}/mlflow.db"))
    dataset = collect(
        setup=setups.load("franka"),
        episodes=1024,
        folder=folder / "dataset",
        seed=0,
        settings=CollectSettings(episodes_per_shard=128),
        session=session,
        tracker=tracker,
    )
    (folder / "model").mkdir()
    paths = [(folder / name).resolve() for name in ("dataset", "model", "cache")]
    origin = {"dataset": dataset.fingerprint()}
    job = TrainingJob(*paths, origin, "compact", UPDATES, 5, 0, math.inf, 1)
    TorchTrainer(
        worker,
        train_loop_config={"job": job},
        scaling_config=ScalingConfig(num_workers=1),
        run_config=RunConfig(storage_path=str(folder / "ray")),
    ).fit()
    preset = job.settings(job.data())
    return float((job.model / "seconds").read_text()), plain(episodes(job.data()), preset)


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
                lambda: ours(memory[5], small),
                lambda: ours(memory[1], preset_of("paper", 1, 8)),
            ),
            (
                "  the same at equal batches of 32",
                "-",
                lambda: ours(memory[5], preset_of("compact", 5, 60, 32)),
                lambda: ours(memory[1], preset_of("paper", 1, 8)),
            ),
            (
                "  the same at equal stride 5 and batches of 32",
                "-",
                lambda: ours(memory[5], preset_of("compact", 5, 60, 32)),
                lambda: ours(memory[5], preset_of("paper", 5, 20)),
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
            ray_seconds, plain_seconds = under_ray(Path(name), session)
        label = "our loop under Ray Train / a plain PyTorch loop"
        print(f"  {label:<60}{plain_seconds / ray_seconds:6.2f}   target >= 0.9", flush=True)
        print(f"  {'CPU time of one update, compact':<60}{1e3 * ours(memory[5], small):6.0f} ms")


if __name__ == "__main__":
    main()

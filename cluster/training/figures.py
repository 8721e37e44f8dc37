"""Pictures of what a model knows of held-out controllers: its latent space, and y predicted against true."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Int64
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cluster.files import replacing
from svaedc.data.episodes import Episodes
from svaedc.model.svae_dc import SvaeDc
from workers.dataset.identity import Identity

SHOWN = 2_000
"""A scatter can show so many points before it becomes a blot."""


def latent_space(path: Path, model: SvaeDc, held_out: Episodes, f: Float[np.ndarray, " episodes"]) -> Path:
    """Draw held-out controllers' latent paths along their two widest directions, coloured by y and by f.

    Args:
        path: of the PNG.
        model: in evaluation mode.
        held_out: episodes.
        f: their objective, [episodes].

    Returns:
        Path of the PNG.
    """
    chosen = _positions(held_out)
    with torch.no_grad():
        tau, _ = model.latent_means(torch.from_numpy(held_out.x[held_out.rows[chosen]]))
    centerd = tau - tau.mean(0)
    _, width, directions = torch.linalg.svd(centerd, full_matrices=False)
    points = (centerd @ directions[:2].T).numpy()
    share = (width[:2].square().sum() / width.square().sum()).item()
    figure = Figure(figsize=(10, 4.4), layout="constrained")
    quantities = {"badness y": held_out.y[held_out.rows[chosen]], "objective f": f[chosen]}
    for axes, (name, values) in zip(figure.subplots(1, 2), quantities.items(), strict=True):
        dots = axes.scatter(*points.T, c=values, s=5, cmap="viridis", linewidths=0)
        figure.colorbar(dots, ax=axes, label=f"{name}, simulated")
        axes.set_xlabel("widest direction of E[tau|x]")
    figure.axes[0].set_ylabel("second widest")
    figure.suptitle(f"{len(chosen)} held-out controllers; two directions hold {share:.0%} of the variance")
    return _save(figure, path)


def badness(path: Path, model: SvaeDc, held_out: Episodes) -> Path:
    """Draw predicted against true badness of held-out episodes: from the trajectory, and from x alone.

    Args:
        path: of the PNG.
        model: that knows of badness, in evaluation mode.
        held_out: episodes.

    Returns:
        Path of the PNG.
    """
    batch = held_out.gather(_positions(held_out), torch.device("cpu"))
    with torch.no_grad():
        _, psi = model.split(model.posterior(batch.xi, batch.bad, batch.y).loc)
        predictions = {
            "reconstructed from the trajectory": model.badness_at(psi),
            "predicted from x alone": model.latent_means(batch.x)[1],
        }
    figure = Figure(figsize=(9, 4.4), layout="constrained")
    for axes, (name, y) in zip(
        figure.subplots(1, 2, sharex=True, sharey=True), predictions.items(), strict=True
    ):
        _against(axes, batch.y.numpy(), y.numpy())
        axes.set_title(name)
    figure.axes[0].set_ylabel("badness y of the model")
    return _save(figure, path)


def _against(axes: Axes, truth: Float[np.ndarray, " n"], prediction: Float[np.ndarray, " n"]) -> None:
    axes.plot([0, 1], [0, 1], color="#888888", linewidth=1)
    axes.scatter(truth, prediction, s=5, alpha=0.5, linewidths=0, color="#0072b2")
    axes.set_xlabel(f"true badness y (mean absolute error {np.abs(truth - prediction).mean():.2f})")


def _positions(held_out: Episodes) -> Int64[np.ndarray, " shown"]:
    """Positions spread evenly over the held-out episodes."""
    count = min(SHOWN, len(held_out))
    return np.linspace(0, len(held_out) - 1, count).astype(np.int64)


def _save(figure: Figure, path: Path) -> Path:
    with replacing(path) as unfinished:
        figure.savefig(unfinished, dpi=130)
    return path


def reconstruction(path: Path, model: SvaeDc, held_out: Episodes, identity: Identity) -> Path:
    """Draw channels of four held-out episodes, least bad to worst: original, reconstructed, generated.

    Args:
        path: of the PNG.
        model: in evaluation mode.
        held_out: episodes.
        identity: of their dataset, for channels and time.

    Returns:
        Path of the PNG.
    """
    order = np.argsort(held_out.y[held_out.rows])
    chosen = order[np.linspace(0, len(order) - 1, 4).astype(int)]
    batch = [held_out.gather(np.array([position]), torch.device("cpu")) for position in chosen]
    channels = _moving_channels(held_out, identity)
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    rows = figure.subplots(len(channels), len(batch), sharex=True, squeeze=False)
    with torch.no_grad():
        for column, one in enumerate(batch):
            curves = {
                "original": one.xi,
                "reconstructed": model.reconstruct(one.xi, one.bad, one.y),
                "generated from x": model.generate(one.x),
            }
            rows[0][column].set_title(f"bad in {float(one.y[0]):.0%} of the steps")
            for row, channel in enumerate(channels):
                _draw(
                    rows[row][column], {name: xi[0, channel].numpy() for name, xi in curves.items()}, identity
                )
    for row, channel in enumerate(channels):
        name, unit, _, _ = identity.observation[channel]
        rows[row][0].set_ylabel(f"{name} ({unit})")
    rows[0][0].legend(frameon=False, fontsize=8)
    figure.supxlabel("time (s)")
    return _save(figure, path)


def _moving_channels(held_out: Episodes, identity: Identity) -> list[int]:
    """The channels that move most: one angle, two positions, one part of an orientation, as there are any.

    Of a robot that has none of these (speeds, forces), any four.
    """
    spread = held_out.xi[held_out.rows[:256]].std(axis=(0, 2))
    units = np.array([unit for _, unit, _, _ in identity.observation])
    chosen: list[int] = []
    for unit, count in (("rad", 1), ("m", 2), ("1", 1)):
        candidates = np.flatnonzero(units == unit)
        chosen += candidates[np.argsort(-spread[candidates], kind="stable")][:count].tolist()
    return chosen or np.argsort(-spread, kind="stable")[:4].tolist()


def _draw(axes: Axes, curves: Mapping[str, np.ndarray], identity: Identity) -> None:
    for (name, values), color in zip(curves.items(), ("#000000", "#0072b2", "#d55e00"), strict=True):
        seconds = np.linspace(0, identity.horizon * identity.control_step, len(values))
        axes.plot(seconds, values, label=name, color=color, linewidth=1.2)

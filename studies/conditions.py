"""How well x tells each bad condition: whether compression stands a chance, before a model is trained.

A small network predicts them, y and f of held-out episodes from their controllers. A condition that it cannot
tell, no latent path will. `python -m studies.conditions --dataset data/franka`, a minute.
"""

import argparse
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Float32
from torch import Tensor, nn

from cluster.progress import ProgressLine
from studies.cells import table
from workers.dataset.folder import Dataset, open_dataset
from workers.dataset.statistics import bad_steps
from workers.dataset.storage.location import location

HELD_OUT = 0.1
EPOCHS, BATCH, WIDTH = 48, 128, 128
HEADER = ["", "share of steps", "told from x", "with f"]


def measured(dataset: Dataset) -> tuple[Float32[np.ndarray, "n D"], dict[str, Float[np.ndarray, " n"]]]:
    """Controllers, and of each episode the share of bad steps of every condition, y and f."""
    x, shares, y, f = [], [], [], []
    with ProgressLine("episodes", dataset.episodes(), 0) as progress:
        for shard, columns in dataset.batches():
            x.append(columns.x)
            y.append(columns.y)
            f.append(columns.f)
            shares.append(bad_steps(columns.bad, len(dataset.identity.conditions)) / dataset.identity.horizon)
            progress.advance(shard.episodes, "")
    conditions = dict(zip(dataset.identity.conditions, np.concatenate(shares).T, strict=True))
    return np.concatenate(x), {**conditions, "y": np.concatenate(y), "f": np.concatenate(f)}


def told(
    x: Float32[np.ndarray, "n D"], values: Float[np.ndarray, "n k"], seed: int = 0
) -> Float[np.ndarray, " k"]:
    """Correlation of each column with its prediction over the last tenth of the rows; NaN for a constant."""
    torch.manual_seed(seed)
    spread = values.std(axis=0)
    wanted = torch.tensor((values - values.mean(axis=0)) / np.where(spread > 0, spread, 1)).float()
    inputs, first = torch.tensor(x), len(x) - int(HELD_OUT * len(x))
    network = _fitted(inputs[:first], wanted[:first])
    with torch.no_grad():
        predicted = network(inputs[first:]).numpy()
    pairs = zip(predicted.T, wanted[first:].numpy().T, strict=True)
    return np.array([np.corrcoef(*pair)[0, 1] if pair[1].std() > 0 else np.nan for pair in pairs])


def _fitted(x: Float[Tensor, "n D"], values: Float[Tensor, "n k"]) -> nn.Module:
    network = nn.Sequential(
        *(nn.Linear(x.shape[1], WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH), nn.ReLU()),
        nn.Linear(WIDTH, values.shape[1]),
    )
    optimiser = torch.optim.AdamW(network.parameters(), lr=1e-3, weight_decay=0.05)
    for _ in range(EPOCHS):
        for rows in torch.randperm(len(x)).split(BATCH):
            loss = (network(x[rows]) - values[rows]).square().mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
    return network


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--dataset", type=location, default=Path("data/franka"))
    dataset = open_dataset(parser.parse_args().dataset)
    torch.set_num_threads(1)
    x, values = measured(dataset)
    columns = np.stack(list(values.values()), axis=1).astype(np.float64)
    found = told(x, columns)
    rows = [
        [name, "" if name == "f" else f"{column.mean():.3f}", f"{corr:.2f}", f"{with_f:.2f}"]
        for name, column, corr, with_f in zip(values, columns.T, found, _with_f(columns), strict=True)
    ]
    print(table(HEADER, rows))
    print(
        f"{dataset.identity.setup}, {len(x)} episodes, {dataset.fingerprint()[:12]}. Correlations: of the "
        "last tenth of the episodes where they are predicted from x, of all of them with f"
    )


def _with_f(columns: Float[np.ndarray, "n k"]) -> list[float]:
    f = columns[:, -1]
    return [np.corrcoef(column, f)[0, 1] if column.std() > 0 else np.nan for column in columns.T]


if __name__ == "__main__":
    main()

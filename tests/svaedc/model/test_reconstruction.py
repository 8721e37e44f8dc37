"""What a model makes of an episode, against the model's own functions and plain sorting."""

from dataclasses import replace

import numpy as np
import pytest
import torch


def test_renditions_are_the_models_reconstruction_and_generation(model, episodes):
    from svaedc.model.reconstruction import reconstructions

    model.eval()
    row = 3
    x, xi, bad = episodes.x[row], episodes.xi[row], episodes.bad[row]
    first, second = reconstructions(model, x, xi, bad, float(episodes.y[row]))
    batch = episodes.gather(np.array([row]), torch.device("cpu"))
    with torch.no_grad():
        reconstructed, generated = model.reconstruct(batch.xi, batch.bad, batch.y), model.generate(batch.x)
        _, y = model.latent_means(batch.x)
    assert (first.name, second.name) == ("reconstructed", "generated")
    np.testing.assert_allclose(first.xi, reconstructed[0].numpy(), rtol=1e-5)
    np.testing.assert_allclose(second.xi, generated[0].numpy(), rtol=1e-5)
    assert second.y == pytest.approx(float(y))


def test_a_model_without_psi_tells_no_badness(small_config, halves, bounds, episodes):
    from svaedc.model.reconstruction import reconstructions
    from svaedc.model.svae_dc import initialized_model

    model = initialized_model(replace(small_config, psi_dim=0), halves[0], bounds, seed=0).eval()
    told = reconstructions(model, episodes.x[0], episodes.xi[0], episodes.bad[0], 0.5)
    assert all(np.isnan(each.y) for each in told)


def test_the_best_the_worst_and_two_others_are_chosen():
    from svaedc.model.reconstruction import remarkable

    f = np.array([0.1, -2.0, 0.4, 0.9, 0.3], dtype=np.float32)
    chosen = remarkable(f, np.random.default_rng(0))
    assert chosen == remarkable(f, np.random.default_rng(0))
    assert (chosen["best"], chosen["worst"]) == (3, 1)
    assert {chosen["random 1"], chosen["random 2"]} < {0, 2, 4}
    assert len(set(chosen.values())) == 4


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_episodes_are_chosen_as_far_as_they_go(count):
    from svaedc.model.reconstruction import remarkable

    chosen = remarkable(np.arange(count, dtype=np.float32), np.random.default_rng(0))
    assert set(chosen.values()) == set(range(count))

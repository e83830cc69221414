"""Networks that commute exactly with the left-right mirror image.

A quadruped and its mirror image about the xz plane move alike, so the action for a mirrored
observation should be the mirrored action. A multilayer perceptron has this property if each weight
matrix commutes with the images of its input and output, where the image of hidden units swaps one
half with the other. Such weights are a linear subspace. Networks that start in it stay in it if
their gradients are projected onto it, and the projected gradient is the mean of those of the
samples and of their mirror images: the result of doubled samples, at the cost of the samples only.
The weights are those of an ordinary network, so that checkpoints and exports need no other reader.
"""

from __future__ import annotations

from typing import Any

import torch
from rsl_rl.models import MLPModel

from draft.errors import DraftError
from draft.learn.task.world.mirror import Flip


class Symmetric:
    """Projections of an actor and a critic onto mirror-symmetric networks."""

    def __init__(
        self, actor: MLPModel, critic: MLPModel, seen: Flip, seen_by_critic: Flip, actions: Flip
    ) -> None:
        """Store the mirror images of each layer's input and output.

        Args:
            actor: rsl-rl's model, with a Gaussian policy.
            critic: rsl-rl's model.
            seen: mirror image of the actor's observations.
            seen_by_critic: mirror image of the critic's observations.
            actions: mirror image of the actions.

        Raises:
            DraftError: a hidden layer has an odd number of units.
        """
        value = Flip(torch.zeros(1, dtype=torch.long), torch.ones(1))
        value = Flip(*(one.to(actions.sign.device) for one in value))
        self._statistics = [(actor, seen), (critic, seen_by_critic)]
        # rsl-rl does not declare the parameters of a distribution.
        distribution: Any = actor.distribution
        self._std: torch.Tensor = distribution.std_param
        self._actions = actions
        self._layers = [
            *_layers(actor.mlp, seen, actions),
            *_layers(critic.mlp, seen_by_critic, value),
        ]

    @torch.no_grad()
    def project(self) -> None:
        """Replace the weights and statistics by the nearest symmetric ones."""
        for layer, source, target in self._layers:
            layer.weight.copy_(_weight(layer.weight, source, target))
            layer.bias.copy_(_bias(layer.bias, target))
        self._std.copy_((self._std + self._std[self._actions.source]) / 2)
        self.project_statistics()

    @torch.no_grad()
    def deviation(self) -> float:
        """Largest change that `project` makes to a layer's weights, per its largest weight."""
        changes = [
            (layer.weight - _weight(layer.weight, source, target)).abs().max()
            / layer.weight.abs().max().clamp(min=1e-9)
            for layer, source, target in self._layers
        ]
        return float(torch.stack(changes).max())

    @torch.no_grad()
    def project_gradients(self) -> None:
        """Replace the gradients by the nearest symmetric ones."""
        for layer, source, target in self._layers:
            weight, bias = layer.weight.grad, layer.bias.grad
            if weight is not None and bias is not None:
                weight.copy_(_weight(weight, source, target))
                bias.copy_(_bias(bias, target))
        grad = self._std.grad
        if grad is not None:
            grad.copy_((grad + grad[self._actions.source]) / 2)

    @torch.no_grad()
    def project_statistics(self) -> None:
        """Make mean and variance of observations those of samples and their mirror images."""
        for model, flip in self._statistics:
            if not model.obs_normalization:
                continue
            normaliser: Any = model.obs_normalizer  # rsl-rl declares no types of its buffers.
            mean, image = normaliser._mean, flip(normaliser._mean)
            spread = (normaliser._var + normaliser._var[..., flip.source]) / 2
            normaliser._var.copy_(spread + ((mean - image) / 2).square())
            normaliser._mean.copy_((mean + image) / 2)
            normaliser._std = normaliser._var.sqrt()


def _layers(
    mlp: torch.nn.Sequential, source: Flip, target: Flip
) -> list[tuple[torch.nn.Linear, Flip, Flip]]:
    """Linear layers with the mirror images of their input and output."""
    linear = [layer for layer in mlp if isinstance(layer, torch.nn.Linear)]
    layers = []
    for layer in linear:
        last = layer is linear[-1]
        image = target if last else _halves(layer.out_features, source.sign.device)
        layers.append((layer, source, image))
        source = image
    return layers


def _halves(units: int, device: torch.device) -> Flip:
    """Mirror image of hidden units, which swaps the first half with the second."""
    if units % 2:
        cause = f"a layer of {units} units has no mirror image: the number must be even"
        remedy = "make each number of `learning.hidden` even, or set `learning.mirror` to false"
        raise DraftError(cause, remedy)
    order = torch.arange(units, device=device).roll(units // 2)
    return Flip(order, torch.ones(units, device=device))


def _weight(weight: torch.Tensor, source: Flip, target: Flip) -> torch.Tensor:
    """Nearest matrix that maps mirrored input to mirrored output."""
    image = weight[target.source][:, source.source] * target.sign[:, None] * source.sign
    return (weight + image) / 2


def _bias(bias: torch.Tensor, target: Flip) -> torch.Tensor:
    return (bias + target(bias)) / 2

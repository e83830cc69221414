"""Networks that commute with the left-right mirror image exactly.

A quadruped and its mirror image about the xz plane move alike, so the policy of the mirrored
observation should be the mirrored action. A multilayer perceptron does so where each weight matrix
commutes with the images of its input and output, hidden units being swapped half with half. Such
weights are a linear subspace. Networks that begin in it stay in it when their gradients are
projected onto it, and the projected gradient is the mean of those of the samples and of their
mirror images: what doubled samples give, for the cost of the samples alone. The weights remain
those of an ordinary network, so that checkpoints and exports need no other reader.
"""

from __future__ import annotations

from typing import Any

import torch

from draft.errors import DraftError, Problem
from draft.learn.lab.mirror import Flip


class Symmetric:
    """Projections of an actor and a critic onto mirror-symmetric networks."""

    def __init__(
        self, actor: Any, critic: Any, seen: Flip, seen_by_critic: Flip, actions: Flip
    ) -> None:
        """Note the mirror images of each layer's input and output.

        Args:
            actor: rsl-rl's model, with a Gaussian policy.
            critic: rsl-rl's model.
            seen: image of the actor's observations.
            seen_by_critic: image of the critic's observations.
            actions: image of the actions.

        Raises:
            DraftError: a hidden layer has an odd number of units.
        """
        value = Flip(torch.zeros(1, dtype=torch.long), torch.ones(1))
        value = Flip(*(one.to(actions.sign.device) for one in value))
        self._statistics = [(actor, seen), (critic, seen_by_critic)]
        self._std, self._actions = actor.distribution.std_param, actions
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
    def project_gradients(self) -> None:
        """Replace the gradients by the nearest symmetric ones."""
        for layer, source, target in self._layers:
            layer.weight.grad.copy_(_weight(layer.weight.grad, source, target))
            layer.bias.grad.copy_(_bias(layer.bias.grad, target))
        grad = self._std.grad
        grad.copy_((grad + grad[self._actions.source]) / 2)

    @torch.no_grad()
    def project_statistics(self) -> None:
        """Give observations the mean and variance of the samples and their mirror images."""
        for model, flip in self._statistics:
            if not model.obs_normalization:
                continue
            normaliser = model.obs_normalizer
            mean, image = normaliser._mean, flip(normaliser._mean)
            spread = (normaliser._var + normaliser._var[..., flip.source]) / 2
            normaliser._var.copy_(spread + ((mean - image) / 2).square())
            normaliser._mean.copy_((mean + image) / 2)
            normaliser._std = normaliser._var.sqrt()


def _layers(mlp: Any, source: Flip, target: Flip) -> list[tuple[Any, Flip, Flip]]:
    """Each linear layer with the images of its input and of its output."""
    linear = [layer for layer in mlp if isinstance(layer, torch.nn.Linear)]
    found = []
    for layer in linear:
        last = layer is linear[-1]
        image = target if last else _halves(layer.out_features, source.sign.device)
        found.append((layer, source, image))
        source = image
    return found


def _halves(units: int, device: Any) -> Flip:
    """Image of hidden units: the first half is swapped with the second."""
    if units % 2:
        cause = f"a layer of {units} units has no mirror image: an even number swaps half with half"
        remedy = "make each number of `learning.hidden` even; or learn without `learning.mirror`"
        raise DraftError(Problem(cause, None, remedy))
    order = torch.arange(units, device=device).roll(units // 2)
    return Flip(order, torch.ones(units, device=device))


def _weight(weight: torch.Tensor, source: Flip, target: Flip) -> torch.Tensor:
    """Nearest matrix that takes mirrored input to mirrored output."""
    image = weight[target.source][:, source.source] * target.sign[:, None] * source.sign
    return (weight + image) / 2


def _bias(bias: torch.Tensor, target: Flip) -> torch.Tensor:
    return (bias + target(bias)) / 2

# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How the small networks learn: backpropagation written out, Adam, one cycle of its rates.

A step of so small a network is over sooner than autograd has noted down what it did. So the
gradient is written here by hand, into buffers that stay. ``tests/recon/estimators/test_descent.py``
holds each against torch's own.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import cos, pi

import torch

from recon.estimators.optimizers import State, adam, change_along_axes

PEAK_LEARNING_RATE = 1e-2
"""Of a one-cycle schedule (Smith and Topin, 2018)."""
RISES = 0.3
"""Share of the steps in which the rate rises; it then falls. The defaults of torch, as all here."""
FIRST_RATE, LAST_RATE = PEAK_LEARNING_RATE / 25, PEAK_LEARNING_RATE / 25e4
MOST_MEMORY, LEAST_MEMORY = 0.95, 0.85
"""Adam's beta 1, which falls while the rate rises."""
REPORT_EVERY = 200
FEW_COLUMNS = 8

Layer = tuple[torch.Tensor, torch.Tensor]
"""Weight (member, in, out) and bias (member, 1, out)."""
Batch = tuple[torch.Tensor, torch.Tensor]
"""Inputs (member, row, in) and what is wanted of them (member, row, out)."""
Rule = Callable[[int, float, float], None]
"""One change of the weights: the step, counted from 1, the learning rate, Adam's beta 1."""


@dataclass(frozen=True, kw_only=True)
class Activation:
    """A function between layers; both work in place."""

    apply: Callable[[torch.Tensor], torch.Tensor]
    weigh: Callable[[torch.Tensor, torch.Tensor], torch.Tensor]
    """Multiply a gradient by the derivative where the function's values are these; the values
    are spent."""


_ONE = torch.ones(1)
RECTIFIER = Activation(
    apply=lambda values: values.clamp_min_(0),
    weigh=lambda gradient, values: torch.ops.aten.threshold_backward.grad_input(
        gradient, values, 0, grad_input=gradient
    ),
)
TANH = Activation(
    # tanh x = 2 sigmoid(2 x) - 1: torch takes a third of its tanh's time for it.
    apply=lambda values: values.mul_(2).sigmoid_().mul_(2).sub_(1),
    weigh=lambda gradient, values: gradient.mul_(
        torch.addcmul(_ONE, values, values, value=-1, out=values)
    ),
)


@contextmanager
def one_thread() -> Iterator[None]:
    """Torch on one thread and without autograd: small batches do not pay for two."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.inference_mode():
            yield
    finally:
        torch.set_num_threads(threads)


def descend(
    first: Sequence[Layer],
    activation: Activation,
    batches: Iterable[Batch],
    steps: int,
    progress: Callable[[float], None],
    rule_for: "RuleFor",
) -> tuple[Layer, ...]:
    """Networks side by side after one step for each batch, by mean squared error.

    Args:
        first: weights to begin with.
        activation: after every layer but the last.
        batches: as many as ``steps``.
        steps: of the one cycle.
        progress: called with the share that is done.
        rule_for: of what learns, how each gradient changes it.
    """
    learning = _learning(first)
    layers, change = learning.layers, rule_for(learning)
    # One network after the other: what a step of one writes stays in the cache.
    numbers = range(len(layers[0][0]))
    own, slopes = ([_alone(of, number) for number in numbers] for of in (layers, learning.slopes))
    rooms: dict[int, Room] = {}
    for step, (inputs, wanted) in enumerate(batches, start=1):
        rows = inputs.shape[1]  # an epoch's last batch may have fewer
        room = rooms.get(rows) or rooms.setdefault(rows, room_for(own[0], rows))
        for number in numbers:
            seen, said = inputs[number : number + 1], wanted[number : number + 1]
            backpropagate(own[number], activation, seen, said, slopes[number], room)
        change(step, *one_cycle(step - 1, steps))
        if step % REPORT_EVERY == 0 or step == steps:
            progress(step / steps)
    return layers


@dataclass(frozen=True, kw_only=True)
class Learning:
    """Networks that learn: all weights, then all biases, in one array; the gradient in another."""

    weights: torch.Tensor
    gradient: torch.Tensor
    layers: tuple[Layer, ...]
    """Views of the weights."""
    slopes: tuple[Layer, ...]
    """Views of the gradient, of the layers' shapes."""

    @property
    def without_biases(self) -> int:
        """How many of the weights are no biases."""
        return sum(weight.numel() for weight, _ in self.layers)


RuleFor = Callable[[Learning], Rule]


@dataclass(frozen=True, kw_only=True)
class Room:
    """Where a step writes: for each layer (member, row, out)."""

    values: tuple[torch.Tensor, ...]
    errors: tuple[torch.Tensor, ...]


def room_for(layers: Sequence[Layer], rows: int) -> Room:
    """Room for batches of that many rows."""
    empty = [bias.new_empty(len(bias), rows, bias.shape[2]) for _, bias in layers]
    return Room(values=tuple(empty), errors=tuple(torch.empty_like(room) for room in empty))


def backpropagate(
    layers: Sequence[Layer],
    activation: Activation,
    inputs: torch.Tensor,
    wanted: torch.Tensor,
    slopes: Sequence[Layer],
    room: Room,
) -> None:
    """The gradient of each network's mean squared error by its weights and biases.

    Args:
        layers: of the networks.
        activation: after every layer but the last.
        inputs: (member, row, in).
        wanted: (member, row, out).
        slopes: of the layers' shapes; the gradient is written here.
        room: for as many rows; what it held is lost.
    """
    seen = inputs
    for index, (weight, bias) in enumerate(layers):
        _multiply(seen, weight, room.values[index]).add_(bias)
        if index < len(layers) - 1:
            seen = activation.apply(room.values[index])
    error = torch.sub(room.values[-1], wanted, out=room.errors[-1]).mul_(2 / wanted[0].numel())
    for index in reversed(range(len(layers))):
        seen = room.values[index - 1] if index else inputs
        _multiply(seen.mT, error, slopes[index][0])
        torch.sum(error, 1, keepdim=True, out=slopes[index][1])
        if index:
            error = _multiply(error, layers[index][0].mT, room.errors[index - 1])
            error = activation.weigh(error, seen)


def _multiply(left: torch.Tensor, right: torch.Tensor, out: torch.Tensor) -> torch.Tensor:
    """The product of each network's matrices; one of few columns is faster made of its rows."""
    if out.shape[2] >= FEW_COLUMNS:
        return torch.bmm(left, right, out=out)
    return out.copy_(torch.bmm(right.mT.contiguous(), left.mT).mT)


def adam_rule(learning: Learning) -> Rule:
    """All weights and biases at once by Adam."""
    state: State = {}
    return lambda step, rate, memory: adam(
        learning.weights, learning.gradient, state, step, rate, memory
    )


def soap_rule(learning: Learning) -> Rule:
    """The weights of each layer by SOAP, the biases by Adam."""
    pairs = list(zip(learning.layers, learning.slopes, strict=True))
    weights = [(weight, slope, State()) for (weight, _), (slope, _) in pairs]
    biases = slice(learning.without_biases, None)
    state: State = {}

    def change_all(step: int, rate: float, memory: float) -> None:
        for weight in weights:
            change_along_axes(*weight, step, rate, memory)
        adam(learning.weights[biases], learning.gradient[biases], state, step, rate, memory)

    return change_all


def decaying(rule_for: RuleFor, share: float) -> RuleFor:
    """A rule after whose changes the weights, not the biases, lose a share of themselves.

    Of that share the rate tells how much: decay that the gradient does not know of (Loshchilov and
    Hutter, 2019, algorithm 2).
    """

    def rule_and_decay(learning: Learning) -> Rule:
        change = rule_for(learning)
        weights = learning.weights[: learning.without_biases]

        def change_all(step: int, rate: float, memory: float) -> None:
            change(step, rate, memory)
            weights.mul_(1 - share * rate)

        return change_all

    return rule_and_decay


def one_cycle(step: int, steps: int) -> tuple[float, float]:
    """The learning rate and Adam's beta 1 at a step, counted from 0: both on half a cosine."""
    top = RISES * steps - 1
    if step <= top:
        share = step / top
        rates, memories = (FIRST_RATE, PEAK_LEARNING_RATE), (MOST_MEMORY, LEAST_MEMORY)
    else:
        share = (step - top) / (steps - 1 - top)
        rates, memories = (PEAK_LEARNING_RATE, LAST_RATE), (LEAST_MEMORY, MOST_MEMORY)
    left = (1 + cos(pi * share)) / 2
    rate, memory = (end + (start - end) * left for start, end in (rates, memories))
    return rate, memory


def uniform(shape: tuple[int, ...], fan_in: int, random: torch.Generator) -> torch.Tensor:
    """First weights within 1 / sqrt(fan in), as torch draws them for one layer."""
    bound = fan_in**-0.5
    return torch.empty(shape).uniform_(-bound, bound, generator=random)


def _learning(first: Sequence[Layer]) -> Learning:
    parts = [*(weight for weight, _ in first), *(bias for _, bias in first)]
    weights = torch.cat([part.reshape(-1) for part in parts])
    gradient = torch.zeros_like(weights)
    return Learning(
        weights=weights,
        gradient=gradient,
        layers=_layers_of(weights, first),
        slopes=_layers_of(gradient, first),
    )


def _alone(layers: Sequence[Layer], number: int) -> tuple[Layer, ...]:
    """Views of one network's layers."""
    one = slice(number, number + 1)
    return tuple((weight[one], bias[one]) for weight, bias in layers)


def _layers_of(flat: torch.Tensor, like: Sequence[Layer]) -> tuple[Layer, ...]:
    """Views of layers of these shapes: their weights lie first, then their biases."""
    shapes = [part.shape for parts in zip(*like, strict=True) for part in parts]
    pieces = flat.split([shape.numel() for shape in shapes])
    parts = [piece.view(shape) for piece, shape in zip(pieces, shapes, strict=True)]
    return tuple(zip(parts[: len(like)], parts[len(like) :], strict=True))

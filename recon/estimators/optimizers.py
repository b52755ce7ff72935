# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How networks change by their gradient: Adam, and SOAP, Adam along the axes of the gradients.

Inputs that rise and fall together make Adam, which scales each weight for itself, go in small
steps. The mean squares of a layer's gradient, taken over its columns and over its rows, have axes
along which they are independent (Gupta et al., Shampoo, 2018); there Adam scales what is to be
scaled (Vyas et al., SOAP: improving and stabilizing Shampoo using Adam, 2024, algorithm 3). The
axes are followed by one step of orthogonal iteration from time to time, of which the largest
squares come first; what is remembered goes with its axis. Biases are left to Adam.
"""

from collections.abc import Iterable
from math import sqrt

import torch

MEMORY = 0.9
"""Adam's beta 1."""
SQUARES_MEMORY, ALONG_MEMORY = 0.999, 0.99
"""Adam's beta 2, and along the axes."""
LEAST_ROOT = 1e-8
"""Adam's epsilon."""
AXES_MEMORY = 0.95
"""Of the mean squares that the axes belong to."""
LOOK_EVERY = 4
"""Steps between gradients that enter those mean squares."""
TURN_EVERY = 20
"""Steps between turns of the axes."""
LONGEST_STEP = 2.0
"""Along an axis, in learning rates: beyond what Adam takes of any gradient while the axes stay.
After a turn some of a mean may lie along an axis that remembers hardly any squares."""
MOST_AXES = 300
"""A side of a weight that is longer keeps its own."""

State = dict[str, torch.Tensor]
"""What is remembered of a gradient; empty before the first step."""


def adam(
    weights: torch.Tensor,
    gradient: torch.Tensor,
    state: State,
    step: int,
    rate: float,
    memory: float = MEMORY,
) -> None:
    """One step of Adam (Kingma and Ba, 2015), in place.

    Args:
        weights: of any shape.
        gradient: of the same shape.
        state: of these weights; changed.
        step: counted from 1.
        rate: of learning.
        memory: beta 1.
    """
    if not state:
        state["mean"], state["squares"] = torch.zeros_like(weights), torch.zeros_like(weights)
    mean, squares = state["mean"], state["squares"]
    mean.lerp_(gradient, 1 - memory)
    squares.mul_(SQUARES_MEMORY).addcmul_(gradient, gradient, value=1 - SQUARES_MEMORY)
    root = squares.sqrt().div_(sqrt(1 - SQUARES_MEMORY**step)).add_(LEAST_ROOT)
    weights.addcdiv_(mean, root, value=-rate / (1 - memory**step))


def change_along_axes(
    weight: torch.Tensor,
    gradient: torch.Tensor,
    state: State,
    step: int,
    rate: float,
    memory: float = MEMORY,
) -> None:
    """One step of SOAP, in place.

    Args:
        weight: (network, row, column), of networks side by side.
        gradient: of the same shape.
        state: of this weight; changed.
        step: counted from 1.
        rate: of learning.
        memory: Adam's beta 1.
    """
    if not state:
        state["mean"], state["squares"] = torch.zeros_like(weight), torch.zeros_like(weight)
    _follow(state, "rows", gradient, step)
    _follow(state, "columns", gradient.mT, step)
    turned = _turned(gradient, state.get("rows"), state.get("columns"))
    state["mean"].lerp_(turned, 1 - memory)
    state["squares"].mul_(ALONG_MEMORY).addcmul_(turned, turned, value=1 - ALONG_MEMORY)
    root = state["squares"].sqrt().div_(sqrt(1 - ALONG_MEMORY**step)).add_(LEAST_ROOT)
    back = [None if axes is None else axes.mT for axes in map(state.get, ("rows", "columns"))]
    along = (state["mean"] / root).div_(1 - memory**step).clamp_(-LONGEST_STEP, LONGEST_STEP)
    weight.add_(_turned(along, *back), alpha=-rate)


def _follow(state: State, side: str, gradient: torch.Tensor, step: int) -> None:
    """Follow one side's axes, and turn the remembered mean with them.

    Args:
        state: of the weight; changed.
        side: "rows" or "columns".
        gradient: (network, that side, the other).
        step: counted from 1.
    """
    if gradient.shape[1] > MOST_AXES:
        return
    if step == 1:
        state[f"{side}_squares"] = gradient @ gradient.mT
        state[side] = _axes_of(state[f"{side}_squares"])
        return
    if step % LOOK_EVERY == 0:
        squares, share = state[f"{side}_squares"], 1 - AXES_MEMORY
        squares.baddbmm_(gradient, gradient.mT, beta=1 - share, alpha=share)
    if step % TURN_EVERY == 0:
        _sort(state, side)
        before = state[side]
        state[side] = torch.linalg.qr(torch.bmm(state[f"{side}_squares"], before))[0].contiguous()
        turn = torch.bmm(before.mT, state[side])
        mean = state["mean"]
        state["mean"] = torch.bmm(turn.mT, mean) if side == "rows" else torch.bmm(mean, turn)


def _sort(state: State, side: str) -> None:
    """Put the axes of the largest squares first, as an orthogonal iteration leaves them."""
    axes = state[side]
    order = (axes * (state[f"{side}_squares"] @ axes)).sum(1).argsort(1, descending=True)
    state[side] = axes.take_along_dim(order[:, None], 2)
    for name in ("mean", "squares"):
        along = (order[:, :, None], 1) if side == "rows" else (order[:, None], 2)
        state[name] = state[name].take_along_dim(*along)


def _axes_of(squares: torch.Tensor) -> torch.Tensor:
    """Eigenvectors, one a column, those of the largest squares first.

    In double precision, where many are alike or nearly nothing.
    """
    largest = squares.diagonal(dim1=1, dim2=2).amax(1).clamp_min(torch.finfo(squares.dtype).tiny)
    scaled = squares.double() / largest.double()[:, None, None]
    return torch.linalg.eigh(scaled)[1].flip(2).to(squares.dtype).contiguous()


def _turned(
    values: torch.Tensor, rows: torch.Tensor | None, columns: torch.Tensor | None
) -> torch.Tensor:
    """Values along axes of their rows and of their columns, one axis a column."""
    if rows is not None:
        values = torch.bmm(rows.mT, values)
    return values if columns is None else torch.bmm(values, columns)


class Soap:
    """SOAP for parameters of two dimensions or more, of which the first counts as the rows.

    Adam for the others. Biases have one dimension.
    """

    def __init__(self, parameters: Iterable[torch.nn.Parameter]) -> None:
        """Begin with nothing remembered of any gradient."""
        self.parameters = list(parameters)
        self.state: dict[torch.nn.Parameter, State] = {each: {} for each in self.parameters}
        """Of each parameter; its "step" is how many there were."""

    def zero_grad(self) -> None:
        """Forget the gradients."""
        for parameter in self.parameters:
            parameter.grad = None

    @torch.no_grad()
    def step(self, rate: float) -> None:
        """Change every parameter by its gradient, at a learning rate."""
        for parameter in self.parameters:
            gradient, state = parameter.grad, self.state[parameter]
            if gradient is None:
                continue
            count = int(state.pop("step", 0)) + 1
            if parameter.ndim > 1:
                weight, by_weight = (
                    values.reshape(1, len(values), -1) for values in (parameter.clone(), gradient)
                )
                change_along_axes(weight, by_weight, state, count, rate)
                parameter.copy_(weight.reshape(parameter.shape))
            else:
                adam(parameter, gradient, state, count, rate)
            state["step"] = torch.tensor(count)

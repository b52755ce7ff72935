# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""SOAP sees what a layer learns, and not the axes in which its inputs happen to be written."""

from itertools import islice

import pytest
import torch

from recon.estimators.descent import RECTIFIER, adam_rule, descend, one_thread, soap_rule
from recon.estimators.optimizers import (
    ALONG_MEMORY,
    LONGEST_STEP,
    MEMORY,
    MOST_AXES,
    TURN_EVERY,
    Soap,
    change_along_axes,
)

SIZE, ROWS, MEMBERS = 5, 64, 2


@pytest.fixture(params=range(3))
def random(request):
    return torch.Generator().manual_seed(request.param)


def drawn(random, *shape):
    return torch.randn(shape, generator=random, dtype=torch.float64)


def some_turn(random):
    return torch.linalg.qr(drawn(random, SIZE, SIZE))[0]


def some_batches(random, mix):
    """Inputs, mixed, and a linear answer to them."""
    wanted = 0.5 * drawn(random, SIZE, SIZE)
    while True:
        inputs = drawn(random, MEMBERS, ROWS, SIZE) @ mix
        yield inputs, inputs @ wanted


def first_layer(random):
    return 0.5 * drawn(random, MEMBERS, SIZE, SIZE), torch.zeros(MEMBERS, 1, SIZE).double()


def learnt(first, batches, rule):
    """Weight and bias of one layer."""
    with one_thread():
        (layer,) = descend([first], RECTIFIER, batches, len(batches), lambda _share: None, rule)
    return layer


def apart_when_turned(random, rule):
    """How far apart weights are that turned inputs teach, and turned weights that inputs teach."""
    turn, (weight, bias) = some_turn(random), first_layer(random)
    batches = list(islice(some_batches(random, drawn(random, SIZE, SIZE)), 60))
    end, _ = learnt((weight, bias), batches, rule)
    turned = [(inputs @ turn, wanted) for inputs, wanted in batches]
    other, _ = learnt((turn.mT @ weight, bias), turned, rule)
    assert (end - weight).abs().max() > 0.1  # there was something to learn
    return float((other - turn.mT @ end).abs().max())


def test_turned_inputs_are_learnt_the_same(random):
    assert apart_when_turned(random, soap_rule) < 1e-6


def test_adam_alone_is_bound_to_its_axes(random):
    assert apart_when_turned(random, adam_rule) > 0.02


def test_what_a_layer_can_say_is_learnt(random):
    batches = list(islice(some_batches(random, some_turn(random)), 600))
    first = first_layer(random)

    def missed(weight, bias):
        inputs, wanted = batches[-1]
        return float(((inputs @ weight + bias - wanted) ** 2).mean())

    assert missed(*learnt(first, batches, soap_rule)) < 0.01 * missed(*first)


def test_same_batches_teach_the_same(random):
    first, batches = first_layer(random), list(islice(some_batches(random, some_turn(random)), 45))
    once, again = (learnt(first, batches, soap_rule) for _ in range(2))
    assert torch.equal(once[0], again[0])
    assert torch.equal(once[1], again[1])


@pytest.mark.parametrize("memory_format", [torch.contiguous_format, torch.channels_last])
@pytest.mark.parametrize("side", [1, 3])
def test_the_optimizer_changes_a_convolution_as_the_rule_changes_a_matrix(
    random, memory_format, side
):
    count = 3 * side**2
    kernel = torch.nn.Parameter(drawn(random, 4, 3, side, side).to(memory_format=memory_format))
    bias = torch.nn.Parameter(drawn(random, 4))
    weight, state = kernel.detach().clone().reshape(1, 4, count), {}
    optimizer = Soap([kernel, bias])
    for step in range(1, 46):
        kernel.grad, bias.grad = drawn(random, 4, 3, side, side), drawn(random, 4)
        optimizer.step(0.01)
        change_along_axes(weight, kernel.grad.reshape(1, 4, count), state, step, 0.01)
    assert torch.equal(kernel.detach(), weight.reshape(4, 3, side, side))
    assert set(optimizer.state[bias]) == {"mean", "squares", "step"}


def test_a_turn_of_the_axes_leaves_what_is_remembered_where_it_was(random):
    weight, state = drawn(random, MEMBERS, SIZE, SIZE + 1), {}

    def remembered():
        return state["rows"] @ state["mean"] @ state["columns"].mT

    for step in range(1, TURN_EVERY):
        change_along_axes(weight, drawn(random, *weight.shape), state, step, 0.01)
    before, axes = remembered(), state["rows"].clone()
    change_along_axes(weight, torch.zeros_like(weight), state, TURN_EVERY, 0.01)
    torch.testing.assert_close(remembered(), MEMORY * before)
    assert (state["rows"] - axes).abs().max() > 0.01


def test_a_gradient_that_stays_is_followed_at_the_learning_rate(random):
    """One direction alone has squares: of Adam's quotient only its 1 is left, turn after turn."""
    row, column = (axis / axis.norm() for axis in (drawn(random, 4, 1), drawn(random, 1, 6)))
    weight, state = torch.zeros(1, 4, 6).double(), {}
    for step in range(1, 3 * TURN_EVERY + 1):
        change_along_axes(weight, 7 * (row @ column)[None], state, step, 0.01)
        torch.testing.assert_close(weight[0], -0.01 * step * row @ column, atol=1e-6, rtol=0)


def test_squares_go_where_their_axes_go(random):
    """The axes' order is another after a turn where another gradient has become the largest."""
    axes = torch.linalg.qr(drawn(random, 1, SIZE, SIZE))[0]
    weight, state = torch.zeros(1, SIZE, SIZE).double(), {}
    for turn, (largest, size) in enumerate(((0, 9), (1, 30)), start=1):
        for step in range((turn - 1) * TURN_EVERY + 1, turn * TURN_EVERY):
            sizes = torch.arange(1.0, SIZE + 1).double().index_fill(0, torch.tensor(largest), size)
            change_along_axes(weight, axes @ torch.diag(sizes)[None], state, step, 0.01)
        rows, squares = state["rows"], state["squares"]
        change_along_axes(weight, torch.zeros_like(weight), state, turn * TURN_EVERY, 0.01)
        order = (rows.mT @ state["rows"]).abs().argmax(1)[0]
        assert order[0] == (rows[0].mT @ axes[0]).abs().argmax(0)[largest]
        torch.testing.assert_close(state["squares"].sum(2), ALONG_MEMORY * squares.sum(2)[:, order])


def test_no_step_along_an_axis_is_longer_than_the_longest(random):
    """Where one direction alone has squares, and rounding turns the others anyhow."""
    gradient = drawn(random, 4, 1) @ drawn(random, 1, 6)
    weight, state = torch.zeros(1, 4, 6), {}
    for step in range(1, 5 * TURN_EVERY):
        before, size = weight.clone(), 1e12 if step % 3 else 1e-12
        change_along_axes(weight, size * gradient.float()[None], state, step, 0.01)
        assert (weight - before).norm() <= 0.01 * LONGEST_STEP * 24**0.5 * (1 + 1e-5)


def test_axes_are_at_right_angles_even_of_no_gradient_or_of_one_row(random):
    for gradient in (torch.zeros(1, 4, 6), torch.eye(4, 6)[None] * torch.eye(4)[:, :1]):
        weight, state = torch.zeros(1, 4, 6), {}
        for step in range(1, 2 * TURN_EVERY + 1):
            change_along_axes(weight, gradient, state, step, 0.01)
        for side, size in (("rows", 4), ("columns", 6)):
            torch.testing.assert_close(state[side] @ state[side].mT, torch.eye(size)[None])
        assert weight.isfinite().all()
        assert torch.equal(weight != 0, gradient != 0) or gradient.any()


def test_a_long_side_keeps_its_own_axes(random):
    weight, state = torch.zeros(1, 3, MOST_AXES + 1).double(), {}
    change_along_axes(weight, drawn(random, *weight.shape), state, 1, 0.01)
    assert "rows" in state and "columns" not in state and weight.any()

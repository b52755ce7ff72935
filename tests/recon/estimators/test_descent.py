# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is written by hand to train small networks is what torch's own autograd and Adam do."""

import math
from itertools import pairwise

import pytest
import torch

from recon.estimators.descent import (
    RECTIFIER,
    TANH,
    adam_rule,
    backpropagate,
    decaying,
    descend,
    one_cycle,
    one_thread,
    room_for,
    soap_rule,
    uniform,
)

MEMBERS, SIZES = 2, (5, 32, 32, 2)
OF_TORCH = {"tanh": (TANH, torch.tanh), "rectifier": (RECTIFIER, torch.relu)}


def some_layers(random):
    return [
        (uniform((MEMBERS, i, o), i, random), uniform((MEMBERS, 1, o), i, random))
        for i, o in pairwise(SIZES)
    ]


def some_batches(random, rows):
    return [
        tuple(torch.randn(MEMBERS, count, size, generator=random) for size in (SIZES[0], SIZES[-1]))
        for count in rows
    ]


def loss_of(layers, activation, inputs, wanted):
    """Of all networks, written as autograd wants it."""
    values = inputs
    for weight, bias in layers[:-1]:
        values = activation(values @ weight + bias)
    weight, bias = layers[-1]
    return ((values @ weight + bias - wanted) ** 2).mean((1, 2)).sum()


def learning(layers):
    return [tuple(part.clone().requires_grad_() for part in layer) for layer in layers]


@pytest.mark.parametrize("name", OF_TORCH)
def test_gradient_is_that_of_autograd(name):
    ours, theirs = OF_TORCH[name]
    random = torch.Generator().manual_seed(1)
    first = some_layers(random)
    ((inputs, wanted),) = some_batches(random, [100])
    layers = learning(first)
    loss_of(layers, theirs, inputs, wanted).backward()
    slopes = [tuple(torch.empty_like(part) for part in layer) for layer in first]
    with one_thread():
        backpropagate(first, ours, inputs, wanted, slopes, room_for(first, 100))
    for found, truth in zip(slopes, layers, strict=True):
        for ours_, theirs_ in zip(found, truth, strict=True):
            torch.testing.assert_close(ours_, theirs_.grad, rtol=1e-4, atol=1e-7)


def test_rates_are_those_of_torchs_one_cycle():
    steps = 47
    optimizer = torch.optim.Adam([torch.zeros(1, requires_grad=True)])
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 1e-2, total_steps=steps)
    for step in range(steps):
        (group,) = optimizer.param_groups
        assert one_cycle(step, steps) == pytest.approx((group["lr"], group["betas"][0]), rel=1e-9)
        optimizer.step()
        if step + 1 < steps:
            schedule.step()


@pytest.mark.parametrize("name", OF_TORCH)
def test_weights_end_where_torchs_adam_brings_them(name):
    ours, theirs = OF_TORCH[name]
    random = torch.Generator().manual_seed(2)
    first = some_layers(random)
    batches = some_batches(random, [64, 64, 40] * 10)
    layers = learning(first)
    optimizer = torch.optim.Adam([part for layer in layers for part in layer])
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, 1e-2, total_steps=30)
    for inputs, wanted in batches:
        optimizer.zero_grad()
        loss_of(layers, theirs, inputs, wanted).backward()
        optimizer.step()
        schedule.step()
    shares = []
    with one_thread():
        found = descend(first, ours, batches, 30, shares.append, adam_rule)
    assert shares == [1.0]
    flat = [[part for layer in ends for part in layer] for ends in (found, layers, first)]
    for end, truth, start in zip(*flat, strict=True):
        torch.testing.assert_close(end, truth.detach(), rtol=0, atol=1e-4)
        assert (end - start).abs().max() > 1e-2  # there was something to learn


@pytest.mark.parametrize("rule", [adam_rule, soap_rule])
def test_where_nothing_is_to_be_learnt_weights_decay_by_the_rates_and_biases_stay(rule):
    random = torch.Generator().manual_seed(3)
    first = some_layers(random)
    for part in first[-1]:
        part.zero_()  # what is answered is zero
    batches = [(inputs, 0 * wanted) for inputs, wanted in some_batches(random, [8] * 20)]
    with one_thread():
        found = descend(first, RECTIFIER, batches, 20, lambda _: None, decaying(rule, 3.0))
    left = math.prod(1 - 3.0 * one_cycle(step, 20)[0] for step in range(20))
    assert left < 0.8
    for (weight, bias), (weight_before, bias_before) in zip(found, first, strict=True):
        torch.testing.assert_close(weight, weight_before * left)
        torch.testing.assert_close(bias, bias_before, rtol=0, atol=0)

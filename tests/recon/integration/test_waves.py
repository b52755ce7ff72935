# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""In waves the Laplacian is diagonal, and nothing is lost on the way there and back."""

import numpy as np
import pytest

from recon.integration.poisson import eigenvalues
from recon.integration.waves import of_waves, to_waves, waves

BOTH = pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])


@BOTH
def test_there_and_back(boundary) -> None:
    field = np.random.default_rng(0).normal(size=(37, 52)).astype(np.float32)
    spectrum = to_waves(field, boundary)
    np.testing.assert_allclose(of_waves(spectrum, boundary), field, atol=1e-5)
    assert np.square(spectrum).sum() == pytest.approx(np.square(field).sum(), rel=1e-5)


@BOTH
def test_the_laplacian_is_diagonal(boundary) -> None:
    field = np.random.default_rng(0).normal(size=(9, 14)).astype(np.float32)
    field -= field.mean()
    ring = np.pad(field, 1, "constant" if boundary == "dirichlet" else "edge")
    x, y = np.diff(ring[1:-1], 2, axis=1) / 0.05**2, np.diff(ring[:, 1:-1], 2, axis=0) / 0.06**2
    scaled = to_waves(field, boundary) * eigenvalues(9, 14, (0.05, 0.06), boundary, "f")
    np.testing.assert_allclose(of_waves(scaled, boundary), x + y, atol=1e-2)


@BOTH
def test_a_table_of_waves_is_orthonormal(boundary) -> None:
    table = waves(31, boundary)
    np.testing.assert_allclose(table @ table.T, np.eye(31), atol=1e-5)

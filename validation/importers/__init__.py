# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Published sensor images turned into dataset folders; the originals stay as they are.

Each importer is a function of a source and a new folder. Left out, because a dataset must know
its ball: the Taxim wheel's GelSight Mini (neither radius nor scale is stated), the two GelSlim
units of gelsight_heightmap_reconstruction (two contradictory radii) and the Wedge clips of
EstimateModulus (the sphere's radius is not stated).
"""

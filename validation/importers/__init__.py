# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Published sensor images turned into dataset folders; the originals stay as they are.

Each importer is a function of a source and a new folder. Left out is the Taxim wheel's GelSight
Mini: neither its ball's radius nor its scale is stated.
"""

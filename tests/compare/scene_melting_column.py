# SPDX-License-Identifier: GPL-2.0-or-later
"""(d) A column of bonded grains beside a hot plate: the bonds melt, and it collapses."""
import scene_column


def compare(study):
    scene_column.compare(study, "melting")

"""Irregular polygons for the generators of scenes.

`[[dem.fill]]` (docs/scene-format.md) makes such bodies too, but not all that the generators need: the fines of `granular_matrix`
lie in the voids, so its outlines have to be known where the points are made, and bodies of `random_ledger` are of many kinds
and have velocities of their own.
"""

import math


def corners(rng, count, radius, start=0.0):
    """Corners of a convex polygon of `count` corners on a circle of `radius` (m) about the origin: a regular one whose corners
    are moved along the circle by up to a fifth of their distance; `start` is the angle of the first in rad."""
    angles = [start + 2.0 * math.pi * (k + rng.uniform(-0.2, 0.2)) / count for k in range(count)]
    return [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]

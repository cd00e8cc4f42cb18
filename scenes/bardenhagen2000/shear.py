#!/usr/bin/env python3
"""Writes shear.toml: a box of cylindrical grains, sheared at constant volume by its right wall (Bardenhagen 2000).

    python3 shear.py > shear.toml                        # the committed scene
    python3 shear.py --seed 7 > other.toml               # another packing of the same sizes
    python3 shear.py --check                             # least gap and share of the box that is solid

Sizes: 369 diameters from 31 to 250 um with mean 57 um (the paper's); that they are lognormal, which packing they have, and the
gap between them at the start are assumed. Centres lie in the box, so that the walls at the sides cut grains by up to a half:
those are the ones that the paper fixes to the walls. Up and down the box closes on itself. Lengths in um until they are written.
"""

import argparse
import math

from packing import pack, sizes

SIDE = 1200.0  # of the box
COUNT, LEAST, MEAN, MOST = 369, 31.0, 57.0, 250.0
# Least distance of two grains at the start, a third of a cell: nearer than half the diagonal of a point's box (2.83 um) points of
# two grains could lie on top of one another, which is refused.
GAP = 2.85
SEED = 2000
ARC = 96  # corners of a full circle, for the grains that a wall cuts


def grains(seed):
    """Centre and radius of each, the largest first."""
    radii = [0.5 * d for d in sorted(sizes(COUNT, LEAST, MEAN, MOST), reverse=True)]
    centres = pack(radii, SIDE, SIDE, GAP, seed)
    # As they are written: rounding must not take the gap.
    return [(round(x, 3), round(y, 3), round(r, 4)) for (x, y), r in zip(centres, radii)]


def region(x, y, r):
    """The part of a grain between the walls at the sides, as a fill."""
    metres = lambda *lengths: "[" + ", ".join(f"{1e-6 * v:.7g}" for v in lengths) + "]"
    if r <= x <= SIDE - r:
        return f"fill.disc = {{ center = {metres(x, y)}, radius = {1e-6 * r:.7g} }}"
    wall, sign = (0.0, 1.0) if x < r else (SIDE, -1.0)
    half = math.acos(max(-1.0, min(1.0, (wall - x) * sign / r)))
    n = math.ceil(ARC * half / math.pi)
    angles = [half * (2.0 * k / n - 1.0) for k in range(n + 1)]
    corners = [(min(max(x + sign * r * math.cos(a), 0.0), SIDE), y + sign * r * math.sin(a)) for a in angles]
    return "fill.polygon = { vertices = [" + ", ".join(metres(*c) for c in corners) + "] }"


def least_gap(all_grains):
    """Between two grains, round the box."""
    least = math.inf
    for k, (x, y, r) in enumerate(all_grains):
        for u, v, q in all_grains[:k]:
            dy = (v - y + 0.5 * SIDE) % SIDE - 0.5 * SIDE
            least = min(least, math.hypot(u - x, dy) - r - q)
    return least


def solid(all_grains):
    """Share of the box that is solid."""

    def segment(r, h):
        return r * r * math.acos(h / r) - h * math.sqrt(r * r - h * h) if h < r else 0.0

    area = sum(math.pi * r * r - segment(r, x) - segment(r, SIDE - x) for x, y, r in all_grains)
    return area / SIDE**2


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--check", action="store_true", help="say what the packing is, and write no scene")
    arguments = parser.parse_args()
    all_grains = grains(arguments.seed)
    least, share = least_gap(all_grains), solid(all_grains)
    if least <= 0.0:
        raise SystemExit(f"grains overlap by {-least} um")
    if arguments.check:
        print(f"{len(all_grains)} grains, least gap {least:.3f} um, solid {100 * share:.2f} % of the box")
        return
    print(HEAD.format(seed=arguments.seed, solid=100 * share, gap=least), end="")
    for k, grain in enumerate(all_grains):
        print(f'\n[[mpm.points]]\nname = "g{k}"\nmaterial = "hmx"\n{region(*grain)}\nspacing.per_cell = 4')
    print(TAIL, end="")


HEAD = '''# Look for: with friction (variant `friction`) the grains roll and slide, plastic work stays small and the motion is a band beside
# the wall that moves; without slip (the scene as it stands) they are torn and the whole box flows.
# Written by shear.py (seed {seed}), which says what is assumed: solid {solid:.1f} % of the box, least gap {gap:.2f} um.
version = 1
name = "shear"
about = "369 elastic-plastic grains in a box that is sheared at constant volume by its right wall, with contact on the grid or without slip."

# Bardenhagen 2000, granular shear: G 7.5 GPa, K 11.4 GPa, yield 0.3 GPa, hardening 0.01 GPa, 1900 kg/m^3; 1.2 mm of 150 x 150
# cells, 4 points each; left wall fixed, right wall at 0.1 mm/us, periodic up and down. Everything is at rest at the start.
[constants]
V = 100.0             # m/s
W = 1.2e-3            # m
rho = 1900.0

# 80 % of shear.
[time]
end = 9.6e-6

# uGIMP with the stress first; with the paper's hats, nodes of hardly any mass burst points (docs/results). With contact: splines
# and usavg, with which it creates no energy (docs/energy.md).
[mpm]
cell = 8e-6
domain = [[0.0, 0.0], [1.2e-3, 1.2e-3]]
shape = "ugimp"
transfer = "flip"
walls = {{ left = "fixed", right = {{ driven = {{ speed = 100.0 }} }}, bottom = "periodic", top = "periodic" }}

[[mpm.material]]
name = "hmx"
density = 1900.0
model.von_mises = {{ bulk_modulus = 11.4e9, shear_modulus = 7.5e9, yield_stress = 0.3e9, hardening_modulus = 0.01e9 }}
'''

TAIL = '''
# A row for each per cent of shear.
[output]
every = 1.2e-7

[[output.column]]
name = "shear"
unit = "1"
value = "V*t/W"

[[output.column]]
name = "kinetic"
unit = "J/m"
value = "energy.kinetic"

[[output.column]]
name = "elastic"
unit = "J/m"
value = "energy.elastic"

[[output.column]]
name = "plastic"
unit = "J/m"
value = "energy.plastic"

[[output.column]]
name = "friction"
unit = "J/m"
value = "energy.friction"

[[output.column]]
name = "driven"
unit = "J/m"
value = "energy.driven"

[[output.column]]
name = "residual"
unit = "1"
value = "energy.residual_relative"

[[output.column]]
name = "momentum"
unit = "1"
value = "momentum_error"

[[check]]
name = "momentum of walls and grains"
value = "momentum_error"
when = "max"
at_most = 1e-12
source = "issue 16: at most 1e-12; what one grain's node gains others lose, and what walls give is booked"

[[check]]
name = "no energy is created"
value = "energy.residual_relative"
when = "max"
at_most = 1e-3
source = "docs/scenes.md: 1e-3 of the largest total"

# The paper's grains with friction between them.
[variant.friction]
"mpm.grid_contact" = { friction = 0.3 }
"mpm.shape" = "quadratic_bspline"
"mpm.stress_update" = "usavg"

# With friction, 1 % of shear.
[variant.quick]
"mpm.grid_contact" = { friction = 0.3 }
"mpm.shape" = "quadratic_bspline"
"mpm.stress_update" = "usavg"
"time.end" = 1.2e-7
'''

if __name__ == "__main__":
    main()

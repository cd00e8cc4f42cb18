#!/usr/bin/env python3
"""Writes granular_matrix.toml: random spheropentagons in a container, fines in their voids, a bar from above.

    python3 granular_matrix.py > granular_matrix.toml                              # the committed scene
    python3 granular_matrix.py --cell 0.0035 --spacing 0.002 > full.toml           # the paper's grid and r_p = 1 mm

Assumed, since Jiang 2020 section 7 gives neither: one pentagon in each of 8 x 8 squares, of random radius, shape and angle
(random numbers of a fixed seed), and fines wherever a void leaves more than a gap free: the less gap, the more fines. A
point's radius is half the distance between points, which is where the fines' surface is; no gap is smaller than that of the
committed scene, so that nothing touches at the start. Only the standard library is used; the same arguments give the same
file.
"""

import argparse
import math
import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from polygons import corners  # noqa: E402

SIDE = 0.61  # container, m (Jiang 2020 figure 22)
ROWS = 8
SPHERO = 0.005  # m (Jiang 2020 Table 3)
SEED = 2020
# Least distance between a point and the surface of grains and walls in m; middle is the scene itself.
GAPS = {"fines_low": 0.006, "fines_middle": 0.004, "fines_high": 0.0025}


def pentagons():
    """Centre and vertices (about the centre) of each core polygon."""
    rng = random.Random(SEED)
    square = SIDE / ROWS
    for row in range(ROWS):
        for column in range(ROWS):
            radius = (0.5 * square - SPHERO - 0.0005) * rng.uniform(0.88, 1.0)
            start = rng.uniform(0.0, 2.0 * math.pi)
            pentagon = [(round(x, 5), round(y, 5)) for x, y in corners(rng, 5, radius, start)]
            yield (round((column + 0.5) * square, 5), round((row + 0.5) * square, 5)), pentagon


def distance(p, a, b):
    """From p to the segment a b."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    s = max(0.0, min(1.0, ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / (dx * dx + dy * dy)))
    return math.hypot(p[0] - a[0] - s * dx, p[1] - a[1] - s * dy)


def gap(p, bodies):
    """From p to the nearest surface of a grain or wall; negative inside."""
    free = min(p[0], p[1], SIDE - p[0], SIDE - p[1])
    for (cx, cy), pentagon in bodies:
        if math.hypot(p[0] - cx, p[1] - cy) > 0.5 * SIDE / ROWS + 0.03:
            continue
        q = (p[0] - cx, p[1] - cy)
        edges = list(zip(pentagon, pentagon[1:] + pentagon[:1]))
        inside = all((b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]) > 0.0 for a, b in edges)
        if inside:
            return -1.0
        free = min(free, min(distance(q, a, b) for a, b in edges) - SPHERO)
    return free


def fines(bodies, spacing):
    """Positions of each variant's points, by its name."""
    n = int(SIDE / spacing)
    lattice = [((i + 0.5) * spacing, (j + 0.5) * spacing) for j in range(n) for i in range(n)]
    free = [(gap(p, bodies), p) for p in lattice]
    return {name: [p for g, p in free if g > least] for name, least in GAPS.items()}


def listed(positions):
    return "[" + ", ".join(f"[{x:.4g}, {y:.4g}]" for x, y in positions) + "]"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cell", type=float, default=0.01, help="m")
    parser.add_argument("--spacing", type=float, default=0.005, help="of the fines' points, m")
    parser.add_argument("--container-stiffness", type=float, help="normal stiffness between fines and container, N/m; that of all contacts by default")
    args = parser.parse_args()
    bodies = list(pentagons())
    contents = fines(bodies, args.spacing)
    cells = math.ceil((SIDE + 0.06) / args.cell)
    low = 0.5 * (SIDE - cells * args.cell)
    high = low + cells * args.cell
    radius = 0.5 * args.spacing
    head = HEAD
    if args.container_stiffness:
        head = head.replace('motion = "fixed"', 'motion = "fixed"\nsurface = "container"')
    print(head.format(cell=args.cell, low=low, high=high, spacing=args.spacing, radius=radius,
                      positions=listed(contents["fines_middle"]), counts=", ".join(
                          f"{name} {len(c)}, {100 * 1500 * len(c) * args.spacing ** 2 / solid(bodies):.1f} %"
                          for name, c in contents.items())), end="")
    for k, ((x, y), pentagon) in enumerate(bodies):
        print(f'\n[[dem.body]]\nname = "grain{k}"\nshape.polygon = {{ vertices = {listed(pentagon)} }}\n'
              f"sphero_radius = {SPHERO}\ndensity = 2200.0\nposition = [{x}, {y}]")
    print(TAIL, end="")
    if args.container_stiffness:
        k = args.container_stiffness
        print(f'\n[[contact_pair]]\nbetween = ["fines", "container"]\n'
              f"law.linear = {{ normal_stiffness = {k:g}, tangential_stiffness = {k / 20:g}, friction = 0.2 }}")
    for name, positions in contents.items():
        if name == "fines_middle":
            continue
        print(f'\n[variant.{name}]\n"mpm.points.0.fill.points.positions" = {listed(positions)}')
    print('\n# The first 3 cm of settlement.\n[variant.quick]\n"time.end" = 0.06')


def solid(bodies):
    """Mass of the grains, kg/m."""
    total = 0.0
    for _, pentagon in bodies:
        for a, b in zip(pentagon, pentagon[1:] + pentagon[:1]):
            total += 0.5 * (a[0] * b[1] - b[0] * a[1]) + SPHERO * math.dist(a, b)
        total += math.pi * SPHERO ** 2
    return 2200.0 * total


HEAD = '''# Look for: the bar's force rises as the voids close, and sooner the more fines there are; grains turn and give way.
# Written by granular_matrix.py, which says what is assumed. Fines (points, mass over that of the grains): {counts}.
version = 1
name = "granular_matrix"
about = "Pentagonal grains with Drucker-Prager fines in their voids under a bar that is driven down."
gravity = [0.0, -9.81]

[constants]
v_bar = 0.5           # m/s (Jiang 2020 section 7; figure 22 prints 0.5 cm/s in its own units)

# 0.11 m of settlement.
[time]
end = 0.22
# At the first row everything falls freely; the mean of the two half-step kinetic energies is then above the true one by
# (dt/2t)^2, which has to be below the 1e-3 that is checked.
max_step = 5e-5
min_step = 2e-7

# Coarser than the paper (3.5 mm).
[mpm]
cell = {cell}
domain = [[{low:.6g}, {low:.6g}], [{high:.6g}, {high:.6g}]]
shape = "quadratic_bspline"
transfer = "apic"

# Fines of Table 3.
[[mpm.material]]
name = "fines"
density = 1500.0
model.drucker_prager = {{ bulk_modulus = 5e5, shear_modulus = 3.2e5, friction_angle = 35.0, dilation_angle = 25.0, cohesion = 0.0, tensile_strength = 0.0 }}

[[mpm.points]]
name = "fines"
material = "fines"
fill.points = {{ positions = {positions} }}
spacing.distance = {spacing}
contact_radius = {radius:.6g}

# Inner faces of the container: x = 0, x = 0.61, y = 0. The bar's lower face begins at y = 0.61.
[dem]
[[dem.body]]
name = "bar"
shape.rectangle = {{ width = 0.59, height = 0.01 }}
sphero_radius = 0.005
position = [0.305, 0.62]
velocity = [0.0, -0.5]
motion = "driven"

[[dem.body]]
name = "floor"
shape.rectangle = {{ width = 0.65, height = 0.01 }}
sphero_radius = 0.005
position = [0.305, -0.01]
motion = "fixed"

[[dem.body]]
name = "wall_left"
shape.rectangle = {{ width = 0.01, height = 0.7 }}
sphero_radius = 0.005
position = [-0.01, 0.35]
motion = "fixed"

[[dem.body]]
name = "wall_right"
shape.rectangle = {{ width = 0.01, height = 0.7 }}
sphero_radius = 0.005
position = [0.62, 0.35]
motion = "fixed"
'''

TAIL = '''
# k_n is assumed, k_t = k_n/20 (the printed 6e6 N/cm contradicts the printed results, docs/physics.md section 2); mu of Table 3.
# With the 6e4 N/m of the other scenes the bar presses fines 3 mm into the floor.
[contact]
linear = { normal_stiffness = 6e6, tangential_stiffness = 3e5, friction = 0.2 }

# The viscous part is assumed too.
[body_contact]
linear = { normal_stiffness = 6e6, tangential_stiffness = 3e5, friction = 0.2, damping_ratio = 0.3 }

[output]
every = 1e-3

[[output.column]]
name = "settlement"
unit = "m"
value = "initial.body.bar.y - body.bar.y"

# Its slope over the settlement is the bar's mean force; the two columns after it are what presses at the moment of a row.
[[output.column]]
name = "work_of_the_bar"
unit = "J/m"
value = "energy.driven"

[[output.column]]
name = "force_of_fines_on_bar"
unit = "N/m"
value = "body.bar.fy"

[[output.column]]
name = "force_of_grains_on_bar"
unit = "N/m"
value = "body.bar.contact_fy"

[[output.column]]
name = "fines_in_contact"
unit = "1"
value = "contact.points"

[[output.column]]
name = "kinetic"
unit = "J/m"
value = "energy.kinetic + energy.rotation"

[[output.column]]
name = "friction"
unit = "J/m"
value = "energy.friction"

[[output.column]]
name = "plastic"
unit = "J/m"
value = "energy.plastic"

[[output.column]]
name = "residual"
unit = "1"
value = "energy.residual_relative"

[[check]]
name = "the bar has gone its way"
value = "(initial.body.bar.y - body.bar.y)/(v_bar*t)"
reference = 1.0
tolerance = 1e-9
source = "Jiang 2020 section 7: 0.5 m/s"

[[check]]
name = "the bar works"
value = "energy.driven"
at_least = 0.0
source = "compression: the matrix resists"

[[check]]
name = "no fines pass through floor and walls"
value = "min(points.fines.ymin, min(points.fines.xmin, 0.61 - points.fines.xmax))"
when = "min"
at_least = 0.0
source = "inner faces of the container"

[[check]]
name = "momentum is conserved"
value = "momentum_error"
when = "max"
at_most = 1e-12
source = "action equals reaction bit for bit (docs/physics.md section 3): rounding only"

[[check]]
name = "no energy is created"
value = "energy.residual_relative"
when = "max"
at_most = 1e-3
source = "Jiang 2020 section 5.1: no extra energy; docs/scenes.md sets 1e-3 of the largest total"
'''

if __name__ == "__main__":
    main()

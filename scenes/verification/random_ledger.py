#!/usr/bin/env python3
"""Writes random_ledger.toml: a gas of bodies of many shapes and of elastic blobs that collide in a box.

    python3 random_ledger.py > random_ledger.toml        # the committed scene

One thing in each square of a lattice, at a random place, angle, size and speed (random numbers of a fixed seed). Only the
standard library is used; the same arguments give the same file.
"""

import argparse
import math
import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from polygons import corners  # noqa: E402

SEED = 1000
CELL = 0.01  # m
SPACING = 0.005  # of the points, m
SQUARE = 0.08  # of the lattice, m
SPHERO = 0.004  # m


def blob(name, center, radius, velocity):
    return (f'\n[[mpm.points]]\nname = "{name}"\nmaterial = "rubber"\n'
            f"fill.disc = {{ center = [{center[0]:.5f}, {center[1]:.5f}], radius = {radius:.4f} }}\n"
            f"spacing.distance = {SPACING}\nvelocity = [{velocity[0]:.4f}, {velocity[1]:.4f}]\n")


def body(rng, name, center, radius, velocity):
    """A disc, a segment, a rectangle or a polygon that fits into the radius."""
    core = radius - SPHERO
    kind = rng.randrange(4)
    sphero = SPHERO
    if kind == 0:
        shape, sphero = '"disc"', radius
    elif kind == 1:
        shape = f"{{ ends = [[{-core:.4f}, 0.0], [{core:.4f}, 0.0]] }}"
    elif kind == 2:
        shape = f"{{ width = {1.6 * core:.4f}, height = {1.2 * core:.4f} }}"
    else:
        polygon = corners(rng, rng.randrange(3, 7), core)
        shape = "{ vertices = [" + ", ".join(f"[{x:.5f}, {y:.5f}]" for x, y in polygon) + "] }"
    key = ["shape", "shape.segment", "shape.rectangle", "shape.polygon"][kind]
    return (f'\n[[dem.body]]\nname = "{name}"\n{key} = {shape}\nsphero_radius = {sphero:.4f}\n'
            f"density = {rng.uniform(500.0, 4000.0):.0f}.0\nposition = [{center[0]:.5f}, {center[1]:.5f}]\n"
            f"angle = {rng.uniform(-math.pi, math.pi):.4f}\nvelocity = [{velocity[0]:.4f}, {velocity[1]:.4f}]\n"
            f"spin = {rng.uniform(-30.0, 30.0):.2f}\n")


def wall(name, width, height, x, y):
    return (f'\n[[dem.body]]\nname = "{name}"\nshape.rectangle = {{ width = {width:.4g}, height = {height:.4g} }}\n'
            f'sphero_radius = 0.005\nposition = [{x:.4g}, {y:.4g}]\nmotion = "fixed"\n')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=12)
    rows = parser.parse_args().rows
    rng = random.Random(SEED)
    side = rows * SQUARE
    blobs, bodies = [], []
    for row in range(rows):
        for column in range(rows):
            radius = rng.uniform(0.02, 0.034)
            play = 0.5 * SQUARE - radius - 0.002
            center = [(k + 0.5) * SQUARE + rng.uniform(-play, play) for k in (column, row)]
            velocity = [rng.uniform(-2.0, 2.0) for _ in range(2)]
            if (row + column) % 3 == 0:
                blobs.append(blob(f"blob{len(blobs)}", center, radius, velocity))
            else:
                bodies.append(body(rng, f"body{len(bodies)}", center, radius, velocity))
    low, high = -4 * CELL, side + 4 * CELL
    print(HEAD.format(bodies=len(bodies), blobs=len(blobs), cell=CELL, low=low, high=round(high, 6)), end="")
    print("".join(blobs), end="")
    print("\n# Inner faces of the box: 0 and", f"{side:g} m.\n[dem]\ncontact_resolution = 2   # the step is the cap's: what is lost by it is what is studied", end="")
    out = side + 0.03
    print(wall("floor", out, 0.02, 0.5 * side, -0.015) + wall("lid", out, 0.02, 0.5 * side, side + 0.015)
          + wall("left", 0.02, out, -0.015, 0.5 * side) + wall("right", 0.02, out, side + 0.015, 0.5 * side), end="")
    print("".join(bodies), end="")
    print(TAIL.format(side=side), end="")


HEAD = '''# Look for: everything collides with everything, and the ledger stays closed: what is missing in kinetic energy is in elastic
# energy, springs and friction.
# Written by random_ledger.py: {bodies} bodies, {blobs} blobs.
version = 1
name = "random_ledger"
about = "A gas of bodies and elastic blobs in a box: momentum and energy over a thousand random contacts."

# A point that touches a body stays for as long as the blob's slowest wave needs there and back, t_touch, or less. So the mean
# number of points in contact, times the length of the run over t_touch, is a low estimate of the number of touches; those between
# bodies are not counted and come on top.
[constants]
t_end = 0.35
t_touch = 0.01        # s; 2 (2 x 0.034 m) / sqrt(G/rho) = 0.0096 s

[time]
end = 0.35
max_step = 2e-5

[mpm]
cell = {cell}
domain = [[{low}, {low}], [{high}, {high}]]
shape = "ugimp"
transfer = "flip"
stress_update = "usavg"   # "usf" loses 1.3e-3 of the energy here, and 0.7e-3 with half the step: docs/energy.md

[[mpm.material]]
name = "rubber"
density = 1000.0
model.linear_elastic = {{ bulk_modulus = 4e5, shear_modulus = 2e5 }}
'''

TAIL = '''
[contact]
linear = {{ normal_stiffness = 1e5, tangential_stiffness = 3e4, friction = 0.3 }}

[body_contact]
linear = {{ normal_stiffness = 1e6, tangential_stiffness = 3e5, friction = 0.3 }}

[output]
every = 2e-4

[[output.column]]
name = "points_in_contact"
unit = "1"
value = "contact.points"

[[output.column]]
name = "kinetic"
unit = "J/m"
value = "energy.kinetic + energy.rotation"

[[output.column]]
name = "elastic"
unit = "J/m"
value = "energy.elastic"

[[output.column]]
name = "contact"
unit = "J/m"
value = "energy.contact"

[[output.column]]
name = "friction"
unit = "J/m"
value = "energy.friction"

[[output.column]]
name = "work_gap"
unit = "1"
value = "energy.work_gap_relative"

[[output.column]]
name = "total"
unit = "J/m"
value = "energy.total"

[[output.column]]
name = "momentum_x"
unit = "N s/m"
value = "momentum.x"

[[output.column]]
name = "momentum_error"
unit = "1"
value = "momentum_error"

[[output.column]]
name = "residual"
unit = "1"
value = "energy.residual_relative"

[[check]]
name = "touches of points"
value = "contact.points*t_end/t_touch"
when = "mean"
at_least = 1000
source = "docs/scenes.md, verification/random_ledger: 1,000 contacts; a lower estimate"

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

[[check]]
name = "no energy is lost"
value = "energy.residual_relative"
when = "min"
at_least = -1e-3
source = "docs/scenes.md: energy is an invariant; FLIP and springs do not dissipate, friction is booked"

[[check]]
name = "stored plus kinetic energy never grows"
value = "energy.kinetic + energy.rotation + energy.elastic + energy.contact"
when = "rise"
at_most = "1e-3*initial.energy.total"
source = "nothing puts energy in: a closed box at rest, springs and an elastic law that have energies"

[[check]]
name = "what the stress does is stored"
value = "energy.work_gap_relative"
when = "max_error"
reference = 0.0
tolerance = 1e-3
source = "the law has an energy: its work is stored, but for the quadrature (docs/decisions/0018)"

# A seventh of it.
[variant.quick]
"time.end" = 0.03
"constants.t_end" = 0.03
"check.0.at_least" = 100

# Ten times as long: what a law or a scheme creates in every cycle adds up.
[variant.long]
"time.end" = 3.5
"constants.t_end" = 3.5
"output.every" = 1e-3

[variant.long_neo_hookean]
"time.end" = 3.5
"constants.t_end" = 3.5
"output.every" = 1e-3
"mpm.material.0.model" = {{ neo_hookean = {{ bulk_modulus = 4e5, shear_modulus = 2e5 }} }}

[variant.long_linear]
"time.end" = 3.5
"constants.t_end" = 3.5
"output.every" = 1e-3
"mpm.shape" = "linear"

[variant.long_quadratic]
"time.end" = 3.5
"constants.t_end" = 3.5
"output.every" = 1e-3
"mpm.shape" = "quadratic_bspline"

[variant.long_cubic]
"time.end" = 3.5
"constants.t_end" = 3.5
"output.every" = 1e-3
"mpm.shape" = "cubic_bspline"
'''

if __name__ == "__main__":
    main()

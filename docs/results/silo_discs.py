"""Discs out of the silo of scenes/jiang2020/silo.toml: their mass flow over Beverloo's law, beside that of the continuum.

    python3 docs/results/silo_discs.py target/release/tandem

Nothing catches the grains, so in steady flow the silo carries F = M (dv/dt + g), v their mean velocity, and the flow is the slope
of -F/g while a third to two thirds of them have left.
"""

import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

RADIUS, DENSITY, MASS, G = 0.0015, 1850.0, 16.3, 9.81
SCENE = """version = 1
name = "silo_discs"
about = "Discs flow out of a silo."
gravity = [0.0, -{G}]
[time]
end = 2.5
max_step = 1e-4
[dem]
{walls}
[[dem.fill]]
name = "grains"
count = {count}
grain = "disc"
size.uniform = {{ from = {small}, to = {large} }}
density = {DENSITY}
arrange.rows = {{ corner = [-0.0585, 0.06], width = 0.117 }}
[body_contact]
linear = {{ normal_stiffness = 2e5, tangential_stiffness = 1e5, friction = 0.5, damping_ratio = 0.3 }}
[output]
every = 2e-3
[[output.column]]
name = "vy"
unit = "m/s"
value = "fill.grains.vy"
"""
WALL = """[[dem.body]]
name = "{name}"
shape.segment = {{ ends = [[{x0}, {y0}], [{x1}, {y1}]] }}
sphero_radius = 0.005
motion = "fixed"
"""


def scene(opening):
    tip = opening / 2 + 0.005
    walls = ""
    for name, side in (("left", -1), ("right", 1)):
        walls += WALL.format(name=f"plate_{name}", x0=side * tip, y0=0.0, x1=side * (tip + 0.05), y1=0.05)
        walls += WALL.format(name=f"wall_{name}", x0=side * 0.065, y0=0.065 - tip, x1=side * 0.065, y1=0.3)
    count = int(MASS / (DENSITY * math.pi * RADIUS**2))
    return SCENE.format(G=G, walls=walls, count=count, small=0.8 * RADIUS, large=1.2 * RADIUS, DENSITY=DENSITY)


def slope(points):
    n = len(points)
    t0, f0 = sum(t for t, _ in points) / n, sum(f for _, f in points) / n
    return sum((t - t0) * (f - f0) for t, f in points) / sum((t - t0) ** 2 for t, _ in points)


def main():
    tandem = sys.argv[1]
    for opening in (0.02, 0.03, 0.04, 0.05, 0.06):
        with tempfile.TemporaryDirectory() as place:
            file = pathlib.Path(place, "silo_discs.toml")
            file.write_text(scene(opening))
            out = pathlib.Path(place, "out")
            subprocess.run([tandem, "run", file, "--in-process", "--out", out], check=True, capture_output=True)
            rows = [[float(x) for x in row] for row in list(csv.reader((out / "history.csv").open()))[1:]]
            bodies = json.loads((out / "summary.json").read_text())["bodies"]
        # The share of the weight that the silo carries, over 40 ms each.
        k = 20
        carried = [
            (0.5 * (rows[i][0] + rows[i + k][0]), 1 + (rows[i + k][1] - rows[i][1]) / (rows[i + k][0] - rows[i][0]) / G)
            for i in range(len(rows) - k)
        ]
        begin = next(i for i, (t, f) in enumerate(carried) if t > 0.2 and f < 2 / 3)
        end = next(i for i, (t, f) in enumerate(carried) if i > begin and f < 1 / 6)
        flow = -MASS * slope(carried[begin:end])
        law = 0.58 * 1500 * math.sqrt(G) * (opening - 2.2e-3) ** 1.5
        print(f"{100 * opening:.0f} cm: {bodies} bodies, {flow:.1f} kg/(m s), {flow / law:.2f} of Beverloo's law")


main()

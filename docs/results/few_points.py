"""What the affine field of APIC and AFLIP does to the energy of points that have their nodes for themselves (docs/energy.md).

    python3 docs/results/few_points.py target/release/tandem

Pair: two points without forces, DISTANCE apart along x, with velocities of either sign along y. Their kinetic energy with that of the
affine field over that of the start, after so many steps; a third point far away only keeps the run from being stopped as unstable.
One: a single elastic point, with and without an affine velocity, runs into a body or into the grid's slip wall.
"""

import csv
import pathlib
import subprocess
import sys
import tempfile

CELL = 0.01
COMMON = """
version = 1
name = "few_points"

[time]
end = {end}
max_step = {step}

[mpm]
cell = 0.01
domain = [[0.0, -0.2], [0.2, 0.2]]
shape = "quadratic_bspline"
transfer = {transfer}
walls = {{ left = "slip", right = "slip", bottom = "slip", top = "slip" }}

[[mpm.material]]
name = "solid"
density = 1000.0
model.linear_elastic = {{ bulk_modulus = {bulk}, shear_modulus = {shear} }}

[output]
every = {every}

[[output.column]]
name = "residual"
unit = "1"
value = "energy.residual_relative"
"""
POINT = """
[[mpm.points]]
name = "{name}"
material = "solid"
fill.rectangle = {{ lower = [{x}, {y}], upper = [{x_to}, {y_to}] }}
spacing.counts = [1, 1]
velocity = {velocity}
"""
PAIR = """
[[output.column]]
name = "kinetic"
unit = "J/m"
value = "points.one.kinetic + points.two.kinetic"
"""
ELASTIC = """
[[output.column]]
name = "elastic"
unit = "J/m"
value = "energy.elastic"

[[output.column]]
name = "kinetic"
unit = "J/m"
value = "energy.kinetic"
"""
BODY = """
[dem]
[[dem.body]]
name = "wall"
shape.segment = { ends = [[0.018, -0.2], [0.018, 0.2]] }
sphero_radius = 0.002
motion = "fixed"

[contact]
linear = { normal_stiffness = 1e5 }
"""
AFLIP = "{{ aflip = {{ pic_rate = {} }} }}"


def point(name, x, y, size, velocity):
    return POINT.format(name=name, x=x, y=y, x_to=x + size, y_to=y + size, velocity=velocity)


def run(tandem, scene):
    """The history of a scene, column by column."""
    with tempfile.TemporaryDirectory() as directory:
        place = pathlib.Path(directory)
        (place / "scene.toml").write_text(scene)
        command = [tandem, "run", str(place / "scene.toml"), "--in-process", "--out", str(place / "run")]
        ended = subprocess.run(command, capture_output=True, text=True)
        if not (place / "run" / "history.csv").exists():
            sys.exit(ended.stderr)
        with open(place / "run" / "history.csv") as file:
            head, *rows = csv.reader(file)
    return {name.split(" ")[0]: [float(row[i]) for row in rows] for i, name in enumerate(head)}


def pairs(tandem):
    steps = (1, 10, 30, 100, 300)
    print("| transfer | distance, cells | " + " | ".join(f"{n} steps" for n in steps) + " | 1 + (h/distance)^2 |")
    print("| --- " * (len(steps) + 3) + "|")
    cases = [("aflip, 0/s", AFLIP.format("0.0"), d) for d in (2.0, 1.0, 0.5, 0.25, 0.125)]
    cases += [("aflip, 20/s", AFLIP.format("20.0"), 0.25), ("aflip, 1000/s", AFLIP.format("1000.0"), 0.25)]
    cases += [("apic", '"apic"', 0.25), ("flip", '"flip"', 0.25)]
    for name, transfer, distance in cases:
        step = 1e-4 if "000" in name else 1e-5
        scene = COMMON.format(end=301 * step, step=step, every=step, transfer=transfer, bulk=1e-3, shear=1e-3) + PAIR
        size = 1e-3
        for i, (which, speed) in enumerate((("one", 0.01), ("two", -0.01))):
            scene += point(which, 0.1 + i * distance * CELL, 0.003, size, f"[0.0, {speed}]")
        scene += point("far", 0.05, -0.1, 0.01, "[0.0, 0.3]")
        kinetic = run(tandem, scene)["kinetic"]
        grown = [f"{kinetic[n] / kinetic[0]:.3f}" for n in steps]
        print(f"| {name} | {distance} | {' | '.join(grown)} | {1 + distance**-2:.2f} |")


def singles(tandem):
    print("| runs into | affine velocity | transfer | step, us | least and largest residual |")
    print("| --- | --- | --- | --- | --- |")
    for where, body in (("a body", BODY), ("a slip wall of the grid", "")):
        for slope in (0.0, -300.0):
            cases = [("aflip, 20/s", AFLIP.format("20.0"), step) for step in (1e-5, 2e-6)]
            cases += [("apic", '"apic"', 1e-5), ("flip", '"flip"', 1e-5)]
            for name, transfer, step in cases:
                scene = COMMON.format(end=0.02, step=step, every=1e-4, transfer=transfer, bulk=5e5, shear=3e5) + ELASTIC + body
                velocity = f'["-2.5 + {slope}*(x - 0.0335)", "{slope}*(y - 0.0055)"]'
                residual = run(tandem, scene + point("one", 0.031, 0.003, 0.005, velocity))["residual"]
                print(f"| {where} | {slope:g} /s | {name} | {1e6 * step:g} | {min(residual):.1e}, {max(residual):.1e} |")


if __name__ == "__main__":
    program = str(pathlib.Path(sys.argv[1]).resolve())
    pairs(program)
    print()
    singles(program)

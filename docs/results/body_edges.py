"""Scenes of bodies alone for docs/stability.md: python3 docs/results/body_edges.py DIR writes them, and

    tandem stability DIR/*.toml --out OUT --in-process --between 0.7,4 --ratio 1.05 --grid 8 --residual 0.3 \\
        --vary body_contact.linear.normal_stiffness=1e6

looks for their edges. All begin in contact, in equilibrium but for 1 cm/s.
"""

import math
import pathlib
import sys

K, G = 1e6, 10.0
FLOOR = """[[dem.body]]
name = "floor"
shape.segment = { ends = [[-1.0, -0.05], [1.0, -0.05]] }
sphero_radius = 0.05
motion = "fixed"
"""
NINE = "[%s]" % ", ".join(f"[{x}, {y}]" for y in (-0.02, 0.0, 0.02) for x in (-0.02, 0.0, 0.02))


def body(name, shape, radius, mass, position, extra):
    x, y = position
    return f"""[[dem.body]]
name = "{name}"
shape{shape}
sphero_radius = {radius}
mass = {mass}
position = [{x!r}, {y!r}]
{extra}
"""


def scene(name, end, bodies, friction, gravity=-G):
    tangential = 0.5 * K if friction > 0.0 else 0.0
    return f"""version = 1
name = "{name}"
about = "Bodies that press on one another, for the edge of stability."
gravity = [0.0, {gravity}]
[time]
end = {end}
[dem]
contact_resolution = 2
{"".join(bodies)}
[body_contact]
linear = {{ normal_stiffness = {K}, tangential_stiffness = {tangential}, friction = {friction} }}
[output]
every = 5e-3
[[output.column]]
name = "residual"
unit = "1"
value = "energy.residual_relative"
"""


def column(name, masses):
    """Discs on one another, from below, which move up and down only."""
    held = "motion = { guided = { hold_x = true, hold_angle = true } }\nvelocity = [0.0, -0.01]"
    bodies, y, radius = [FLOOR], 0.0, 0.05
    for i, mass in enumerate(masses):
        y += radius - sum(masses[i:]) * G / K
        bodies.append(body(f"disc_{i}", ' = "disc"', radius, mass, (0.0, y), held))
        y += radius
    return scene(name, 0.5, bodies, 0.0)


def stack(name, count):
    """Flush squares: four terms with the floor, eight with one another."""
    bodies, y = [FLOOR], 0.0
    for i in range(count):
        y += 0.05 - (count - i) * G / (K * (8 if i else 4))
        square = ".rectangle = { width = 0.08, height = 0.08 }"
        bodies.append(body(f"block_{i}", square, 0.01, 1.0, (0.0, y), "velocity = [0.0, -0.01]"))
        y += 0.05
    return scene(name, 0.3, bodies, 0.5)


def clusters():
    """Two clusters of nine discs, one on the other."""
    shape = f".cluster = {{ centers = {NINE} }}"
    bodies = [body(f"cluster_{i}", shape, 0.01, 1.0, (0.0, 0.03 + 0.06 * i - 1e-5 * (i + 1)), "velocity = [0.0, -0.01]") for i in (0, 1)]
    return scene("clusters", 0.3, [FLOOR, *bodies], 0.5)


def ring():
    """Twelve discs of 0.1 g that are pushed onto one of 1 kg."""
    bodies = [body("large", ' = "disc"', 0.1, 1.0, (0.0, 0.0), "")]
    for i in range(12):
        c, s = math.cos(math.pi * i / 6), math.sin(math.pi * i / 6)
        pushed = f"velocity = [{-0.01 * c!r}, {-0.01 * s!r}]\nmotion = {{ pushed = {{ force = [{-100 * c!r}, {-100 * s!r}] }} }}"
        bodies.append(body(f"small_{i}", ' = "disc"', 0.02, 1e-4, (0.1199 * c, 0.1199 * s), pushed))
    return scene("ring", 0.05, bodies, 0.0, gravity=0.0)


if __name__ == "__main__":
    where = pathlib.Path(sys.argv[1])
    where.mkdir(parents=True, exist_ok=True)
    scenes = {
        "two": column("two", [1.0, 1.0]),
        "five": column("five", [1.0] * 5),
        "heavy_on_light": column("heavy_on_light", [1e-2, 1e2]),
        "light_on_heavy": column("light_on_heavy", [1e2, 1e-2]),
        "block": stack("block", 1),
        "stack": stack("stack", 3),
        "clusters": clusters(),
        "ring": ring(),
    }
    for name, text in scenes.items():
        (where / f"{name}.toml").write_text(text)

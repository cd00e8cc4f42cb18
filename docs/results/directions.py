"""What the direction of the grid does to a collision and to the face of a block, by shape function and lattice of points.

    python3 docs/results/directions.py faces target/release/tandem
    python3 docs/results/directions.py shares target/release/tandem [hard] [soft] [--finest]
    python3 docs/results/directions.py row target/release/tandem

`faces`: a block that is turned by an angle meets a plate that is turned as much, head on; the flight of its outline until the first
touch, over the distance between points, which should be none, and the share of the points of a straight face that touch once it
has gone a quarter of that distance further, which should be all.

`shares`: scenes/jiang2020/collision_hard.toml and _soft.toml with the velocity and the other disc turned by an angle; the share of
the kinetic energy that is handed over, in cells of 3 mm, 1.5 mm and (`--finest`) 0.75 mm with 36 points each. The stiffness of a
point's contact and its contact radius go with the cell, so that the contact of a face is the same at each.

`row`: the soft collision whose contact is one row of points at any cell. The outermost ring is a group of its own with a contact radius
of 2 mm; the points inside have 0.05 mm, too little to touch.
"""

import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

ANGLES = (0, 15, 30, 45)
FACE = """version = 1
name = "face"
about = "A block meets a plate."
[time]
end = {end}
max_step = {step}
[mpm]
cell = 0.01
domain = [[-0.2, -0.2], [0.2, 0.2]]
shape = "quadratic_bspline"
transfer = "flip"
[[mpm.material]]
name = "block"
density = 2000.0
model.linear_elastic = {{ bulk_modulus = 5e6, shear_modulus = 3.7e6 }}
[[mpm.points]]
name = "block"
material = "block"
fill.polygon = {{ vertices = {block} }}
spacing.per_cell = 4
lattice = "{lattice}"
velocity = {velocity}
[dem]
[[dem.body]]
name = "plate"
shape.segment = {{ ends = {plate} }}
sphero_radius = 0.01
motion = "fixed"
[contact]
linear = {{ normal_stiffness = 1e5 }}
[output]
every = {step}
[[output.column]]
name = "touching"
unit = "1"
value = "contact.points"
"""
SIZE, SPEED, GAP, DISTANCE = 0.1, 1.0, 0.0025, 0.005


def turned(angle, x, y):
    c, s = math.cos(angle), math.sin(angle)
    return [c * x - s * y, s * x + c * y]


def run(tandem, scene, out, *options):
    """The run's directory."""
    command = [tandem, "run", str(scene), "--in-process", "--out", str(out), *options]
    ended = subprocess.run(command, capture_output=True, text=True)
    if not (out / "summary.json").exists():
        sys.exit(f"{' '.join(command)}\n{ended.stdout}{ended.stderr}")
    return out


def column(out, name):
    with open(out / "history.csv") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    place = next(i for i, head in enumerate(rows[0]) if head.split()[0] == name)
    time = next(i for i, head in enumerate(rows[0]) if head.split()[0] == "time")
    return [(float(row[time]), float(row[place])) for row in rows[1:] if row[place]]


def faces(tandem, work):
    step = 1e-5
    print("| lattice | angle | first touch, over the distance between points | of the face's points touch a quarter later |")
    print("| --- | --- | --- | --- |")
    for lattice in ("grid", "outline"):
        for degrees in ANGLES:
            angle, half = math.radians(degrees), SIZE / 2
            corners = [turned(angle, x * half, y * half) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            plate = [turned(angle, half + GAP + 0.01, y) for y in (-0.1, 0.1)]
            scene = work / f"face_{lattice}_{degrees}.toml"
            scene.write_text(
                FACE.format(end=0.006, step=step, block=corners, lattice=lattice, velocity=turned(angle, SPEED, 0.0), plate=plate)
            )
            touching = column(run(tandem, scene, work / scene.stem), "touching")
            first = next(t for t, n in touching if n > 0)
            outline = GAP / SPEED
            later = next(n for t, n in touching if t >= outline + 0.25 * DISTANCE / SPEED)
            print(f"| {lattice} | {degrees} | {(first - outline) * SPEED / DISTANCE:+.3f} | {later / (SIZE / DISTANCE):.2f} |")


def shares(tandem, work, arguments):
    scenes = [name for name in ("hard", "soft") if name in arguments] or ["hard", "soft"]
    cells = (0.003, 0.0015, 0.00075) if "--finest" in arguments else (0.003, 0.0015)
    print("| collision | lattice | shape | cell | " + " | ".join(f"{a} degrees" for a in ANGLES) + " | residual, most and least |")
    print("| --- | --- | --- | --- | " + "--- | " * len(ANGLES) + "--- |")
    for name in scenes:
        for lattice in ("grid", "outline"):
            for shape in ("ugimp", "quadratic_bspline", "cubic_bspline"):
                for cell in cells:
                    row, most, least = [], 0.0, 0.0
                    for degrees in ANGLES:
                        out = work / f"{name}_{lattice}_{shape}_{cell}_{degrees}"
                        share, high, low = collision(tandem, out, name, lattice, shape, cell, math.radians(degrees))
                        row.append(share)
                        most, least = max(most, high), min(least, low)
                    figures = " | ".join(f"{share:.4f}" for share in row)
                    print(f"| {name} | {lattice} | {shape} | {1000 * cell} mm | {figures} | {most:.1e}, {least:.1e} |", flush=True)


def collision(tandem, out, name, lattice, shape, cell, angle):
    values = {
        "mpm.cell": cell,
        "mpm.domain": [[-0.06, -0.06], [0.12, 0.12]],
        "mpm.shape": shape,
        "mpm.points.0.velocity": turned(angle, 2.0, 0.0),
        "dem.body.0.position": turned(angle, 0.042, 0.0),
        "contact.linear.normal_stiffness": 6e4 * cell / 0.003,
        "contact.linear.tangential_stiffness": 3e3 * cell / 0.003,
        "mpm.points.0.contact_radius": cell / 3,
        "output.report": "false",
    }
    if lattice != "grid":
        values["mpm.points.0.lattice"] = lattice
    options = [o for key, value in values.items() for o in ("--set", f"{key}={value}")]
    scene = pathlib.Path(__file__).parents[2] / "scenes" / "jiang2020" / f"collision_{name}.toml"
    run(tandem, scene, out, *options)
    summary = json.loads((out / "summary.json").read_text())
    share = next(c["value"] for c in summary["checks"] if c["name"] == "kinetic energy handed over")
    residual = [r for _, r in column(out, "residual")]
    return share, max(residual), min(residual)


def row(tandem, work):
    print("| shape | points a cell | cell | share handed over | largest residual |")
    print("| --- | --- | --- | --- | --- |")
    scene = pathlib.Path(__file__).parents[2] / "scenes" / "jiang2020" / "collision_soft.toml"
    cases = [("quadratic_bspline", 36, cell) for cell in (0.003, 0.0015, 0.00075, 0.0005)]
    cases += [("quadratic_bspline", 16, cell) for cell in (0.00075, 0.0005)]
    cases += [("cubic_bspline", 36, cell) for cell in (0.003, 0.0015, 0.00075)]
    for shape, count, cell in cases:
        distance = cell / math.sqrt(count)
        middle = 0.02 - distance / 2
        number = round(2 * math.pi * middle / distance)
        ring = [turned(2 * math.pi * i / number, middle, 0.0) for i in range(number)]
        common = f"material = 'soft_rubber', spacing.distance = {distance}, velocity = [2.0, 0.0]"
        inner = f"fill.disc = {{ center = [0.0, 0.0], radius = {0.02 - distance} }}, lattice = 'outline', contact_radius = 5e-5"
        outer = f"fill.points = {{ positions = {ring} }}, contact_radius = 2e-3"
        values = {
            "mpm.cell": cell,
            "mpm.domain": [[-0.06, -0.06], [0.12, 0.06]],
            "mpm.shape": shape,
            "mpm.points": f"[{{ name = 'disc', {common}, {inner} }}, {{ name = 'ring', {common}, {outer} }}]",
            "dem.body.0.position": [0.0435, 0.0],
            "contact.linear.normal_stiffness": 6e4 * distance / 5e-4,
            "contact.linear.tangential_stiffness": 3e3 * distance / 5e-4,
            "time.end": 0.014,
        }
        out = work / f"row_{shape}_{count}_{cell}"
        run(tandem, scene, out, *(o for key, value in values.items() for o in ("--set", f"{key}={value}")))
        summary = json.loads((out / "summary.json").read_text())
        share = next(c["value"] for c in summary["checks"] if c["name"] == "kinetic energy handed over")
        residual = max(r for _, r in column(out, "residual"))
        print(f"| {shape} | {count} | {1000 * cell} mm | {share:.4f} | {residual:.1e} |", flush=True)


if __name__ == "__main__":
    what, tandem, *arguments = sys.argv[1:]
    with tempfile.TemporaryDirectory() as directory:
        work = pathlib.Path(directory)
        if what == "shares":
            shares(tandem, work, arguments)
        else:
            {"faces": faces, "row": row}[what](tandem, work)

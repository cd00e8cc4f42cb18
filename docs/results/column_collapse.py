#!/usr/bin/env python3
"""Columns of five aspect ratios and three materials collapse: run-out and height beside laws of experiments and of continua.

    docs/results/column_collapse.py target/release/tandem [--runs DIR]

Writes docs/results/studies/column_collapse.csv, prints it as a table, and draws figures/column_run_out.svg and column_height.svg.
A run takes a few seconds to half a minute of CPU time. One that is there already is not made again.

- wedge: the run-out of the wedge that has the deposit's centre of mass, (3 x - r_0)/r_0.
- front: the end of the connected deposit, where a column of one point distance holds no point for the first time.
- foremost: the foremost point, which may fly on alone.
"""

import argparse
import csv
import pathlib
import re
import struct
import subprocess
import zlib

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
RATIOS = {"a05": 0.5, "a1": 1.0, "a2": 2.0, "a4": 4.0, "a7": 7.0}
# Angle of repose: of glass beads (Lajeunesse, Monnier and Homsy 2005), of sand (Lube and others 2005), of coarse grit (Balmforth and
# Kerswell 2005). Fixed before any run.
MATERIALS = {"beads": 22.0, "sand": 30.0, "grit": 37.0}
ANGLE = "mpm.material.0.model.drucker_prager.friction_angle"
WIDTH = 0.1  # of the column, m


def positions(run):
    """x of all points in the last frame, m."""
    data = sorted((run / "frames").glob("points_*.vtu"))[-1].read_bytes()
    mark = b'<AppendedData encoding="raw">'
    begin = data.find(mark) + len(mark)
    begin = data.index(b"_", begin) + 1
    array = re.search(rb'<DataArray[^>]*Name="Points"[^>]*>', data).group()
    at = begin + int(re.search(rb'offset="(\d+)"', array).group(1))
    kind = "f" if b"Float32" in array else "d"
    (blocks,) = struct.unpack_from("<Q", data, at)
    sizes = struct.unpack_from(f"<{blocks}Q", data, at + 24)
    at += 24 + 8 * blocks
    whole = b""
    for size in sizes:
        whole += zlib.decompress(data[at : at + size])
        at += size
    return struct.unpack(f"<{len(whole) // struct.calcsize(kind)}{kind}", whole)[::3]


def front(run, distance):
    """End of the connected deposit, m."""
    filled = {int(x / distance) for x in positions(run)}
    return distance * next(k for k in range(len(filled) + 1) if k not in filled)


def outcome(program, runs, material, variant):
    run = runs / f"{material}_{variant}"
    if not (run / "summary.json").exists():
        words = [program, "run", ROOT / "scenes/verification/column_collapse.toml", "--variant", variant, "--in-process",
                 "--set", f"{ANGLE}={MATERIALS[material]}", "--set", "output.frames=0.05", "--out", run]
        done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
        if done.returncode not in (0, 1):
            raise SystemExit(done.stderr)
    with open(run / "history.csv", encoding="utf-8") as file:
        last = list(csv.DictReader(file))[-1]
    told = {key.split(" ")[0]: float(value) for key, value in last.items()}
    distance = 0.5 * (0.0025 if RATIOS[variant] < 3 else 0.005)
    return {
        "material": material, "repose": MATERIALS[material], "ratio": RATIOS[variant], "wedge": told["run_out"],
        "front": (front(run, distance) - WIDTH) / WIDTH, "foremost": (told["foremost"] - WIDTH) / WIDTH,
        "height": told["height"] / WIDTH, "lost": told["lost"], "residual": told["residual"],
    }


def laws(ratio):
    """Run-outs: Lube 2005, Lajeunesse 2005 (beads), Lagree, Staron and Popinet 2011 (mu(I) in the plane)."""
    lube = 1.2 * ratio if ratio < 2.3 else 1.9 * ratio ** (2 / 3)
    beads = 1.8 * ratio if ratio < 3 else 1.8 * 3 ** (1 / 3) * ratio ** (2 / 3)
    continuum = 2.2 * ratio if ratio <= 7 else 3.9 * ratio**0.7
    return lube, beads, continuum


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tandem", type=pathlib.Path)
    parser.add_argument("--runs", type=pathlib.Path, default=ROOT / "target/results/runs/column_collapse")
    arguments = parser.parse_args()
    program = arguments.tandem.resolve()
    arguments.runs.mkdir(parents=True, exist_ok=True)
    rows = []
    print("| material, repose | a | wedge | front | foremost | Lube; beads; continuum | height over r_0 | lost |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for material, angle in MATERIALS.items():
        for variant, ratio in RATIOS.items():
            row = outcome(program, arguments.runs, material, variant)
            rows.append(row)
            said = "; ".join(f"{law:.2f}" for law in laws(ratio))
            print(f"| {material}, {angle:g} | {ratio:g} | {row['wedge']:.2f} | {row['front']:.2f} | {row['foremost']:.2f} | {said} "
                  f"| {row['height']:.2f} | {100 * row['lost']:.1f} % |", flush=True)
    table = HERE / "studies/column_collapse.csv"
    table.parent.mkdir(exist_ok=True)
    with open(table, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: f"{value:.4g}" if isinstance(value, float) else value for key, value in row.items()} for row in rows)
    draw = lambda name, title, label, y, expected: subprocess.run(
        [program, "plot", table, "--x", "ratio", *[word for one in y for word in ("--y", one)], "--by", "material", "--dots",
         *[word for one in expected for word in ("--expected", one)], "--xlog", "--ylog", "--xlabel", "aspect ratio",
         "--ylabel", label, "--title", title, "--out", HERE / "figures" / name], check=True)
    draw("column_run_out.svg", "Columns collapse: run-out", "run-out over r_0", ["wedge=wedge", "front=front"],
         ["Lube 2005=min(1.2*x, 1.9*x^(2/3))", "beads, Lajeunesse 2005=min(1.8*x, 2.6*x^(2/3))",
          "continuum in the plane, Lagree 2011=2.2*x"])
    draw("column_height.svg", "Columns collapse: height", "height over r_0", ["height"],
         ["Lube 2005=min(x, 0.65*x^0.4)", "Lajeunesse 2005=min(x, x^(1/3))"])


if __name__ == "__main__":
    main()

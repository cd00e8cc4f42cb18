#!/usr/bin/env python3
"""Flow out of the silo with a flat bottom (scenes/verification/silo_flat.toml): coefficient, lost cells and exponent.

    docs/results/silo_flat.py target/release/tandem [--runs DIR] [--transfers [--fine]] [-- MORE OPTIONS OF tandem run]

Runs the four openings, fits Q = C rho sqrt(g) (D - n cells)^1.5 and Q ~ D^m to them by least squares, and writes
docs/results/studies/silo_flat.csv. With --transfers the opening of 5 cm at twice the cell (--fine: at its own) with other steps and
transfers. A run at full size takes 50 s of CPU time; one that is there already is not made again.
"""

import argparse
import csv
import math
import pathlib
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
CELL, RHO, G = 0.0025, 1500.0, 9.81
OPENINGS = {"d3cm": (0.03, 0.6), "d4cm": (0.04, 0.6), "": (0.05, 0.6), "d6cm": (0.06, 0.5)}  # D, t_b
BEGIN = 0.25
OTHERS = {
    "aflip, 20/s, composed": [],
    "aflip, 20/s, a half": ["time.max_step=2.75e-5"],
    "aflip, 20/s, a twentieth": ["time.max_step=5.5e-6"],
    "flip": ['mpm.transfer="flip"'],
    "flip_pic, 2/s": ["mpm.transfer={ flip_pic = { pic_rate = 2.0 } }"],
    "flip_pic, 5/s": ["mpm.transfer={ flip_pic = { pic_rate = 5.0 } }"],
    "flip_pic, 20/s": ["mpm.transfer={ flip_pic = { pic_rate = 20.0 } }"],
    "flip_xpic, 2, 100/s": ["mpm.transfer={ flip_xpic = { order = 2, pic_rate = 100.0 } }"],
    "apic": ['mpm.transfer="apic"'],
}


def flow(program, run, words, end):
    """Slope of what has left over the window in kg/(m s)."""
    if not (run / "summary.json").exists():
        command = [program, "run", ROOT / "scenes/verification/silo_flat.toml", "--in-process", *words, "--out", run]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        if done.returncode not in (0, 1):
            raise SystemExit(done.stderr)
    with open(run / "history.csv", encoding="utf-8") as file:
        rows = [{key.split(" ")[0]: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    window = [(row["time"], row["left"]) for row in rows if BEGIN - 1e-9 <= row["time"] <= end + 1e-9]
    t, m = (sum(column) / len(window) for column in zip(*window))
    return -sum((a - t) * (b - m) for a, b in window) / sum((a - t) ** 2 for a, _ in window)


def line(points):
    """Slope and intercept of the straight line of least squares."""
    x, y = (sum(column) / len(points) for column in zip(*points))
    slope = sum((a - x) * (b - y) for a, b in points) / sum((a - x) ** 2 for a, _ in points)
    return slope, y - slope * x


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tandem", type=pathlib.Path)
    parser.add_argument("--runs", type=pathlib.Path, default=ROOT / "target/results/runs/silo_flat")
    parser.add_argument("--transfers", action="store_true")
    parser.add_argument("--fine", action="store_true")
    parser.add_argument("more", nargs="*")
    arguments = parser.parse_args()
    program, scale = arguments.tandem.resolve(), RHO * math.sqrt(G)
    arguments.runs.mkdir(parents=True, exist_ok=True)
    if arguments.transfers:
        base = None
        others = {name: keys for name, keys in OTHERS.items() if not (arguments.fine and "max_step" in "".join(keys))}
        cell, variant = ("fine", []) if arguments.fine else ("coarse", ["--variant", "coarse"])
        for name, keys in others.items():
            words = [*variant, *[word for key in keys for word in ("--set", key)], *arguments.more]
            run = arguments.runs / f"{cell} {name}".translate(str.maketrans(" ,/", "___"))
            found = flow(program, run, words, 0.6)
            base = base or found
            print(f"| {name} | {found:.2f} | {found / base:.3f} |", flush=True)
        return
    points = []
    for variant, (opening, end) in OPENINGS.items():
        words = [*(["--variant", variant] if variant else []), *arguments.more]
        points.append((opening, flow(program, arguments.runs / (variant or "d5cm"), words, end)))
    # Q^(2/3) is a straight line over D.
    slope, intercept = line([(opening, (found / scale) ** (2 / 3)) for opening, found in points])
    coefficient, cells = slope**1.5, -intercept / slope / CELL
    exponent, _ = line([(math.log(opening), math.log(found)) for opening, found in points])
    print("| D, cm | Q, kg/(m s) | Q/(rho sqrt(g) D^1.5) |\n| --- | --- | --- |")
    for opening, found in points:
        print(f"| {100 * opening:.0f} | {found:.1f} | {found / scale / opening**1.5:.3f} |")
    print(f"C = {coefficient:.3f}, D loses {cells:.2f} cells; exponent of D {exponent:.3f}")
    table = HERE / "studies/silo_flat.csv"
    table.parent.mkdir(exist_ok=True)
    table.write_text("opening [m],flow [kg/(m s)]\n" + "".join(f"{a:g},{b:.5g}\n" for a, b in points))


if __name__ == "__main__":
    main()

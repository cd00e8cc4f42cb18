#!/usr/bin/env python3
"""What of `jiang2020/blocks` hangs on what no paper gives: 30 samples of it, arrival, turn and rest with their scatter.

    docs/results/blocks_scatter.py target/release/tandem [--samples N] [--points quick] [--runs DIR]

The assumed numbers are drawn evenly from the ranges of ASSUMED, from a fixed seed, each range cut into as many parts as there are
samples (Latin hypercube), so that sample k is the same however many are run. Writes docs/results/studies/blocks_scatter.csv and
prints mean, standard deviation and range of each outcome, and the rank correlation (Spearman) of each outcome with each
assumption: the largest explains most. A run takes 15 s of CPU time; one that is there is not made again.
"""

import argparse
import csv
import pathlib
import random
import statistics
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SAMPLES, SEED = 30, 2020
# Range of each, and the keys that it sets.
ASSUMED = {
    "gate speed, m/s": (1.0, 4.0),
    "friction of the gate": (0.0, 0.4),
    "density of blocks": (500.0, 900.0),
    "left edge, m": (0.295, 0.305),
    "friction between blocks": (0.4, 0.8),
    "friction of blocks on the floor": (0.2, 0.6),
    "damping ratio of blocks": (0.1, 0.5),
    "normal stiffness of blocks, N/m": (3e4, 1.2e5),
}
EXPERIMENT = {"arrival, s": "0.25", "90 degrees, s": "0.40", "rest of block 2, cm": "34.6", "rest of block 1, cm": "40.1"}


def samples():
    dice = random.Random(SEED)
    columns = {}
    for name, (low, high) in ASSUMED.items():
        parts = list(range(SAMPLES))
        dice.shuffle(parts)
        columns[name] = [low + (high - low) * (part + dice.random()) / SAMPLES for part in parts]
    return [{name: column[k] for name, column in columns.items()} for k in range(SAMPLES)]


def keys(sample):
    edge, k = sample["left edge, m"], sample["normal stiffness of blocks, N/m"]
    law = lambda mu, adhesion: (f"{{ normal_stiffness = {k}, tangential_stiffness = {k / 20}, friction = {mu}, "
                                f"damping_ratio = {sample['damping ratio of blocks']}, adhesion = {adhesion} }}")
    sand = "{ normal_stiffness = 6e4, tangential_stiffness = 3e3, friction = %s }"
    pair = ['{ between = ["wood", "floor"], law.granular = ' + law(sample["friction of blocks on the floor"], 60.0) + " }",
            '{ between = ["sand", "gate"], law.linear = ' + sand % sample["friction of the gate"] + " }"]
    density = sample["density of blocks"]
    said = {
        "constants.x_blocks": edge,
        "dem.body.0.density": density,
        "dem.body.1.density": density,
        "dem.body.0.position": [edge + 0.01, 0.045],
        "dem.body.1.position": [edge + 0.01, 0.027],
        "dem.body.2.position": [edge + 0.01, 0.009],
        "dem.body.4.velocity": [0.0, sample["gate speed, m/s"]],
        "dem.body.4.surface": '"gate"',
        "body_contact.granular": law(sample["friction between blocks"], 30.0),
        "contact_pair": f"[{', '.join(pair)}]",
    }
    return [word for key, value in said.items() for word in ("--set", f"{key}={value}")]


def outcome(program, runs, number, sample, variant):
    run = runs / f"{number:02}"
    if not (run / "summary.json").exists():
        words = [program, "run", ROOT / "scenes/jiang2020/blocks.toml", "--in-process", *variant, *keys(sample), "--out", run]
        done = subprocess.run([str(word) for word in words], capture_output=True, text=True)
        if done.returncode not in (0, 1):
            print(f"sample {number}: {done.stderr.strip().splitlines()[-1]}", flush=True)
            return None
    with open(run / "history.csv", encoding="utf-8") as file:
        rows = [{key.split(" ")[0]: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    first = lambda holds: next((row["time"] for row in rows if holds(row)), float("nan"))
    last = rows[-1]
    return {
        "arrival, s": first(lambda row: row["front"] + 1e-3 >= sample["left edge, m"]),
        "90 degrees, s": first(lambda row: row["turned_2"] >= 90.0),
        "rest of block 2, cm": 100.0 * last["left_edge_2"],
        "rest of block 1, cm": 100.0 * last["left_edge_1"],
    }


def ranks(values):
    order = sorted(range(len(values)), key=values.__getitem__)
    rank = [0] * len(values)
    for k, i in enumerate(order):
        rank[i] = k
    return rank


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tandem", type=pathlib.Path)
    parser.add_argument("--samples", type=int, default=SAMPLES, help="the first of them")
    parser.add_argument("--points", choices=["all", "quarter"], default="all", help="of the sand")
    parser.add_argument("--runs", type=pathlib.Path, default=ROOT / "target/results/runs/blocks_scatter")
    arguments = parser.parse_args()
    variant = ["--set", "mpm.points.0.spacing.counts=[32, 63]"] if arguments.points == "quarter" else []
    arguments.runs.mkdir(parents=True, exist_ok=True)
    rows = []
    for number, sample in enumerate(samples()[: arguments.samples]):
        found = outcome(arguments.tandem.resolve(), arguments.runs, number, sample, variant)
        if found:
            rows.append({**sample, **found})
            print(number, *(f"{name} {value:.4g};" for name, value in found.items()), flush=True)
    table = HERE / "studies/blocks_scatter.csv"
    table.parent.mkdir(exist_ok=True)
    with open(table, "w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: f"{value:.5g}" for key, value in row.items()} for row in rows)
    print(f"\n{len(rows)} samples\n\n| outcome | experiment | mean | standard deviation | least, largest |\n| --- | --- | --- | --- | --- |")
    for name, theirs in EXPERIMENT.items():
        values = [row[name] for row in rows if row[name] == row[name]]
        if len(values) < 2:
            continue
        print(f"| {name} | {theirs} | {statistics.mean(values):.4g} | {statistics.stdev(values):.2g} | {min(values):.4g}, {max(values):.4g} "
              f"({len(values)}) |")
    print("\n| rank correlation with | " + " | ".join(EXPERIMENT) + " |\n| --- |" + " --- |" * len(EXPERIMENT))
    for assumed in ASSUMED:
        cells = []
        for name in EXPERIMENT:
            there = [row for row in rows if row[name] == row[name]]
            a, b = (ranks([row[column] for row in there]) for column in (assumed, name))
            cells.append(f"{statistics.correlation(a, b):+.2f}" if len(there) > 2 else "")
        print(f"| {assumed} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""`jiang2020/granular_matrix` at the paper's cell, all three contents of fines: force on the bar, and what the walls have seen.

    docs/results/granular_matrix.py target/release/tandem [--contents fines_low,fines_middle,fines_high] [--as-it-stands]
        [--container-stiffness 6e7] [--runs DIR]

Fines separate and their dilation ends at 1.05 of their volume (docs/results/sand.md), or, with --as-it-stands, dilate for ever as the
paper has it. Prints the rows of the table of docs/results/jiang2020.md. A run took 134 to 447 s of CPU time on 22 November 2026; one
that is there already is not made again.
"""

import argparse
import csv
import json
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SCENE = ROOT / "scenes/jiang2020/granular_matrix.py"
LAW = "mpm.material.0.model.drucker_prager"
ENDS = [1, 2, 4, 6, 7, 8, 9, 10, 11]  # of the centimetres of the table


def scene(folder, container):
    file = folder / "full.toml"
    if not file.exists():
        words = ["--cell", "0.0035", "--spacing", "0.002", *(["--container-stiffness", container] if container else [])]
        text = subprocess.run([sys.executable, SCENE, *words], capture_output=True, text=True, check=True).stdout
        # The settlement's clearance of the walls, row by row.
        column = ('[[output.column]]\nname = "clearance"\nunit = "m"\nvalue = "min(points.fines.ymin, min(points.fines.xmin, '
                  '0.61 - points.fines.xmax))"\n\n')
        file.write_text(text.replace("[[check]]", column + "[[check]]", 1))
    return file


def row(program, folder, file, content, keys):
    run = folder / content
    if not (run / "summary.json").exists():
        variant = [] if content == "fines_middle" else ["--variant", content]
        words = [program, "run", file, *variant, "--in-process", *[word for key in keys for word in ("--set", key)], "--out", run]
        subprocess.run([str(word) for word in words], capture_output=True, text=True)
    with open(run / "history.csv", encoding="utf-8") as told:
        rows = [{key.split(" ")[0]: float(value) for key, value in one.items()} for one in csv.DictReader(told)]
    work = [(one["settlement"], one["work_of_the_bar"]) for one in rows]

    def at(settlement):
        for (s, w), (t, v) in zip(work, work[1:]):
            if s <= settlement + 1e-9 <= t + 2e-9:
                return w + (v - w) * (settlement - s) / (t - s)
        return None

    cells = []
    for end in ENDS:
        first, last = at(0.01 * (end - 1)), at(0.01 * end)
        cells.append("" if first is None or last is None else f"{(last - first) / 10:.3g}")
    clear = min(one["clearance"] for one in rows)
    end = 100 * rows[-1]["settlement"]
    summary = json.loads((run / "summary.json").read_text())
    return f"| {content} | {' | '.join(cells)} | {end:.1f} cm, {summary['status']} | {1e3 * clear:.2f} mm | {1e6 * summary['dt_min']:.2f} us |"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tandem", type=pathlib.Path)
    parser.add_argument("--contents", default="fines_low,fines_middle,fines_high")
    parser.add_argument("--as-it-stands", action="store_true")
    parser.add_argument("--container-stiffness", help="N/m, between fines and container; 6e6 as of all contacts by default")
    parser.add_argument("--runs", type=pathlib.Path, default=ROOT / "target/results/runs/granular_matrix")
    arguments = parser.parse_args()
    stiff = f"_{arguments.container_stiffness}" if arguments.container_stiffness else ""
    folder = arguments.runs / (("as_it_stands" if arguments.as_it_stands else "critical") + stiff)
    folder.mkdir(parents=True, exist_ok=True)
    keys = [] if arguments.as_it_stands else [f"{LAW}.separates=true", f"{LAW}.critical_state={{ volume = 1.05 }}"]
    file = scene(folder, arguments.container_stiffness)
    print(f"| content | {' | '.join(f'{end} cm' for end in ENDS)} | ends at | least clearance of walls | least step |")
    print("| --- |" + " --- |" * (len(ENDS) + 3))
    for content in arguments.contents.split(","):
        print(row(arguments.tandem.resolve(), folder, file, content, keys), flush=True)


if __name__ == "__main__":
    main()

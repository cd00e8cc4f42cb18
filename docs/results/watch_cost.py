"""What `tandem watch` costs a run: its wall time with a page that is kept up to date over that without, in turns.

    python3 docs/results/watch_cost.py target/release/tandem [PAIRS] [SCENE [OPTION...]]

Ratios are of neighbours in time; their median and quartiles are printed.
"""

import json
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path


def run(tandem, scene, watched):
    """The wall time of the steps of a run in s, as it says itself."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [tandem, "run", *scene, "--out", str(out)] + ["--watch"] * watched
        subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)  # until the page is done too
        return json.loads((out / "summary.json").read_text())["stepping_wall_s"]


def main():
    tandem, *rest = sys.argv[1:]
    pairs = int(rest.pop(0)) if rest else 10
    scene = rest or ["scenes/jiang2020/collision_hard.toml"]
    ratios, walls = [], []
    for k in range(pairs):
        first = k % 2 == 0
        walls_of = {watched: run(tandem, scene, watched) for watched in (first, not first)}
        walls.append(walls_of[False])
        ratios.append(walls_of[True] / walls_of[False])
    low, middle, high = statistics.quantiles(ratios, n=4)
    print(f"{pairs} pairs, {statistics.median(walls):.1f} s a run without a page")
    print(f"wall time with a page over that without: {middle:.3f} (quartiles {low:.3f} to {high:.3f})")


main()

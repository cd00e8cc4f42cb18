"""What `tandem watch` costs a run: its wall time with a page that a reader follows over that without, in turns.

    python3 docs/results/watch_cost.py target/release/tandem [PAIRS] [SCENE [OPTION...]]

The reader asks for the page whenever the server says that the run has written something, as a browser does. Ratios are of
neighbours in time; their median and quartiles are printed, with the pages that were read in a run.
"""

import http.client
import json
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import urllib.request
from pathlib import Path


def follow(address, pages):
    """Reads the page, and again at each event, until the server ends."""
    base, token = address.split("?", 1)

    def page():
        with urllib.request.urlopen(f"{base}?{token}", timeout=60) as answer:
            pages.append(len(answer.read()))

    try:
        page()
        with urllib.request.urlopen(f"{base}events?{token}", timeout=60) as events:
            for line in events:
                if line.startswith(b"event: state"):
                    page()
                elif line.startswith(b"event: end"):
                    page()
                    return
    except (OSError, http.client.HTTPException):
        pass


def run(tandem, scene, watched, pages):
    """The wall time of the steps of a run in s, as it says itself."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [tandem, "run", *scene, "--out", str(out)] + ["--watch"] * watched
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
            for line in process.stdout:
                if found := re.search(r"shown at (http\S+)", line):
                    threading.Thread(target=follow, args=(found[1], pages), daemon=True).start()
        return json.loads((out / "summary.json").read_text())["stepping_wall_s"]


def main():
    tandem, *rest = sys.argv[1:]
    pairs = int(rest.pop(0)) if rest else 10
    scene = rest or ["scenes/jiang2020/collision_hard.toml"]
    ratios, pages, walls = [], [], []
    for k in range(pairs):
        first = k % 2 == 0
        walls_of = {watched: run(tandem, scene, watched, pages) for watched in (first, not first)}
        walls.append(walls_of[False])
        ratios.append(walls_of[True] / walls_of[False])
    low, middle, high = statistics.quantiles(ratios, n=4)
    print(f"{pairs} pairs, {statistics.median(walls):.1f} s a run without a page, {len(pages) / pairs:.1f} pages a run")
    print(f"wall time with a page over that without: {middle:.3f} (quartiles {low:.3f} to {high:.3f})")


main()

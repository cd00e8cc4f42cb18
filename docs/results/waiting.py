"""What waiting costs on a machine that does something else too: wall times of runs beside busy loops, of one or more builds in
turns (docs/decisions/0006-waiting.md).

    python3 docs/results/waiting.py --program before=OLD/target/release/tandem --program now=target/release/tandem \
        [--bench before=OLD/target/release/deps/exchange-X --bench now=target/release/deps/exchange-Y] \
        [--scene blocks] [--way processes] [--loops 0,1,2,4] [--rounds 7]

Prints one row for each scene (or the empty exchange), way and number of loops: the median of each program in s (the exchange: us a
step), and its ratio to the first program beside no loop. The state hashes of all runs of a scene must be the same.
"""

import argparse
import json
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = {
    "blocks": ["jiang2020/blocks", "--variant", "quick"],
    "collision_hard": ["jiang2020/collision_hard"],
    "hopper": ["verification/hopper", "--variant", "quick"],
}
WAYS = {
    "processes": ([], []),
    "one core": (["taskset", "-c", "0"], []),
    "in process": ([], ["--in-process"]),
}


def named(text):
    name, _, path = text.partition("=")
    return name, path


def busy(count):
    """So many processes that do nothing but compute."""
    return [subprocess.Popen(["sh", "-c", "while :; do :; done"]) for _ in range(count)]


def run(program, scene, way):
    """Wall time in s and state hash of one run."""
    before, after = WAYS[way]
    name, *rest = SCENES[scene]
    with tempfile.TemporaryDirectory() as out:
        command = [*before, program, "run", str(ROOT / f"scenes/{name}.toml"), *rest, "--out", f"{out}/run", "--set",
                   "output.report=false", *after]
        start = time.perf_counter()
        done = subprocess.run(command, capture_output=True, text=True)
        wall = time.perf_counter() - start
        if done.returncode not in (0, 1):
            sys.exit(f"{' '.join(command)}: status {done.returncode}\n{done.stderr}")
        return wall, json.loads(pathlib.Path(f"{out}/run/summary.json").read_text())["state_hash"]


def exchange(bench, way):
    """Wall time in us of an empty step between processes, 64 steps a window."""
    before, _ = WAYS[way]
    command = [*before, bench, "--bench", "processes, window 64/0", "--measurement-time", "1", "--noplot"]
    out = subprocess.run(command, capture_output=True, text=True, cwd="/tmp", check=True).stdout
    value, unit = re.search(r"time: +\[\S+ \S+ (\S+) (\S+)", out).groups()
    return float(value) * {"ns": 1e-3, "µs": 1.0, "ms": 1e3, "s": 1e6}[unit]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program", action="append", default=[], type=named)
    parser.add_argument("--bench", action="append", default=[], type=named)
    parser.add_argument("--scene", action="append", default=[])
    parser.add_argument("--way", action="append", default=[])
    parser.add_argument("--loops", default="0,1,2,4")
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    rows = [(scene, way) for scene in options.scene or SCENES for way in options.way or WAYS if options.program]
    rows += [("exchange", way) for way in options.way or ["processes", "one core"] if options.bench]
    for scene, way in rows:
        base, hashes = None, set()
        for loops in map(int, options.loops.split(",")):
            others = busy(loops)
            try:
                time.sleep(0.3 if loops else 0.0)
                times = {}
                for _ in range(options.rounds):
                    for name, path in options.bench if scene == "exchange" else options.program:
                        if scene == "exchange":
                            value = exchange(path, way)
                        else:
                            value, state = run(path, scene, way)
                            hashes.add(state)
                        times.setdefault(name, []).append(value)
            finally:
                for other in others:
                    other.kill()
                    other.wait()
            middle = {name: statistics.median(values) for name, values in times.items()}
            base = base or next(iter(middle.values()))
            cells = " | ".join(f"{name} {value:.3f} ({value / base:.2f})" for name, value in middle.items())
            print(f"| {scene} | {way} | {loops} | {cells} |", flush=True)
        if len(hashes) > 1:
            sys.exit(f"{scene}: different states: {hashes}")


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""What `tandem plan` says a run costs, beside what the run then costs: every scene of the catalogue and every variant whose plan
says between LEAST and MOST seconds.

    docs/results/plan_cost.py TANDEM [--least 2] [--most 60] > docs/results/plan_cost.md

Run it on a quiet machine; a table of ratios is printed."""

import argparse
import datetime
import json
import pathlib
import re
import statistics
import subprocess
import tempfile
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
UNITS = {"ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0}


def told(tandem, words):
    """Seconds that the plan says, or why it says none."""
    plan = subprocess.run([tandem, "plan", *words], capture_output=True, text=True, cwd=ROOT)
    line = next((line.strip() for line in plan.stdout.splitlines() if line.strip().startswith("time ")), plan.stderr.strip())
    found = re.match(r"time +(?:about )?([\d. hmins]+) on this machine", line)
    if not found:
        return line
    words = found[1].split()
    return sum(float(number) * UNITS[unit] for number, unit in zip(words[::2], words[1::2]))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tandem")
    parser.add_argument("--least", type=float, default=2.0)
    parser.add_argument("--most", type=float, default=60.0)
    args = parser.parse_args()
    rows = []
    for path in sorted((ROOT / "scenes").glob("*/*.toml")):
        variants = tomllib.loads(path.read_text()).get("variant", {})
        for variant in [None, *variants]:
            words = [str(path.relative_to(ROOT)), *(["--variant", variant] if variant else [])]
            said = told(args.tandem, words)
            if not isinstance(said, float) or not args.least <= said <= args.most:
                continue
            with tempfile.TemporaryDirectory() as out:
                run = subprocess.run([args.tandem, "run", *words, "--out", f"{out}/run"], capture_output=True, text=True, cwd=ROOT)
                summary = json.loads(pathlib.Path(out, "run/summary.json").read_text())
            # A run that is stopped on its way is not what the plan is about.
            if summary["status"] in ("done", "check_failed"):
                rows.append((f"{path.parent.name}/{path.stem}", variant or "", said, summary["wall_s"]))
    print(f"# What a plan says a run costs, and what it costs\n\n{datetime.date.today()}, `docs/results/plan_cost.py`\n")
    print("| scene | variant | plan, s | run, s | run over plan |\n| --- | --- | --- | --- | --- |")
    for scene, variant, said, took in rows:
        print(f"| `{scene}` | {variant} | {said:.1f} | {took:.1f} | {took / said:.2f} |")
    ratios = [took / said for *_, said, took in rows]
    within = sum(0.5 <= ratio <= 2.0 for ratio in ratios)
    print(f"\n{within} of {len(ratios)} within a factor of two; median {statistics.median(ratios):.2f}.")


if __name__ == "__main__":
    main()

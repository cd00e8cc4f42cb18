"""A grid of runs as one table (docs/studies.md)."""

import math
from pathlib import Path

import pandas

from .program import BAD_INPUT, RunError, SceneError, TandemError, bar, running, wait
from .runs import table
from .scene import value

# Some run failed; the table says which.
SOME_FAILED = 3


def study(scene, vary, out, *, sample=None, jobs=1, options=(), progress=True):
    """Runs every combination of the values of keys, and gives `study.csv`: a row for each run, with its error and times.

    `vary` is a dict such as `{"mpm.cell": [0.002, 0.001], "variant": ["flip", "apic"]}`; runs that `out` has are not repeated.
    With `sample`, a number of runs, it is a dict of ranges such as `{"mpm.cell": "uniform(0.001, 0.002)"}`.
    `options` are more words for `tandem study`. A run that fails is a row with its reason.
    """
    words = ["study", *scene.words(), "--out", out, "--jobs", jobs]
    if sample:
        words += ["--sample", sample]
    for key, values in vary.items():
        shown = values if sample else ",".join(str(one) if key == "variant" else value(one) for one in values)
        words += ["--over" if sample else "--vary", f"{key}={shown}"]
    said = []
    shown = bar(sample or math.prod(map(len, vary.values())), Path(out).name) if progress else None

    def look():
        if shown is not None:
            shown.n = min(sum(1 for _ in Path(out).glob("runs/*/summary.json")), shown.total)
            shown.refresh()

    try:
        with running([*words, *options], said.extend) as process:
            wait(process, look)
    finally:
        if shown is not None:
            shown.close()
    if process.returncode not in (0, SOME_FAILED):
        kind = SceneError if process.returncode == BAD_INPUT else RunError
        raise kind("".join(said).strip() or f"the study ended with status {process.returncode}")
    return table(Path(out) / "study.csv")


def sensitivities(out, seed=0):
    """The statistics of a sample (`tandem study --sample`) with the first-order Sobol indices of each result, by SALib.

    A row for each result of `statistics.csv`, a column `S1 KEY` for each key that was drawn, and `S1 KEY +-`, half of the interval
    that has the index with 95 %. The method is RBD-FAST (Tissot and Prieur 2012), which needs no runs beside the sample. A run
    without the result is left out; fewer than 16 runs are refused. `seed` is that of the intervals.
    """
    try:
        from SALib.analyze import rbd_fast
    except ImportError as error:
        raise TandemError(f"{error}: pip install SALib") from error
    statistics, runs = pandas.read_csv(Path(out) / "statistics.csv"), pandas.read_csv(Path(out) / "study.csv")
    begin, end = (runs.columns.get_loc(name) for name in ("curve", "resolution"))
    keys = list(runs.columns[begin + 1 : end])
    for at, result in enumerate(statistics["result"]):
        known = runs[runs[result].notna()]
        if len(known) < 16:
            raise TandemError(f"{result}: {len(known)} runs have it; an index needs at least 16")
        # More harmonics see sharper dependences, and each takes two of the runs.
        found = rbd_fast.analyze({"num_vars": len(keys), "names": keys}, known[keys].to_numpy(), known[result].to_numpy(),
                                 M=min(10, len(known) // 8), seed=seed)
        for key, index, half in zip(keys, found["S1"], found["S1_conf"]):
            statistics.loc[at, [f"S1 {key}", f"S1 {key} +-"]] = index, half
    return statistics

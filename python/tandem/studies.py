"""A grid of runs as one table (docs/studies.md)."""

import math
from pathlib import Path

from .program import BAD_INPUT, RunError, SceneError, bar, running, wait
from .runs import table
from .scene import value

# Some run failed; the table says which.
SOME_FAILED = 3


def study(scene, vary, out, *, jobs=1, options=(), progress=True):
    """Runs every combination of the values of keys, and gives `study.csv`: a row for each run, with its error and times.

    `vary` is a dict such as `{"mpm.cell": [0.002, 0.001], "variant": ["flip", "apic"]}`; runs that `out` has are not repeated.
    `options` are more words for `tandem study`. A run that fails is a row with its reason.
    """
    words = ["study", *scene.words(), "--out", out, "--jobs", jobs]
    for key, values in vary.items():
        shown = (str(one) if key == "variant" else value(one) for one in values)
        words += ["--vary", f"{key}={','.join(shown)}"]
    said = []
    shown = bar(math.prod(map(len, vary.values())), Path(out).name) if progress else None

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

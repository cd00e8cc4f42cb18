"""A grid of runs as one table (docs/studies.md)."""

import math
import signal
import subprocess
import threading
from pathlib import Path

from .program import BAD_INPUT, RunError, SceneError, bar, start
from .runs import LOOK, table
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
    process = start([*words, *options], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = []
    reader = threading.Thread(target=lambda: said.extend(process.stderr), daemon=True)
    reader.start()
    shown = bar(math.prod(map(len, vary.values())), Path(out).name) if progress else None
    try:
        while process.poll() is None:
            if shown is not None:
                shown.n = min(sum(1 for _ in Path(out).glob("runs/*/summary.json")), shown.total)
                shown.refresh()
            try:
                process.wait(LOOK)
            except subprocess.TimeoutExpired:
                pass
    except BaseException:
        process.send_signal(signal.SIGINT)
        process.wait()
        raise
    finally:
        reader.join()
        process.stderr.close()
        if shown is not None:
            shown.close()
    if process.returncode not in (0, SOME_FAILED):
        kind = SceneError if process.returncode == BAD_INPUT else RunError
        raise kind("".join(said).strip() or f"the study ended with status {process.returncode}")
    return table(Path(out) / "study.csv")

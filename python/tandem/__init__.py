"""Runs of Tandem in Python: build a scene, run it, read what it leaves.

    import tandem

    scene = tandem.Scene("jiang2020/collision_hard", variant="quick")
    run = tandem.run(scene, "runs/hard", report=True)
    run.checks()                    # raises if one fails
    run.history.plot("time", "force")
    tandem.study(scene, {"mpm.cell": [0.004, 0.005]}, "runs/cells")

The program `tandem` does all work and all checking; this package starts it and reads its files. docs/install.md is the guide.
"""

from .program import SCENES, RunError, SceneError, TandemError, program
from .runs import ChecksFailed, Run, run
from .scene import Scene
from .studies import sensitivities, study

__all__ = ["SCENES", "ChecksFailed", "Run", "RunError", "Scene", "SceneError", "TandemError", "program", "run", "sensitivities", "study"]

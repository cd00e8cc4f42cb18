"""Tests of NAME: python3 -m unittest discover NAME

The second one starts `tandem`, or what $TANDEM names.
"""

import os
import pathlib
import shlex
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import solver  # noqa: E402
from tandem_solver import Step  # noqa: E402
from tandem_solver.ledger import BodyLedger, Point  # noqa: E402

LAW = {
    "normal_stiffness": 1e4, "tangential_stiffness": 5e3, "friction": 0.1, "damping_ratio": 0.0, "damped_mass": 0.0,
}
DISC = {
    "name": "disc", "shape": "disc", "sphero_radius": 0.1, "inertia": {"mass": 2.0}, "position": [0.0, 0.0], "angle": 0.0,
    "velocity": [0.0, 0.0], "spin": 0.0, "motion": "free", "surface": "",
}


class Alone(unittest.TestCase):
    def test_a_point_is_pushed_away_and_the_disc_the_other_way(self):
        config = {"gravity": [0.0, 0.0], "body": [DISC], "contact": {"linear": LAW}, "body_contact": None, "contact_pair": []}
        made = solver.Solver()
        made.configure(config)
        step = Step(index=1, time=0.0, dt_before=1e-3, dt=1e-3, measure=False)
        # 0.01 m deep: 100 N.
        points = [Point(0, 0.01, 1.0, 0, 0, 0.1, 0.0, 0.0, 0.0, 0.0)]
        forces = BodyLedger(config, made.bodies()).forces(points)
        made.contact(step, points, forces)
        made.advance(step)
        self.assertAlmostEqual(forces.on_points[0][0], 100.0, delta=1e-9)
        self.assertAlmostEqual(made.bodies()[0].vx, -100.0 / 2.0 * 1e-3, delta=1e-12)


class InTandem(unittest.TestCase):
    def test_the_kit_passes_it(self):
        command = shlex.join([sys.executable, str(HERE / "solver.py")])
        kit = [os.environ.get("TANDEM", "tandem"), "conformance", "--require", "held", "--cases", "100", "--dem", command]
        judged = subprocess.run(kit, capture_output=True, text=True)
        self.assertEqual(judged.returncode, 0, judged.stdout[-4000:] + judged.stderr)


if __name__ == "__main__":
    unittest.main()

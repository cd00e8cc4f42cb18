"""Runs from Python. They start the program that $TANDEM names, and need pandas: tests/python.rs runs them where both are."""

import os
import re
import tempfile
import unittest
from pathlib import Path

try:
    import numpy as np
    import pandas

    import tandem
    from tandem.scene import as_toml, value
except ImportError as error:
    raise unittest.SkipTest(str(error)) from None
if "TANDEM" not in os.environ:
    raise unittest.SkipTest("$TANDEM names no program")

TREE = Path(__file__).resolve().parents[2]
HARD = tandem.Scene("jiang2020/collision_hard", variant="quick", values={"output.frames": 0.002})
SMALL = {
    "version": 1,
    "name": "small",
    "gravity": [0, -9.81],
    "time": {"end": 0.1},
    "dem": {"body": [{"name": "ball", "shape": "disc", "sphero_radius": 0.1, "density": 1000.0, "position": [0.0, 1.0]}]},
    "output": {"every": 0.01, "column": [{"name": "y", "unit": "m", "value": "body.ball.y"}]},
    "check": [{"name": "falls", "value": "body.ball.y", "reference": "1-9.81*t^2/2", "relative_tolerance": 0.01, "source": "Galilei"}],
}


class Runs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.out = Path(folder.name) / "out"

    def test_a_run_of_the_catalogue_has_tables_frames_checks_and_a_page(self):
        run = tandem.run(HARD, self.out, report=True)
        self.assertEqual(run.summary["status"], "done")
        self.assertEqual(list(run.history.columns[:3]), ["time", "v_disc", "v_target"])
        self.assertEqual(run.history.attrs["units"]["v_disc"], "m/s")
        self.assertEqual(len(run.history), 121)
        self.assertEqual(len(run.course), 121)
        self.assertEqual(run.course["kinetic"][0], 5.056)
        self.assertEqual(list(run.bodies["name"]), ["target"])
        self.assertTrue(run.checks()["pass"].all())
        self.assertEqual(len(run.frames), 7)
        self.assertEqual(run.frames.times[1], 0.002)
        points = run.frames[-1].meshes["points"]
        self.assertEqual(points.points.shape, (1264, 3))
        self.assertLess(points.of_points["velocity"][:, 0].mean(), 0.1)
        self.assertEqual([frame.time for frame in run.frames[1:3]], run.frames.times[1:3])
        self.assertIn("srcdoc=", run._repr_html_())

    def test_meshes_are_pyvistas_with_the_same_arrays(self):
        try:
            import pyvista  # noqa: F401
        except ImportError as error:
            self.skipTest(str(error))
        frame = tandem.run(HARD, self.out).frames[3]
        self.assertIn("bodies", frame.meshes)
        for name, mesh in frame.meshes.items():
            grid = mesh.pyvista()
            self.assertEqual(grid.n_points, len(mesh.points), name)
            self.assertEqual(grid.n_cells, len(mesh.types), name)
            for array in mesh.of_points if len(mesh.points) else ():
                np.testing.assert_array_equal(grid.point_data[array], mesh.of_points[array])
            for array in mesh.of_cells if len(mesh.types) else ():
                np.testing.assert_array_equal(grid.cell_data[array], mesh.of_cells[array])
            for cell in range(min(grid.n_cells, 5)):
                begin, end = mesh.offsets[cell : cell + 2]
                np.testing.assert_array_equal(grid.get_cell(cell).points, mesh.points[begin:end])

    def test_a_dict_is_a_scene_and_a_failed_check_raises(self):
        scene = tandem.Scene(SMALL)
        self.assertEqual(scene.check(), [])
        run = tandem.run(scene, self.out)
        self.assertEqual(run.checks()["pass"].tolist(), [True])
        heavy = scene.having({"gravity": np.array([0.0, -20.0])})
        run = tandem.run(heavy, self.out)
        with self.assertRaisesRegex(tandem.ChecksFailed, r"falls: 0\.89.*Galilei"):
            run.checks()
        self.assertEqual(run.checks(raising=False)["pass"].tolist(), [False])

    def test_faults_are_those_of_the_program(self):
        wrong = tandem.Scene({**SMALL, "gravty": 1})
        for ask in (wrong.check, lambda: tandem.run(wrong, self.out)):
            with self.assertRaisesRegex(tandem.SceneError, r"unknown key `gravty`(.|\n)*did you mean `gravity`"):
                ask()
        self.assertFalse(self.out.exists())
        with self.assertRaisesRegex(tandem.SceneError, "object"):
            tandem.Scene({**SMALL, "gravity": object()})

    def test_a_run_that_does_not_reach_its_end_says_why_and_leaves_what_it_has(self):
        away = HARD.having({"mpm.points.0.velocity": [-20.0, 0.0]})
        with self.assertRaisesRegex(tandem.RunError, "left the domain") as raised:
            tandem.run(away, self.out)
        self.assertEqual(raised.exception.run.summary["status"], "failed")
        self.assertGreater(len(raised.exception.run.history), 1)

    def test_a_study_is_a_table_with_a_row_for_each_combination(self):
        scene = HARD.having({"check": []})
        vary = {"mpm.cell": [0.004, 0.005], "contact.linear.friction": [0.0, 0.2]}
        table = tandem.study(scene, vary, self.out, options=["--in-process", "--repeat", "1"])
        self.assertIsInstance(table, pandas.DataFrame)
        self.assertEqual(sorted(table["mpm.cell"]), [0.004, 0.004, 0.005, 0.005])
        self.assertEqual(set(table["status"]), {"done"})
        with self.assertRaisesRegex(tandem.SceneError, "mpm.cel"):
            tandem.study(scene, {"mpm.cel": [1]}, self.out)


    def test_sensitivities_are_those_of_a_known_law(self):
        ball = {**SMALL["dem"]["body"][0], "velocity": [2.0, 2.0]}
        # After 1 s y = 1 + vy + g/2, and of x*y a share of 0.044 is of vx together with the two others.
        columns = [{"name": "y", "unit": "m", "value": "body.ball.y"}, {"name": "xy", "unit": "m^2", "value": "body.ball.x*body.ball.y"}]
        scene = tandem.Scene({**SMALL, "time": {"end": 1.0}, "dem": {"body": [ball]}, "check": [], "output": {"every": 1.0, "column": columns}})
        over = {"dem.body.0.velocity.0": "uniform(1, 3)", "dem.body.0.velocity.1": "uniform(1, 3)", "gravity.1": "uniform(-11, -9)"}
        runs = tandem.study(scene, over, self.out, sample=200, jobs=2, options=["--in-process"])
        self.assertEqual(len(runs), 200)
        found = tandem.sensitivities(self.out)
        self.assertEqual(list(found["result"]), ["y [m]", "xy [m^2]"])
        expected = [(0, 0.8, 0.2), (4 / 3, 4 / 3, 1 / 3)]
        for at, total in enumerate((1, 4 / 3 + 5 / 3 + 5 / 36)):
            for key, share in zip(over, expected[at]):
                self.assertAlmostEqual(found[f"S1 {key}"][at], share / total, delta=0.08)
                self.assertTrue(0 < found[f"S1 {key} +-"][at] < 0.2)
        np.testing.assert_allclose(found["mean"], [-2, -4], atol=0.05)
        few = Path(self.out).with_name("few")
        tandem.study(scene, over, few, sample=4, options=["--in-process"])
        with self.assertRaisesRegex(tandem.TandemError, "4 runs have it"):
            tandem.sensitivities(few)


class Values(unittest.TestCase):
    def test_values_are_written_as_toml_reads_them(self):
        tree = {"a b": [1, 2.5, True, "x\"\n\x7fé"], "inner": {"list": [{"k": 1e-30}, {}], "far": float("inf")}, "n": np.float64(3)}
        try:
            import tomllib
        except ImportError:
            self.skipTest("no tomllib")
        self.assertEqual(tomllib.loads(as_toml(tree)), {**tree, "n": 3.0})
        self.assertEqual(value(np.int64(3)), "3")

    def test_the_distribution_wants_what_tests_are_run_with(self):
        wanted = re.search(r"iceoryx2==[0-9.]+", (TREE / "pyproject.toml").read_text()).group()
        self.assertIn(wanted, (TREE / "python/requirements.txt").read_text().split())


if __name__ == "__main__":
    unittest.main()

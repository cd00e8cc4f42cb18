"""The contact of bodies with points, and the ledger that the driver keeps of it."""

import math
import random
import unittest

from tandem_solver import Limits, PointContact, Refusal, Shape, Step
from tandem_solver.contact import see, swept
from tandem_solver.ledger import BodyLedger, Point

SQUARE = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]


def body(**changes):
    plain = {
        "name": "b", "shape": "disc", "sphero_radius": 0.1, "inertia": {"mass": 2.0}, "position": [0.0, 0.0], "angle": 0.0,
        "velocity": [0.0, 0.0], "spin": 0.0, "motion": "free", "surface": "",
    }
    return {**plain, **changes}


def linear(**changes):
    plain = {
        "normal_stiffness": 1e4, "tangential_stiffness": 5e3, "friction": 0.3, "damping_ratio": 0.0, "damped_mass": 0.0,
    }
    return {"linear": {**plain, **changes}}


class Outlines(unittest.TestCase):
    def test_distance_and_normal_at_edges_and_corners(self):
        for (x, y), expected in [
            ((1.0, -0.5), (0.5, 0.0, -1.0)), ((1.0, 0.25), (-0.25, 0.0, -1.0)), ((5.0, 6.0), (5.0, 0.6, 0.8)),
            ((1.0, 0.0), (0.0, 0.0, -1.0)),
        ]:
            for got, wanted in zip(see(SQUARE, x, y), expected):
                self.assertAlmostEqual(got, wanted, delta=1e-15)
        self.assertEqual(see([(0.0, 0.0), (1.0, 0.0)], 0.5, -0.1), (0.1, 0.0, -1.0))
        self.assertEqual(see([(1.0, 1.0)], 1.0, 1.0), (0.0, 0.0, 1.0))

    def test_moments_of_a_swept_outline_are_those_of_a_lattice(self):
        outline, a, h = [(0.0, 0.0), (1.0, 0.2), (0.4, 0.9)], 0.2, 0.005
        cells = [((i + 0.5) * h - 0.3, (j + 0.5) * h - 0.3) for i in range(320) for j in range(320)]
        inside = [cell for cell in cells if see(outline, *cell)[0] <= a]
        area, centroid, polar = swept(outline, a)
        self.assertAlmostEqual(area, len(inside) * h * h, delta=1e-3)
        self.assertAlmostEqual(centroid[0] * area, sum(x for x, _ in inside) * h * h, delta=1e-3)
        self.assertAlmostEqual(polar, sum(x * x + y * y for x, y in inside) * h * h, delta=1e-3)

    def test_what_makes_no_body_is_refused_by_its_key(self):
        notch = {"polygon": {"vertices": [[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]]}}
        for bad, key in [
            (body(shape=notch), "dem.body.3.shape"), (body(inertia={"mass": 0.0}), "dem.body.3.inertia"),
            (body(motion="fixed", spin=1.0), "dem.body.3.motion"), (body(shape={"cluster": {}}), "dem.body.3.shape"),
        ]:
            with self.assertRaises(Refusal) as refused:
                Shape(3, bad)
            self.assertEqual(refused.exception.key, key)
        for bad in ({"granular": {}}, linear(friction=-1.0), linear(tangential_stiffness=0.0)):
            with self.assertRaises(Refusal):
                PointContact(bad, [])


class Collision(unittest.TestCase):
    """A point with a moment of inertia meets a free body off its centre; the two sides of the ledger have to add up."""

    def play(self, law, shape, steps=4000, dt=2e-5):
        config = {"gravity": [0.0, 0.0], "body": [body(**shape)]}
        shapes = [Shape(0, config["body"][0])]
        motions, contact = [shapes[0].start], PointContact(law, shapes)
        ledger = BodyLedger(config, motions)
        ledger.publish(shapes[0].envelope(0, motions[0]))
        mass, inertia, x, y, vx, vy, turn = 0.5, 2e-5, -0.15, 0.03, 3.0, 1.0, 5.0
        touched, books = 0, []
        start = (0.5 * (mass * (vx * vx + vy * vy) + inertia * turn * turn), mass * vx, mass * vy)
        angular = []
        for n in range(steps):
            step = Step(n, n * dt, dt if n else 0.0, dt, True)
            points = [Point(7, 0.01, mass, 0, 0, x, y, vx, vy, turn)]
            forces = ledger.forces(points)
            contact.evaluate(step, points, motions, forces)
            contact.commit()
            (fx, fy, couple, *_), load, m = forces.on_points[0], forces.on_bodies[0], motions[0]
            touched += (fx, fy) != (0.0, 0.0)
            wx, wy = vx + fx / mass * step.kick, vy + fy / mass * step.kick
            now, w = turn + couple / inertia * step.kick, step.centring
            kinetic = [0.5 * (mass * (u * u + v * v) + inertia * s * s) for u, v, s in ((vx, vy, turn), (wx, wy, now))]
            square = (1.0 - w) * kinetic[0] + w * kinetic[1]
            vx, vy, turn, x, y = wx, wy, now, x + wx * dt, y + wy * dt
            bx, by = m.vx + load.fx / m.mass * step.kick, m.vy + load.fy / m.mass * step.kick
            spin = m.spin + load.torque / m.inertia * step.kick
            motions = [m._replace(x=m.x + bx * dt, y=m.y + by * dt, angle=m.angle + spin * dt, vx=bx, vy=by, spin=spin)]
            ledger.moved(step, motions, forces)
            books.append((square, mass * vx, mass * vy, ledger.measured[0]))
            m = motions[0]
            of_body = m.mass * (m.x * m.vy - m.y * m.vx) + m.inertia * m.spin
            angular.append(mass * (x * vy - y * vx) + inertia * turn + of_body)
        self.assertGreater(touched, 50)
        self.assertLess(touched, steps - 1000)
        worst = max(
            abs(k + b.kinetic + b.kinetic_rotation + b.contact + b.friction_work + b.viscous_work - start[0])
            for k, _, _, b in books
        )
        self.assertLess(max(angular) - min(angular), 1e-13)
        for _, px, py, b in books:
            self.assertAlmostEqual(px + b.momentum[0], start[1], delta=1e-13)
            self.assertAlmostEqual(py + b.momentum[1], start[2], delta=1e-13)
        return worst / start[0], books[-1][3]

    def test_energies_and_momenta_add_up(self):
        polygon = {"shape": {"rectangle": {"width": 0.1, "height": 0.3}}, "sphero_radius": 0.02}
        for shape in ({}, polygon):
            for law, loses in (
                (linear(friction=0.0), ()), (linear(), ("friction_work",)),
                (linear(damping_ratio=0.2), ("friction_work", "viscous_work")),
                (linear(friction=0.0, damping_ratio=0.2, damped_mass=1.0), ("viscous_work",)),
            ):
                with self.subTest(shape=shape, law=law):
                    worst, end = self.play(law, shape)
                    self.assertLess(worst, 2e-4)
                    for name in ("friction_work", "viscous_work"):
                        self.assertEqual(getattr(end, name) > 1e-4, name in loses, name)
                    self.assertEqual(end.contact, 0.0)

    def test_a_shorter_step_balances_better(self):
        coarse, fine = (self.play(linear(damping_ratio=0.2), {}, n, dt)[0] for n, dt in ((4000, 2e-5), (16000, 5e-6)))
        self.assertLess(fine, 0.3 * coarse)

    def test_what_holds_a_body_takes_up_what_the_points_give_it(self):
        config = {"gravity": [0.0, -9.81], "body": [body(motion="fixed")]}
        shape = Shape(0, config["body"][0])
        ledger = BodyLedger(config, [shape.start])
        forces = ledger.forces([Point(0, 0.01, 1.0, 0, 0, -0.1, 0.0, 0.0, 0.0, 0.0)])
        forces.add(0, 0, (-0.1, 0.0), (-300.0, 0.0), 1e4)
        ledger.moved(Step(0, 0.0, 1e-3, 1e-3, True), [shape.start], forces)
        end = ledger.measured[0]
        self.assertEqual(end.kinetic, 0.0)
        self.assertEqual(list(end.applied_impulse), [-part for part in end.contact_impulse])
        self.assertGreater(end.contact_impulse[0], 0.1)
        self.assertEqual(ledger.travel(), 0.0)


class Bounds(unittest.TestCase):
    def test_without_a_normal_the_bound_is_one_for_any(self):
        random.seed(1)
        ledger = BodyLedger({"gravity": [0, 0], "body": [body()]}, [Shape(0, body()).start])
        for _ in range(100):
            turn = random.uniform(0.0, 2.0 * math.pi)
            known, unknown = ledger.forces([None]), ledger.forces([None])
            at = (random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1))
            known.add(0, 0, at, (0.0, 0.0), 1e4, (math.cos(turn), math.sin(turn)))
            unknown.add(0, 0, at, (0.0, 0.0), 1e4)
            self.assertLessEqual(known.on_bodies[0].rate, unknown.on_bodies[0].rate)
        self.assertEqual(known.on_points, [[0.0, 0.0, 0.0, 1e4, 0.0]])
        self.assertEqual(known.on_bodies[0].contacts, 0)

    def test_speed_and_travel_are_those_of_the_surface(self):
        spinning = body(spin=3.0, velocity=[4.0, 0.0])
        shape = Shape(0, spinning)
        ledger = BodyLedger({"gravity": [0, 0], "body": [spinning]}, [shape.start])
        ledger.publish(shape.envelope(0, shape.start))
        limits = ledger.limits(Limits(), ledger.forces([]))
        self.assertAlmostEqual(limits.speed, 4.0 + 3.0 * 0.1)
        moved = shape.start._replace(x=0.3, y=0.4, angle=-1.0)
        ledger.moved(Step(0, 0.0, 0.0, 0.1, False), [moved], ledger.forces([]))
        self.assertAlmostEqual(ledger.travel(), 0.5 + 0.1)


if __name__ == "__main__":
    unittest.main()

"""NAME: a bodies' side for Tandem.

    tandem run SCENES/jiang2020/collision_hard.toml --dem "python3 NAME/solver.py"
    tandem conformance --require held --dem "python3 NAME/solver.py"

Bodies are rigid, free or fixed; they touch material points, not one another. Replace what your own code does better. The
guide is docs/solver-authors.md in Tandem's tree.
"""

import sys

sys.path.append("TREE/python")  # where tandem_solver is, unless it is installed

from tandem_solver import Motion, PointContact, Readiness, Refusal, Shape, serve_dem  # noqa: E402


class Solver:
    identity = "NAME 0.1"
    # What it takes. Tandem refuses a scene that needs more, and the kit judges it by these.
    capabilities = (
        "save", "shape:disc", "shape:segment", "shape:rectangle", "motion:free", "motion:fixed", "law:linear",
        "feature:friction", "feature:damping", "feature:damped_mass",
    )

    def configure(self, config):
        if config["body_contact"] is not None or config["contact_pair"]:
            raise Refusal("body_contact", "bodies do not touch one another here: null, and no contact_pair")
        self.gravity = config["gravity"]
        self.free = [body["motion"] == "free" for body in config["body"]]
        self.shapes = [Shape(i, body) for i, body in enumerate(config["body"])]
        self.motions = [shape.start for shape in self.shapes]
        self.springs = PointContact(config["contact"], self.shapes)
        lightest = min((m.mass for m, free in zip(self.motions, self.free) if free), default=0.0)
        return Readiness(items=len(self.shapes), mass_min=lightest, stiffness_max=self.springs.k_n)

    def bodies(self):
        return self.motions

    def envelopes(self):
        bodies = enumerate(zip(self.shapes, self.motions))
        return [vertex for i, (shape, motion) in bodies for vertex in shape.envelope(i, motion)]

    def contact(self, step, points, forces):
        """The forces at t_n. Nothing may change yet."""
        self.springs.evaluate(step, points, self.motions, forces)
        self.loads = forces.on_bodies

    def advance(self, step):
        """The leapfrog: a kick of half the step before and half of this one, then the drift to t_{n+1}."""
        self.springs.commit()
        for i, (m, load) in enumerate(zip(self.motions, self.loads)):
            if self.free[i]:
                vx = m.vx + (load.fx / m.mass + self.gravity[0]) * step.kick
                vy = m.vy + (load.fy / m.mass + self.gravity[1]) * step.kick
                spin = m.spin + load.torque / m.inertia * step.kick
                x, y, angle = m.x + vx * step.dt, m.y + vy * step.dt, m.angle + spin * step.dt
                self.motions[i] = Motion(x, y, angle, vx, vy, spin, m.mass, m.inertia)

    def save(self):
        return {"motions": self.motions, "springs": self.springs.save()}

    def restore(self, state):
        if len(state["motions"]) != len(self.motions):
            raise Refusal("restore", f"a state of {len(state['motions'])} bodies, here are {len(self.motions)}")
        self.motions = [Motion(*motion) for motion in state["motions"]]
        self.springs.restore(state["springs"])


if __name__ == "__main__":
    sys.exit(serve_dem(Solver()))

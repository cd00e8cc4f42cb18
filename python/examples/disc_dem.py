"""Rigid discs against the material points: a bodies' side for Tandem in one file.

    tandem run scenes/jiang2020/collision_hard.toml --dem "python3 python/examples/disc_dem.py"

It has bodies, free or fixed, and moves them; contact with points is `tandem_solver.contact`. Discs do not touch one another;
anything else is refused.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # runs without having been installed

from tandem_solver import Motion, PointContact, Readiness, Refusal, Shape, serve_dem  # noqa: E402


class Disc:
    """Position at t_n, velocity at t_{n-1/2}."""

    def __init__(self, index, config):
        if config["shape"] != "disc" or config["motion"] not in ("free", "fixed"):
            raise Refusal(f"dem.body.{index}", "only the shape `disc` and the motions `free` and `fixed` are known here")
        self.shape, self.free = Shape(index, config), config["motion"] == "free"
        self.motion = self.shape.start

    def advance(self, step, load, gravity):
        """The leapfrog of T-1: a kick of half the step before and half of this one, then the drift."""
        m = self.motion
        if self.free:
            vx = m.vx + (load.fx / m.mass + gravity[0]) * step.kick
            vy = m.vy + (load.fy / m.mass + gravity[1]) * step.kick
            spin = m.spin + load.torque / m.inertia * step.kick
            place = (m.x + vx * step.dt, m.y + vy * step.dt, m.angle + spin * step.dt)
            self.motion = Motion(*place, vx, vy, spin, m.mass, m.inertia)


class Discs:
    identity = "disc_dem 0.2"
    capabilities = ("save", "shape:disc", "motion:free", "motion:fixed", "law:linear", "feature:friction")

    def configure(self, config):
        if config["body_contact"] is not None or config["contact_pair"]:
            raise Refusal("body_contact", "bodies do not touch one another here: null, and no contact_pair")
        self.gravity = config["gravity"]
        self.discs = [Disc(i, body) for i, body in enumerate(config["body"])]
        self.springs = PointContact(config["contact"], [disc.shape for disc in self.discs])
        if self.springs.damping != 0.0:
            raise Refusal("contact.linear.damping_ratio", "there are no dashpots here: 0 is accepted")
        lightest = min((disc.motion.mass for disc in self.discs if disc.free), default=0.0)
        return Readiness(items=len(self.discs), mass_min=lightest, stiffness_max=self.springs.k_n)

    def bodies(self):
        return [disc.motion for disc in self.discs]

    def envelopes(self):
        return [row for i, disc in enumerate(self.discs) for row in disc.shape.envelope(i, disc.motion)]

    def contact(self, step, points, forces):
        self.springs.evaluate(step, points, self.bodies(), forces)
        self.loads = forces.on_bodies

    def advance(self, step):
        self.springs.commit()
        for disc, load in zip(self.discs, self.loads):
            disc.advance(step, load, self.gravity)

    def save(self):
        """What the next step reads before it writes it; the rest is of the configuration or of one step."""
        return {"bodies": self.bodies(), "springs": self.springs.save()}

    def restore(self, state):
        if len(state["bodies"]) != len(self.discs):
            raise Refusal("restore", f"a state of {len(state['bodies'])} discs, here are {len(self.discs)}")
        for disc, motion in zip(self.discs, state["bodies"]):
            disc.motion = Motion(*motion)
        self.springs.restore(state["springs"])


if __name__ == "__main__":
    sys.exit(serve_dem(Discs()))

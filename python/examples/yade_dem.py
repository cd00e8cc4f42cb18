"""YADE as the bodies' side: a third-party DEM in the place of the built-in one.

    apt-get install --no-install-recommends yade
    tandem run scenes/verification/tumble.toml --dem "/usr/bin/python3 python/examples/yade_dem.py"
    tandem run scenes/verification/tumble.toml --dem "yade -n -x python/examples/yade_dem.py"

YADE finds the contacts, keeps their tangential springs and makes the forces; YADE moves the bodies, with the velocities
that `Body.kick` sets. A body is a clump of grid connections (a polygon's edges, swept by its sphero-radius) or a sphere (a disc); a point is a sphere that
is put where the continuum says. What is here: words between the two, and the bounds that YADE does not know. Where the
results differ from those of the built-in solver, and why, stands in docs/other-solvers.md.
"""

import math
import os
import sys
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"  # sums of several threads come in any order (clause T-6)
# Debian's YADE keeps its modules here; `yade -x` knows. The package need not have been installed either; to `yade -x`
# `__file__` is YADE's own.
sys.path += ["/usr/lib/x86_64-linux-gnu/yade-double/py", str(Path(sys.argv[0]).resolve().parent.parent)]

from tandem_solver import Fault, Motion, PointContact, Readiness, Refusal, Shape, serve_dem  # noqa: E402

# Bits of YADE's masks: two bodies meet if they share one, unless they share one that avoids itself.
MEET, POINT, SURFACE = 1, 2, 4
# Where spheres wait that stand for no point, in m from the plane.
APART = 1e6


def load():
    """YADE takes a second or more to load: after Hello, for which the coupler waits less long than for Ready (S-11)."""
    global yade, O
    import yade
    import yade.gridpfacet
    import yade.utils

    O = yade.O  # noqa: E741


class Body:
    """One body: its YADE id, and what the driver is told of it. Velocities are those of YADE, at t_{n-1/2}."""

    def __init__(self, index, config, material):
        if config["motion"] not in ("free", "fixed"):
            raise Refusal(f"dem.body.{index}.motion", "only `free` and `fixed` are known here")
        if not config["sphero_radius"] > 0.0:
            raise Refusal(f"dem.body.{index}.sphero_radius", "YADE's grid connections need one above 0")
        self.shape, self.free = Shape(index, config), config["motion"] == "free"
        self.motion = start = self.shape.start
        corners, connect = [(x, y, 0.0) for x, y in self.shape.placed(start)], yade.gridpfacet.gridConnection
        if len(corners) == 1:
            sphere = yade.utils.sphere(corners[0], self.shape.radius, material=material, mask=MEET | SURFACE)
            self.id = O.bodies.append(sphere)
            self.parts = {self.id: 1.0}
        else:
            a, n = self.shape.radius, len(corners)
            nodes = [O.bodies.append(yade.gridpfacet.gridNode(c, a, material=material)) for c in corners]
            self.parts = {}
            for i, j in [(i, (i + 1) % n) for i in range(n if n > 2 else 1)]:
                edge = O.bodies.append(connect(nodes[i], nodes[j], a, material=material))
                # To YADE it turns as fast as it does times the square of its length in m.
                self.parts[edge] = math.dist(corners[i], corners[j]) ** 2
            O.interactions.clear()  # the beams between the nodes: a clump is rigid
            # YADE puts a clump where the masses of its parts have their centre, and turns it about that place.
            for part in [*nodes, *self.parts]:
                O.bodies[part].state.mass = 0.0
            middle = yade.utils.sphere((start.x, start.y, 0.0), a, material=material, mask=0)
            self.id = O.bodies.clump([*nodes, *self.parts, O.bodies.append(middle)])
            O.bodies[self.id].aspherical = False  # in the plane a spin is a number
            for part in self.parts:
                O.bodies[part].mask = MEET | SURFACE
        state = self.state
        state.pos, state.mass, state.inertia = (start.x, start.y, 0.0), start.mass, (start.inertia,) * 3
        state.blockedDOFs = "zXY" if self.free else "xyzXYZ"
        self.first_turn = state.ori  # a clump's own axes are its principal ones

    @property
    def state(self):
        return O.bodies[self.id].state

    def kick(self, kick, load, gravity):
        """Gives YADE the velocity of T-1: with the forces that both sides have been told. YADE's own kick gave others."""
        m = self.motion
        rates = (load.fx / m.mass + gravity[0], load.fy / m.mass + gravity[1], load.torque / m.inertia)
        vx, vy, spin = (v + rate * kick for v, rate in zip(m[3:6], rates))
        self.state.vel, self.state.angVel = (vx, vy, 0.0), (0.0, 0.0, spin)
        self.motion = m._replace(vx=vx, vy=vy, spin=spin)

    def moved(self, dt):
        """Where YADE has moved it."""
        (x, y, _), (vx, vy, _), spin = self.state.pos, self.state.vel, self.state.angVel[2]
        turned = self.state.ori * self.first_turn.conjugate()
        angle = self.shape.start.angle + 2.0 * math.atan2(turned[2], turned[3])
        about = self.motion.angle + spin * dt  # which turn it is in
        angle += 2.0 * math.pi * round((about - angle) / (2.0 * math.pi))
        self.motion = self.motion._replace(x=x, y=y, angle=angle, vx=vx, vy=vy, spin=spin)


class Yade:
    identity = "yade_dem 0.1"
    capabilities = ("shape:disc", "shape:segment", "shape:rectangle", "shape:polygon", "motion:free", "motion:fixed")
    capabilities += ("law:linear", "feature:friction", "feature:own_friction", "feature:no_inside")

    def configure(self, config):
        law = config["contact"].get("linear", {})
        if law.get("damping_ratio", 0.0) != 0.0:
            message = "YADE has no viscous law for grid connections: 0 is accepted"
            raise Refusal("contact.linear.damping_ratio", message)
        if config["body_contact"] is not None or config["contact_pair"]:
            message = "bodies do not touch one another here (YADE's grid connections meet as cylinders): null, no pairs"
            raise Refusal("body_contact", message)
        self.gravity = config["gravity"]
        load()
        self.material = O.materials.append(yade.FrictMat())
        self.all = [Body(i, body, self.material) for i, body in enumerate(config["body"])]
        self.owner = {part: i for i, body in enumerate(self.all) for part in body.parts}
        # What YADE does not tell: who is in reach, the bounds, and the way along which friction did work.
        self.bounds = PointContact(config["contact"], [body.shape for body in self.all])
        self.k_n, self.k_t = self.bounds.k_n, self.bounds.k_t
        self.build_engines()
        self.ids, self.spheres, self.spare = None, {}, []
        lightest = min((b.motion.mass for b in self.all if b.free), default=0.0)
        notes = ["one thread"]
        if self.k_t > 0.0:
            notes += ["sliding is scaled by 1/(1 - overlap/(a + r_p))"]
        return Readiness(items=len(self.all), mass_min=lightest, stiffness_max=self.k_n, notes=notes)

    def bodies(self):
        return [body.motion for body in self.all]

    def build_engines(self):
        def always(value):
            return yade.MatchMaker(algo="val", val=value)

        # Without a bound on friction, which comes after what YADE forgets (`slide`).
        physics = yade.Ip2_FrictMat_FrictMat_FrictPhys(
            kn=always(self.k_n), ks=always(self.k_t), frictAngle=always(0.5 * math.pi)
        )
        geometry = [yade.Ig2_Sphere_GridConnection_ScGridCoGeom(), yade.Ig2_Sphere_Sphere_ScGeom()]
        laws = [yade.Law2_ScGridCoGeom_FrictPhys_CundallStrack(), yade.Law2_ScGeom_FrictPhys_CundallStrack()]
        collider = yade.InsertionSortCollider([yade.Bo1_Sphere_Aabb(), yade.Bo1_GridConnection_Aabb()], verletDist=0.0)
        collider.avoidSelfInteractionMask = POINT | SURFACE
        # Without forces: `Body.kick` has set the velocities.
        self.newton = yade.NewtonIntegrator(damping=0.0, exactAsphericalRot=False)
        self.finding = [collider, yade.InteractionLoop(geometry, [physics], laws)]
        O.engines = [yade.ForceResetter(), *self.finding, self.newton]

    def run(self, dt, moving):
        """One step of YADE: either it finds the forces, of the interval `dt` behind, or it moves the bodies by `dt`."""
        for engine in self.finding:
            engine.dead = moving
        self.newton.dead = not moving
        O.dt = dt
        O.step()

    def envelopes(self):
        return [row for i, body in enumerate(self.all) for row in body.shape.envelope(i, body.motion)]

    def take_set(self, points):
        """A sphere for each point of the set. One that leaves has left all contacts (clause I-10)."""
        self.ids = [point.id for point in points]
        for point in set(self.spheres).difference(self.ids):
            sphere = self.spheres.pop(point)
            for contact in list(O.bodies[sphere].intrs()):
                O.interactions.erase(contact.id1, contact.id2)
            # Out of the plane, and never erased: YADE's other ids stay what they are.
            O.bodies[sphere].state.pos = (0.0, 0.0, APART)
            self.spare.append(sphere)
        for point in points:
            if point.id not in self.spheres:
                if not self.spare:
                    place, mask = (0, 0, APART), MEET | POINT
                    sphere = yade.utils.sphere(place, point.radius, material=self.material, dynamic=False, mask=mask)
                    self.spare.append(O.bodies.append(sphere))
                self.spheres[point.id] = self.spare.pop()
            O.bodies[self.spheres[point.id]].shape.radius = point.radius
        self.slots = {self.spheres[point.id]: slot for slot, point in enumerate(points)}

    def contact(self, step, points, forces):
        """Forces at t_n, made by YADE of the positions that it is given here."""
        if [point.id for point in points] != self.ids:
            self.take_set(points)
        for point in points:
            vx, vy = point.vx, point.vy
            was = self.bounds.past[1].get(point.id)
            if was is not None and step.dt_before > 0.0:
                # The velocity over the interval behind: what the surfaces really did (section 7).
                vx, vy = (point.x - was[0]) / step.dt_before, (point.y - was[1]) / step.dt_before
            sphere = O.bodies[self.spheres[point.id]].state
            sphere.pos, sphere.vel, sphere.angVel = (point.x, point.y, 0.0), (vx, vy, 0.0), (0.0, 0.0, point.spin)
        self.run(step.dt_before, moving=False)
        for slot, body, overlap, normal, at in self.bounds.contacts(points, self.bodies()):
            shape, point = self.all[body].shape, points[slot]
            if overlap >= shape.radius + point.radius:
                raise Fault(f"point {point.id} is inside of body {body} ({shape.name}): YADE would pull it through")
            forces.add(slot, body, at, (0.0, 0.0), self.k_n, normal, self.k_t)
        history = dict(self.pressing(step, points, forces))
        for key, (_, _, stored) in self.bounds.past[0].items():
            forces.slid += stored if key not in history else 0.0  # was left in the spring of a contact that has opened
        self.bounds.remember(points, self.bodies(), history)
        self.loads = forces.on_bodies

    def pressing(self, step, points, forces):
        """Adds the contacts that YADE has found; for each the force of its tangential spring, and the energy in it."""
        for contact in O.interactions:
            if not contact.isReal:
                continue
            of_point = contact.id1 in self.slots
            sphere, part = (contact.id1, contact.id2) if of_point else (contact.id2, contact.id1)
            slot, index = self.slots[sphere], self.owner[part]
            body, overlap, point, physics = self.all[index], contact.geom.penetrationDepth, points[slot], contact.phys
            if isinstance(contact.geom, yade.ScGridCoGeom) and contact.geom.isDuplicate and contact.geom.trueInt != part:
                continue  # YADE has handed it on to the next edge, and will forget it here in the next step
            # YADE's normal points from the first to the second; its forces act on the second.
            sign, at = -1.0 if of_point else 1.0, contact.geom.contactPoint
            forgotten = sign * body.motion.spin * body.shape.radius * (1.0 - body.parts[part])
            self.slide(contact, step.dt_before * forgotten, point.id in self.bounds.past[1])
            push, rub = ((sign * f[0], sign * f[1]) for f in (physics.normalForce, physics.shearForce))
            stored = 0.0
            if self.k_t > 0.0:
                # A real displacement u stretches YADE's spring by u times this.
                scale = 1.0 / (1.0 - overlap / (body.shape.radius + point.radius))
                stored = 0.5 * (rub[0] ** 2 + rub[1] ** 2) / (self.k_t * scale)
                before_x, before_y, was = self.bounds.past[0].get((point.id, index), (0.0, 0.0, 0.0))
                ux, uy = self.bounds.slid(step, point, index, body.motion, at)
                forces.slid -= 0.5 * ((rub[0] + before_x) * ux + (rub[1] + before_y) * uy) + stored - was
                yield (point.id, index), (*rub, stored)
            energy = 0.5 * self.k_n * overlap**2 + stored
            forces.add(slot, index, at, (push[0] + rub[0], push[1] + rub[1]), 0.0, stored=energy)

    def slide(self, contact, forgotten, known):
        """Gives the tangential spring the way (m) of the body's surface that YADE has `forgotten`, and bounds it. A point that was
        not `known` one step before has not slid."""
        nx, ny, _ = contact.geom.normal
        x, y, _ = contact.phys.shearForce
        x, y = x + self.k_t * forgotten * ny, y - self.k_t * forgotten * nx
        size, most = math.hypot(x, y), self.bounds.mu * contact.phys.normalForce.norm() if known else 0.0
        scale = most / size if size > most else 1.0
        contact.phys.shearForce = (scale * x, scale * y, 0.0)

    def advance(self, step):
        self.bounds.commit()
        free = [(body, load) for body, load in zip(self.all, self.loads) if body.free]
        for body, load in free:
            body.kick(step.kick, load, self.gravity)
        if step.dt > 0.0:
            self.run(step.dt, moving=True)
            for body, _ in free:
                body.moved(step.dt)


if __name__ == "__main__":
    if len(sys.argv) == 1:
        load()  # by hand: tells what is missing
    status = serve_dem(Yade())
    sys.stdout.flush()
    os._exit(status)  # YADE's own threads and servers have no part in the end of the session

"""YADE as the bodies' side: a third-party DEM in the place of the built-in one.

    apt-get install --no-install-recommends yade
    tandem run scenes/verification/tumble.toml --dem "/usr/bin/python3 python/examples/yade_dem.py"
    tandem run scenes/verification/tumble.toml --dem "yade -n -x python/examples/yade_dem.py"

YADE finds the contacts, keeps their tangential springs and makes the forces; YADE integrates the bodies. A body is a
clump of grid connections (a polygon's edges, swept by its sphero-radius) or a sphere (a disc); a point is a sphere that
is put where the continuum says. What is here: words between the two, and the bounds that YADE does not know. Where the
results differ from those of the built-in solver, and why, stands in docs/solver-authors.md.
"""

import math
import os
import sys
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"  # sums of several threads come in any order (clause T-6)
# Debian's YADE keeps its modules here; `yade -x` knows. The package need not have been installed either; to `yade -x`
# `__file__` is YADE's own.
sys.path += ["/usr/lib/x86_64-linux-gnu/yade-double/py", str(Path(sys.argv[0]).resolve().parent.parent)]

import numpy as np  # noqa: E402
from tandem_solver import BODY, DEM, LINEAR, Answer, BodyState, Fault, Ledger, Limits, Measurement  # noqa: E402
from tandem_solver import NotFinite, Readiness, Refusal, check_fields, serve_dem  # noqa: E402

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


def swept(vertices, a):
    """Area, centroid and polar second moment about the origin of a convex outline swept by a disc of radius `a`."""
    if len(vertices) == 1:
        x, y = vertices[0]
        area = math.pi * a**2
        return area, (x, y), area * (0.5 * a**2 + x * x + y * y)
    parts, n = [], len(vertices)  # (area, centroid, polar moment about the centroid)
    normals = []
    for i in range(n):
        (x0, y0), (x1, y1) = vertices[i], vertices[(i + 1) % n]
        cross, length = x0 * y1 - x1 * y0, math.hypot(x1 - x0, y1 - y0)
        nx, ny = (y1 - y0) / length, (x0 - x1) / length
        normals.append((nx, ny))
        # The triangle with the origin, signed, and the strip along the edge.
        if cross != 0.0:
            cx, cy = (x0 + x1) / 3.0, (y0 + y1) / 3.0
            polar = cross / 12.0 * (x0 * x0 + x0 * x1 + x1 * x1 + y0 * y0 + y0 * y1 + y1 * y1)
            parts.append((0.5 * cross, (cx, cy), polar - 0.5 * cross * (cx * cx + cy * cy)))
        middle = (0.5 * (x0 + x1) + 0.5 * a * nx, 0.5 * (y0 + y1) + 0.5 * a * ny)
        parts.append((length * a, middle, length * a * (length**2 + a**2) / 12.0))
    for i in range(n):
        # The sector of the corner between the edges i - 1 and i.
        (ax, ay), (bx, by) = normals[i - 1], normals[i]
        half = 0.5 * (math.atan2(ax * by - ay * bx, ax * bx + ay * by) % (2.0 * math.pi))
        area, out = half * a**2, 2.0 * a * math.sin(half) / (3.0 * half)
        angle = math.atan2(ay, ax) + half
        centre = (vertices[i][0] + out * math.cos(angle), vertices[i][1] + out * math.sin(angle))
        parts.append((area, centre, area * (0.5 * a**2 - out**2)))
    area = sum(p[0] for p in parts)
    centroid = tuple(sum(p[0] * p[1][k] for p in parts) / area for k in range(2))
    return area, centroid, sum(p[2] + p[0] * (p[1][0] ** 2 + p[1][1] ** 2) for p in parts)


class Body:
    """One body: its YADE id, and what Tandem is told of it. Velocities are those of YADE, at t_{n-1/2}."""

    def __init__(self, index, config, material):
        key = f"dem.body.{index}"
        check_fields(key, config, BODY)
        self.name, self.a, motion = config["name"], config["sphero_radius"], config["motion"]
        if motion not in ("free", "fixed"):
            raise Refusal(f"{key}.motion", "only `free` and `fixed` are known here")
        if not self.a > 0.0:
            raise Refusal(f"{key}.sphero_radius", "YADE's grid connections need one above 0")
        self.free = motion == "free"
        outline = self.outline(f"{key}.shape", config["shape"])
        area, (cx, cy), polar = swept(outline, self.a)
        self.mass = config["inertia"].get("mass", config["inertia"].get("density", 0.0) * area)
        self.inertia = self.mass * (polar / area - cx * cx - cy * cy)
        if not (0.0 < self.mass < math.inf):
            raise Refusal(f"{key}.inertia", f"a mass of {self.mass} kg/m is not positive and finite")
        self.w, self.wi = (1.0 / self.mass, 1.0 / self.inertia) if self.free else (0.0, 0.0)
        cos, sin = math.cos(config["angle"]), math.sin(config["angle"])
        x, y = config["position"]
        # Arms from the centre of mass at the initial angle; YADE turns them.
        arms = [(px - cx, py - cy) for px, py in outline]
        self.arms = np.array([(cos * px - sin * py, sin * px + cos * py) for px, py in arms])
        self.extent = float(np.hypot(*self.arms.T).max()) + self.a
        self.angle = self.first_angle = config["angle"]
        centre = (x + cos * cx - sin * cy, y + sin * cx + cos * cy)
        self.build(centre, material)
        state = self.state
        state.mass, state.inertia = self.mass, (self.inertia, self.inertia, self.inertia)
        state.blockedDOFs = "zXY" if self.free else "xyzXYZ"
        self.first_turn = state.ori  # a clump's own axes are its principal ones
        if self.free:
            state.vel, state.angVel = (*config["velocity"], 0.0), (0.0, 0.0, config["spin"])
        self.load = np.zeros(3)  # force and torque of the points at t_n
        self.moved = (0.0, 0.0, 0.0)  # shift and turn over the last step
        self.published = (*centre, self.angle)

    @staticmethod
    def outline(key, shape):
        """Vertices, counter-clockwise."""
        if shape == "disc":
            return [(0.0, 0.0)]
        if "segment" in shape:
            return shape["segment"]["ends"]
        if "rectangle" in shape:
            w, h = 0.5 * shape["rectangle"]["width"], 0.5 * shape["rectangle"]["height"]
            return [(-w, -h), (w, -h), (w, h), (-w, h)]
        if "polygon" not in shape:
            raise Refusal(key, "only `disc`, `segment`, `rectangle` and convex `polygon` are known here")
        vertices = shape["polygon"]["vertices"]
        around = list(zip(vertices, vertices[1:] + vertices[:1], vertices[2:] + vertices[:2]))
        turns = [(b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) for a, b, c in around]
        if min(turns) < 0.0 < max(turns):
            raise Refusal(key, "a polygon with a notch: only convex ones are known here")
        return vertices if max(turns) > 0.0 else vertices[::-1]

    def build(self, centre, material):
        corners = [(centre[0] + x, centre[1] + y, 0.0) for x, y in self.arms]
        if len(corners) == 1:
            self.id = O.bodies.append(yade.utils.sphere(corners[0], self.a, material=material, mask=MEET | SURFACE))
            self.parts = [self.id]
        else:
            nodes = [O.bodies.append(yade.gridpfacet.gridNode(c, self.a, material=material)) for c in corners]
            edges = range(len(nodes) if len(nodes) > 2 else 1)
            pairs = [(nodes[i], nodes[(i + 1) % len(nodes)]) for i in edges]
            connect = yade.gridpfacet.gridConnection
            self.parts = [O.bodies.append(connect(i, j, self.a, material=material)) for i, j in pairs]
            O.interactions.clear()  # the beams between the nodes: a clump is rigid
            self.id = O.bodies.clump(nodes + self.parts)
            O.bodies[self.id].aspherical = False  # in the plane a spin is a number
            for part in self.parts:
                O.bodies[part].mask = MEET | SURFACE
        self.state.pos = (*centre, 0.0)

    @property
    def state(self):
        return O.bodies[self.id].state

    def motion(self):
        """Velocity and spin as YADE has them."""
        velocity, spin = self.state.vel, self.state.angVel
        return np.array((velocity[0], velocity[1], spin[2]))

    def vertices(self):
        turn = self.angle - self.first_angle
        cos, sin = math.cos(turn), math.sin(turn)
        x, y, _ = self.state.pos
        return self.arms @ np.array([[cos, sin], [-sin, cos]]) + (x, y)

    def speed(self, motion):
        return math.hypot(motion[0], motion[1]) + abs(motion[2]) * self.extent

    def travelled(self):
        x, y, angle = self.published
        now = self.state.pos
        return math.hypot(now[0] - x, now[1] - y) + abs(self.angle - angle) * self.extent

    def nearest(self, points):
        """Distances of points from the unswept outline, and its nearest points."""
        corners = self.vertices()
        if len(corners) == 1:
            return np.hypot(*(points - corners[0]).T), np.broadcast_to(corners[0], points.shape)
        edges = np.roll(corners, -1, axis=0) - corners
        along = np.einsum("pek,ek->pe", points[:, None] - corners, edges) / (edges**2).sum(1)
        on = corners + np.clip(along, 0.0, 1.0)[..., None] * edges
        distance = np.hypot(*np.moveaxis(points[:, None] - on, 2, 0))
        best = distance.argmin(1)
        rows = np.arange(len(points))
        return distance[rows, best], on[rows, best]


class Yade:
    identity = "yade_dem 0.1"
    capabilities = ("shape:disc", "shape:segment", "shape:rectangle", "shape:polygon", "motion:free", "motion:fixed")
    capabilities += ("law:linear", "feature:friction")

    def configure(self, config):
        check_fields("dem", config, DEM)
        if "linear" not in config["contact"]:
            raise Refusal("contact", "only `linear` is known here")
        law = config["contact"]["linear"]
        check_fields("contact.linear", law, LINEAR)
        self.k_n, friction = law["normal_stiffness"], law["friction"]
        self.k_t = law["tangential_stiffness"] if friction > 0.0 else 0.0
        if law["damping_ratio"] != 0.0:
            message = "YADE has no viscous law for grid connections: 0 is accepted"
            raise Refusal("contact.linear.damping_ratio", message)
        if friction > 0.0 and self.k_t <= 0.0:
            raise Refusal("contact.linear.tangential_stiffness", "friction needs a positive one")
        if config["body_contact"] is not None or config["contact_pair"]:
            message = "bodies do not touch one another here (YADE's grid connections meet as cylinders): null, no pairs"
            raise Refusal("body_contact", message)
        self.gravity = np.array(config["gravity"])
        load()
        self.material = O.materials.append(yade.FrictMat())
        self.bodies = [Body(i, body, self.material) for i, body in enumerate(config["body"])]
        self.owner = {part: i for i, body in enumerate(self.bodies) for part in body.parts}
        self.build_engines(math.atan(friction))
        self.infos, self.spheres, self.spare, self.previous = [], {}, [], {}
        self.springs = {}  # (point, body) -> tangential force and the factor of its displacement, of the step before
        self.friction_work, self.applied, self.impulse = 0.0, np.zeros(2), np.zeros(2)
        lightest = min((b.mass for b in self.bodies if b.free), default=0.0)
        notes = ["one thread"]
        if self.k_t > 0.0:
            notes += ["sliding on an edge is without the body's turning times its sphero-radius"]
            notes += ["sliding is scaled by 1/(1 - overlap/(a + r_p))"]
        return Readiness(items=len(self.bodies), mass_min=lightest, stiffness_max=self.k_n, notes=notes)

    def build_engines(self, friction_angle):
        def always(value):
            return yade.MatchMaker(algo="val", val=value)

        physics = yade.Ip2_FrictMat_FrictMat_FrictPhys(
            kn=always(self.k_n), ks=always(self.k_t), frictAngle=always(friction_angle)
        )
        geometry = [yade.Ig2_Sphere_GridConnection_ScGridCoGeom(), yade.Ig2_Sphere_Sphere_ScGeom()]
        laws = [yade.Law2_ScGridCoGeom_FrictPhys_CundallStrack(), yade.Law2_ScGeom_FrictPhys_CundallStrack()]
        collider = yade.InsertionSortCollider([yade.Bo1_Sphere_Aabb(), yade.Bo1_GridConnection_Aabb()], verletDist=0.0)
        collider.avoidSelfInteractionMask = POINT | SURFACE
        gravity = (*self.gravity, 0.0)
        # The forces are of the step before, by intention: of `run(.., moving=False)`.
        self.newton = yade.NewtonIntegrator(
            damping=0.0, exactAsphericalRot=False, gravity=gravity, warnNoForceReset=False
        )
        self.finding = [yade.ForceResetter(), collider, yade.InteractionLoop(geometry, [physics], laws)]
        O.engines = [*self.finding, self.newton]

    def run(self, dt, moving):
        """One step of YADE: either it finds the forces, of the interval `dt` behind, or it moves the bodies by `dt`."""
        for engine in self.finding:
            engine.dead = moving
        self.newton.dead = not moving
        O.dt = dt
        O.step()

    def envelopes(self):
        for b in self.bodies:
            b.published = (b.state.pos[0], b.state.pos[1], b.angle)
        return [(i, float(x), float(y), b.a) for i, b in enumerate(self.bodies) for x, y in b.vertices()]

    def imp_set(self, infos):
        """A sphere for each point of the set. One that leaves has left all contacts (clause I-10)."""
        self.infos = infos
        ids = {info[0] for info in infos}
        for point in [point for point in self.spheres if point not in ids]:
            sphere = self.spheres.pop(point)
            for contact in list(O.bodies[sphere].intrs()):
                O.interactions.erase(contact.id1, contact.id2)
            # Out of the plane, and never erased: YADE's other ids stay what they are.
            O.bodies[sphere].state.pos = (0.0, 0.0, APART)
            self.spare.append(sphere)
        for point, radius, *_ in infos:
            if point not in self.spheres:
                if not self.spare:
                    mask = MEET | POINT
                    sphere = yade.utils.sphere((0, 0, APART), radius, material=self.material, dynamic=False, mask=mask)
                    self.spare.append(O.bodies.append(sphere))
                self.spheres[point] = self.spare.pop()
            body = O.bodies[self.spheres[point]]
            body.shape.radius = radius
        self.states = [O.bodies[self.spheres[info[0]]].state for info in infos]
        self.slots = {self.spheres[info[0]]: slot for slot, info in enumerate(infos)}
        self.radii = np.array([info[1] for info in infos])

    def contact(self, step, states):
        """Forces at t_n, made by YADE of the positions that it is given here."""
        for info, state, sphere in zip(self.infos, states, self.states if self.infos else ()):
            x, y, vx, vy = state
            was = self.previous.get(info[0])
            if was is not None and step.dt_before > 0.0:
                # The velocity over the interval behind: what the surfaces really did (section 7).
                vx, vy = (x - was[0]) / step.dt_before, (y - was[1]) / step.dt_before
            sphere.pos, sphere.vel = (x, y, 0.0), (vx, vy, 0.0)
        self.run(step.dt_before, moving=False)
        forces = self.collect(states)
        limits = self.bounds(states, forces)
        self.motions = [b.motion() for b in self.bodies]
        weight = [np.array((*self.gravity, 0.0)) if b.free else np.zeros(3) for b in self.bodies]
        self.rates = [b.load * (b.w, b.w, b.wi) + g for b, g in zip(self.bodies, weight)]
        self.kicked = [v + rate * step.kick for v, rate in zip(self.motions, self.rates)]
        for i, (b, v) in enumerate(zip(self.bodies, self.kicked)):
            if not np.isfinite(v).all():
                raise NotFinite("velocity", f"body {i} ({b.name})")
        if step.measure:
            self.measure(step)
        if not step.opening:
            self.springs, self.previous = self.sprung, {i[0]: s[:2] for i, s in zip(self.infos, states)}
            self.friction_work += self.loss
            self.applied, self.impulse = self.impulses(step)
        limits.speed = max((b.speed(v) for b, v in zip(self.bodies, self.kicked)), default=0.0)
        travelled = max((b.travelled() for b in self.bodies), default=0.0)
        return Answer([tuple(map(float, force)) for force in forces], limits, travelled + limits.speed * step.dt)

    def collect(self, states):
        """What YADE has found: forces on the points, loads of the bodies, energies."""
        forces = np.zeros((len(states), 3))
        self.energy, self.loss, self.sprung = 0.0, 0.0, {}
        self.pressing = [0] * len(self.bodies)
        for b in self.bodies:
            b.load = np.zeros(3)
        for contact in O.interactions:
            if not contact.isReal:
                continue
            of_point = contact.id1 in self.slots
            point, part = (contact.id1, contact.id2) if of_point else (contact.id2, contact.id1)
            slot, index = self.slots[point], self.owner[part]
            body, geometry, physics = self.bodies[index], contact.geom, contact.phys
            overlap = geometry.penetrationDepth
            if overlap > body.a + 0.5 * self.radii[slot]:
                point = self.infos[slot][0]
                raise Fault(f"point {point} is inside of body {index} ({body.name}): YADE would pull it through")
            # YADE's normal points from the first to the second; its forces act on the second.
            sign = -1.0 if of_point else 1.0
            push = sign * np.array(physics.normalForce)[:2]
            rub = sign * np.array(physics.shearForce)[:2]
            force = push + rub
            forces[slot, :2] += force
            centre, at = body.state.pos, geometry.contactPoint
            arm = (at[0] - centre[0], at[1] - centre[1])
            body.load -= (*force, arm[0] * force[1] - arm[1] * force[0])
            self.pressing[index] += 1
            self.energy += 0.5 * self.k_n * overlap**2
            if self.k_t > 0.0:
                # A real displacement u stretches YADE's spring by u times this.
                scale = 1.0 / (1.0 - overlap / (body.a + self.radii[slot]))
                stored = 0.5 * float(rub @ rub) / (self.k_t * scale)
                before, was = self.springs.get((point, index), (np.zeros(2), 0.0))
                self.loss -= 0.5 * float((rub + before) @ self.slid(slot, states, body, arm)) + stored - was
                self.energy += stored
                self.sprung[point, index] = (rub, stored)
        for key, (_, stored) in self.springs.items():
            if key not in self.sprung:
                self.loss += stored  # what was left in the spring of a contact that has opened
        return forces

    def slid(self, slot, states, body, arm):
        """What a point has moved over the last step less what the body's material at the contact point has: the way
        along which the forces did work, also where YADE's own displacement is another one."""
        was = self.previous.get(self.infos[slot][0])
        if was is None:
            return np.zeros(2)
        shift_x, shift_y, turn = body.moved
        sin, versine = math.sin(turn), 2.0 * math.sin(0.5 * turn) ** 2
        x = states[slot][0] - was[0] - (shift_x + versine * arm[0] - sin * arm[1])
        y = states[slot][1] - was[1] - (shift_y + sin * arm[0] + versine * arm[1])
        return np.array((x, y))

    def bounds(self, states, forces):
        """Stiffness of the points in reach (F-6) and the bodies' largest frequency (L-2), which YADE does not tell."""
        limits = Limits()
        if not states:
            return limits
        points = np.array(states)[:, :2]
        for b in self.bodies:
            distance, on = b.nearest(points)
            overlap = b.a + self.radii - distance
            near = np.flatnonzero(overlap > -0.5 * self.radii)
            forces[near, 2] += self.k_n
            normal = (points[near] - on[near]) / np.maximum(distance[near], 1e-300)[:, None]
            arm = on[near] + (b.a - 0.5 * overlap[near])[:, None] * normal - np.array(b.state.pos)[:2]
            r_n, r_t = np.cross(arm, normal), np.einsum("pk,pk->p", arm, normal)
            mobility = b.w + b.wi * r_n**2
            rate = self.k_n * mobility + self.k_t * (b.w + b.wi * r_t**2)
            limits.contact_omega_sq = max(limits.contact_omega_sq, float(rate.sum()))
            limits.mobility = max(limits.mobility, float(mobility.sum()))
        return limits

    def advance(self, step):
        if step.opening:
            return
        for b, v, rate, kicked in zip(self.bodies, self.motions, self.rates, self.kicked):
            if not b.free:
                continue
            # YADE kicks by its dt; where steps change, the kick is another one (clause T-1).
            ahead = v + rate * (step.kick - step.dt) if step.dt > 0.0 else kicked
            b.state.vel, b.state.angVel = (ahead[0], ahead[1], 0.0), (0.0, 0.0, ahead[2])
        if step.dt == 0.0:
            return
        places = [(b.state.pos, b.angle) for b in self.bodies]
        self.run(step.dt, moving=True)
        for b, (at, angle_before) in zip(self.bodies, places):
            if b.free:
                turned = b.state.ori * b.first_turn.conjugate()
                angle = b.first_angle + 2.0 * math.atan2(turned[2], turned[3])
                about = b.angle + b.state.angVel[2] * step.dt  # which turn it is in
                b.angle = angle + 2.0 * math.pi * round((about - angle) / (2.0 * math.pi))
                b.moved = (b.state.pos[0] - at[0], b.state.pos[1] - at[1], b.angle - angle_before)

    def impulses(self, step):
        """From outside, and of the points on all bodies, through this step's kick (section 9)."""
        total = sum((b.load[:2] for b in self.bodies), np.zeros(2))
        held = sum((b.load[:2] for b in self.bodies if not b.free), np.zeros(2))
        weight = sum(b.mass for b in self.bodies if b.free) * self.gravity
        return self.applied + step.kick * (weight - held), self.impulse + step.kick * total

    def measure(self, step):
        w = step.centring
        ledger, bodies = Ledger(contact=self.energy, friction_work=self.friction_work + self.loss), []
        ledger.applied_impulse[:], ledger.contact_impulse[:] = self.impulses(step)
        for b, before, after, pressing in zip(self.bodies, self.motions, self.kicked, self.pressing):
            x, y, _ = b.state.pos
            square = (1.0 - w) * before**2 + w * after**2
            if b.free:
                ledger.kinetic += 0.5 * b.mass * (square[0] + square[1])
                ledger.kinetic_rotation += 0.5 * b.inertia * square[2]
                ledger.gravity -= b.mass * float(self.gravity @ (x, y))
                ledger.momentum[0] += b.mass * after[0]
                ledger.momentum[1] += b.mass * after[1]
            ledger.contact_force[0] += b.load[0]
            ledger.contact_force[1] += b.load[1]
            ledger.contacts += pressing > 0
            mean = (1.0 - w) * before + w * after
            state = BodyState(position=(x, y), velocity=tuple(mean[:2]), angle=b.angle, spin=mean[2])
            state.mass, state.inertia = b.mass, b.inertia
            state.point_force, state.point_torque, state.contacts = tuple(b.load[:2]), b.load[2], pressing
            bodies.append(state)
        self.measured = Measurement(ledger, bodies)

    def measurement(self):
        return self.measured


if __name__ == "__main__":
    if len(sys.argv) == 1:
        load()  # by hand: tells what is missing
    status = serve_dem(Yade())
    sys.stdout.flush()
    os._exit(status)  # YADE's own threads and servers have no part in the end of the session

"""Contact of bodies with material points, for a solver that has bodies and nothing of this: their outlines by the
configuration (section 10), and the law `linear` of section 7 with friction, dashpots and the history of both."""

import math

from .config import LINEAR, check_fields
from .control import Refusal
from .ledger import Motion


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


def see(outline, x, y):
    """Signed distance of a point from a counter-clockwise outline, negative inside, and the unit normal of the contact."""
    n = len(outline)
    if n == 1:
        dx, dy = x - outline[0][0], y - outline[0][1]
        distance = math.hypot(dx, dy)
        return (distance, dx / distance, dy / distance) if distance > 0.0 else (0.0, 0.0, 1.0)
    best = None
    for i in range(n):
        (ax, ay), (bx, by) = outline[i], outline[(i + 1) % n]
        ex, ey = bx - ax, by - ay
        t = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)))
        dx, dy = x - ax - t * ex, y - ay - t * ey
        square = dx * dx + dy * dy
        if best is None or square < best[0]:
            best = (square, i, t, dx, dy)
    square, i, t, dx, dy = best
    (ax, ay), (bx, by) = outline[i], outline[(i + 1) % n]
    length, distance = math.hypot(bx - ax, by - ay), math.sqrt(square)
    nx, ny = (by - ay) / length, (ax - bx) / length
    if 0.0 < t < 1.0 or distance == 0.0:
        # From the line of the edge, so that it is exact near and on the outline.
        signed = (x - ax) * nx + (y - ay) * ny
        return (-signed, -nx, -ny) if n == 2 and signed < 0.0 else (signed, nx, ny)
    return distance, dx / distance, dy / distance  # a corner of a convex outline


class Shape:
    """The outline, mass and first motion of a body of the configuration; its frame lies at its centre of mass."""

    def __init__(self, index, config):
        key = f"dem.body.{index}"
        self.name, self.radius = config["name"], config["sphero_radius"]
        outline = self._vertices(f"{key}.shape", config["shape"])
        area, (cx, cy), polar = swept(outline, self.radius)
        inertia = config["inertia"]
        mass = inertia["mass"] if "mass" in inertia else inertia["density"] * area
        if not (self.radius >= 0.0 and 0.0 < mass < math.inf):
            raise Refusal(f"{key}.inertia", f"a mass of {mass} kg/m: expected a positive one, of an outline that has an area")
        self.outline = [(x - cx, y - cy) for x, y in outline]
        self.extent = max(math.hypot(x, y) for x, y in self.outline) + self.radius
        angle, (x, y) = config["angle"], config["position"]
        cos, sin = math.cos(angle), math.sin(angle)
        velocities = (*config["velocity"], config["spin"])
        if config["motion"] == "fixed" and any(velocities):
            raise Refusal(f"{key}.motion", "fixed, but velocity or spin is not zero")
        centre = (x + cos * cx - sin * cy, y + sin * cx + cos * cy)
        self.start = Motion(*centre, angle, *velocities, mass, mass * (polar / area - cx * cx - cy * cy))

    @staticmethod
    def _vertices(key, shape):
        """Counter-clockwise."""
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

    def placed(self, motion):
        """The vertices where a body is."""
        cos, sin = math.cos(motion.angle), math.sin(motion.angle)
        return [(motion.x + cos * x - sin * y, motion.y + sin * x + cos * y) for x, y in self.outline]

    def envelope(self, index, motion):
        """The records of `envelopes()` for the body of this index."""
        return [(index, x, y, self.radius) for x, y in self.placed(motion)]


class PointContact:
    """The contacts of all points with all bodies. History belongs to the ids of points, so it survives a new set (I-10)."""

    def __init__(self, law, shapes):
        if "linear" not in law:
            raise Refusal("contact", "only `linear` is known here")
        law = law["linear"]
        check_fields("contact.linear", law, LINEAR)
        if not all(0.0 <= value < math.inf for value in law.values()):
            raise Refusal("contact.linear", "expected finite numbers that are not negative")
        self.k_n, self.mu = law["normal_stiffness"], law["friction"]
        self.k_t = law["tangential_stiffness"] if self.mu > 0.0 else 0.0
        self.damping, self.damped_mass = law["damping_ratio"], law["damped_mass"]
        if self.mu > 0.0 and self.k_t <= 0.0:
            raise Refusal("contact.linear.tangential_stiffness", "friction needs a positive one")
        self.shapes = shapes
        # After the last step that was done: (point, body) -> elongation of its spring in m and forces of its dashpots in
        # N/m; where points and bodies were. And what all this is to be after the step that was last evaluated.
        self.past = self.next_past = ({}, {}, [])

    def contacts(self, points, motions):
        """(slot, body, overlap, normal, contact point) of all that are in reach (F-6)."""
        bodies = [(i, s, m, s.placed(m)) for i, (s, m) in enumerate(zip(self.shapes, motions))]
        for slot, point in enumerate(points):
            for i, shape, motion, outline in bodies:
                if math.hypot(point.x - motion.x, point.y - motion.y) - shape.extent >= 1.5 * point.radius:
                    continue
                distance, nx, ny = see(outline, point.x, point.y)
                overlap = shape.radius + point.radius - distance
                if overlap > -0.5 * point.radius:
                    arm = point.radius - 0.5 * overlap
                    yield slot, i, overlap, (nx, ny), (point.x - arm * nx, point.y - arm * ny)

    def fallen(self, point, body, motion, overlap):
        """By how much the overlap of a point with a body has fallen over the last step; only dashpots need it."""
        was = self.past[1].get(point.id)
        if was is None or self.damping == 0.0:
            return 0.0
        shape, before = self.shapes[body], Motion(*self.past[2][body], *motion[3:])
        return shape.radius + point.radius - see(shape.placed(before), *was)[0] - overlap

    def slid(self, step, point, body, motion, at):
        """What the surface of a point, which turns with its spin, has moved at the place `at` over the last step, less what
        the body's material has."""
        was = self.past[1].get(point.id)
        if was is None:
            return 0.0, 0.0
        before = self.past[2][body]
        turn, rx, ry = motion.angle - before[2], at[0] - motion.x, at[1] - motion.y
        sin, versine = math.sin(turn), 2.0 * math.sin(0.5 * turn) ** 2
        spun = point.spin * step.dt_before
        ux = point.x - was[0] - spun * (at[1] - point.y) - (motion.x - before[0] + versine * rx - sin * ry)
        return ux, point.y - was[1] + spun * (at[0] - point.x) - (motion.y - before[1] + sin * rx + versine * ry)

    def evaluate(self, step, points, motions, forces):
        """Adds all contacts at t_n to the forces. Nothing is remembered before `commit`."""
        history = {}
        for slot, body, overlap, normal, at in self.contacts(points, motions):
            point = points[slot]
            moved = self.slid(step, point, body, motions[body], at)
            force, energy = self._law(step, point, body, motions[body], (overlap, normal, at, moved), history, forces)
            forces.add(slot, body, at, force, self.k_n, normal, self.k_t, energy)
        self.remember(points, motions, history)

    def _law(self, step, point, body, motion, contact, history, forces):
        """Force on the point and energy in the springs."""
        overlap, (nx, ny), at, (ux, uy) = contact
        moved_n, moved_t = self.fallen(point, body, motion, overlap), uy * nx - ux * ny
        before, *drag_before = self.past[0].get((point.id, body), (0.0, 0.0, 0.0))
        drag_n, drag_t = self._drag(step, point, body, motion, at, (nx, ny), (moved_n, moved_t), forces)
        if overlap <= 0.0:
            forces.slid += 0.5 * self.k_t * before * (moved_t + before)  # what was left in the spring
            # The dashpot's force ends where the contact opens.
            held = max(0.0, (moved_n + overlap) / moved_n) if moved_n > 0.0 else 1.0
            forces.damped -= 0.5 * held * (drag_before[0] * moved_n + drag_before[1] * moved_t)
            return (0.0, 0.0), 0.0
        spring = self.k_n * overlap
        normal, tangential, now = max(0.0, spring + drag_n), 0.0, 0.0
        if self.k_t > 0.0:
            cap = self.mu * normal
            now = max(-cap / self.k_t, min(cap / self.k_t, before + moved_t))
            tangential = max(-cap, min(cap, -self.k_t * now + drag_t)) if drag_t else -self.k_t * now
            forces.slid += 0.5 * self.k_t * (now + before) * (moved_t - (now - before))
        drag = (normal - spring, tangential + self.k_t * now)
        forces.damped -= 0.5 * ((drag[0] + drag_before[0]) * moved_n + (drag[1] + drag_before[1]) * moved_t)
        history[point.id, body] = (now, *drag)
        force = (normal * nx - tangential * ny, normal * ny + tangential * nx)
        return force, 0.5 * (spring * overlap + self.k_t * now * now)

    def _drag(self, step, point, body, motion, at, normal, moved, forces):
        """Forces of the dashpots."""
        if self.damping == 0.0:
            return 0.0, 0.0
        load = forces.on_bodies[body]
        pair = 1.0 / (1.0 / point.mass + load.w)
        forces.damping = max(forces.damping, self.damping * math.sqrt(max(1.0, self.damped_mass / pair)))
        if step.dt_before > 0.0:
            along = [way / step.dt_before for way in moved]
        else:
            vx = point.vx - point.spin * (at[1] - point.y) - motion.vx + motion.spin * (at[1] - motion.y)
            vy = point.vy + point.spin * (at[0] - point.x) - motion.vy - motion.spin * (at[0] - motion.x)
            along = (vx * normal[0] + vy * normal[1], vy * normal[0] - vx * normal[1])
        mass = self.damped_mass or pair
        return [-2.0 * self.damping * math.sqrt(k * mass) * v for k, v in zip((self.k_n, self.k_t), along)]

    def remember(self, points, motions, history):
        """What the next step needs, once this one is done."""
        self.next_past = (history, {p.id: (p.x, p.y) for p in points}, [tuple(m[:3]) for m in motions])

    def commit(self):
        """The step is done: to be called in `advance`."""
        self.past = self.next_past

    def save(self):
        history, points, motions = self.past
        return [[*history.items()], [*points.items()], motions]

    def restore(self, state):
        history, points, motions = state
        history = {tuple(key): value for key, value in history}
        self.past = (history, {point: tuple(place) for point, place in points}, motions)

//! Bugs of physics in a solver of bodies, one by one, as authors make them: each is a change of a line of the Python solver.
//! The kit has to find each by random cases.

use std::path::Path;

use crate::harness::needs::Need;
use crate::harness::{Place, python_can_join, root};
use crate::mutants::searches;

const LAW: &str = "tandem_solver/contact.py";
const SUMS: &str = "tandem_solver/ledger.py";
const DISCS: &str = "examples/disc_dem.py";

/// A seed whose case shows it, what is wrong, in which file, what stands there and what stands there instead.
type Bug = (u64, &'static str, &'static str, &'static str, &'static str);

const BUGS: &[Bug] = &[
    (
        0,
        "force capped at 0.3 r_p, with an energy to match",
        LAW,
        "spring = self.k_n * overlap\n",
        "overlap = min(overlap, 0.3 * point.radius)\n        spring = self.k_n * overlap\n",
    ),
    (
        0,
        "force capped at 0.4 r_p",
        LAW,
        "spring = self.k_n * overlap\n",
        "spring = self.k_n * min(overlap, 0.4 * point.radius)\n",
    ),
    (
        1,
        "slip without the body's rotation",
        LAW,
        "turn, rx, ry = motion.angle - before[2],",
        "turn, rx, ry = 0.0,",
    ),
    (
        1,
        "slip without the body's translation",
        LAW,
        "- (motion.x - before[0] + versine",
        "- (versine",
    ),
    (
        13,
        "slip by the first order of the rotation",
        LAW,
        "sin, versine = math.sin(turn), 2.0 * math.sin(0.5 * turn) ** 2",
        "sin, versine = turn, 0.0",
    ),
    (
        1,
        "slip from the point's own velocity",
        LAW,
        "moved_n, moved_t = ux * nx + uy * ny, uy * nx - ux * ny",
        "moved_n, moved_t = ux * nx + uy * ny, (point.vy * nx - point.vx * ny) * step.dt_before",
    ),
    (
        1,
        "springs frozen while slipping",
        LAW,
        "now = max(-cap / self.k_t, min(cap / self.k_t, before + moved_t))",
        "now = before + moved_t if abs(before + moved_t) <= cap / self.k_t else before",
    ),
    (
        1,
        "springs that grow beyond friction",
        LAW,
        "now = max(-cap / self.k_t, min(cap / self.k_t, before + moved_t))",
        "now = before + moved_t",
    ),
    (
        1,
        "springs forgotten in every step",
        LAW,
        "before + moved_t))",
        "moved_t))",
    ),
    (
        1,
        "springs that outlive an opening",
        LAW,
        "return (0.0, 0.0), 0.0\n        spring",
        "history[point.id, body] = (before, 0.0, 0.0)\n            return (0.0, 0.0), 0.0\n        spring",
    ),
    (
        19,
        "one history for all bodies",
        LAW,
        "self.past[0].get((point.id, body),",
        "next((v for k, v in self.past[0].items() if k[0] == point.id), None) or self.past[0].get((point.id, body),",
    ),
    (
        1,
        "history by slot",
        LAW,
        "{p.id: (p.x, p.y) for p in points}",
        "{k: (p.x, p.y) for k, p in enumerate(points)}",
    ),
    (
        1,
        "springs that outlive a point",
        LAW,
        "self.past = self.next_past\n",
        "self.past = ({**self.past[0], **self.next_past[0]}, *self.next_past[1:])\n",
    ),
    (
        10,
        "false slip of a new point",
        LAW,
        "was = self.past[1].get(point.id)\n        if was is None:\n            return 0.0, 0.0",
        "was = self.past[1].get(point.id, (point.x, point.y))\n        if not self.past[2]:\n            return 0.0, 0.0",
    ),
    (
        1,
        "no couple on points",
        SUMS,
        "point[2] += (at[0] - of.x) * fy - (at[1] - of.y) * fx",
        "pass",
    ),
    (
        1,
        "slip of the centres of points",
        LAW,
        "spun = point.spin * step.dt_before",
        "spun = 0.0",
    ),
    (
        1,
        "friction that helps",
        LAW,
        "-self.k_t * now\n            forces.slid",
        "self.k_t * now\n            forces.slid",
    ),
    (
        1,
        "friction by the spring alone",
        LAW,
        "cap = self.mu * normal",
        "cap = self.mu * spring * 1.5",
    ),
    (
        1,
        "arm to the point's centre",
        LAW,
        "arm = point.radius - 0.5 * overlap",
        "arm = 0.0",
    ),
    (
        1,
        "arm to the surface",
        LAW,
        "arm = point.radius - 0.5 * overlap",
        "arm = point.radius - overlap",
    ),
    (
        0,
        "reach only where it touches",
        LAW,
        "if overlap > -0.5 * point.radius:",
        "if overlap > 0.0:",
    ),
    (
        81,
        "half the force above 64 points",
        LAW,
        "forces.add(slot, body, at, force,",
        "force = force if len(points) <= 64 else (0.5 * force[0], 0.5 * force[1])\n            forces.add(slot, body, at, force,",
    ),
    (
        12,
        "only the first body of a point",
        LAW,
        "for slot, body, overlap, normal, at in self.contacts(points, motions):\n            point",
        "seen = set()\n        for slot, body, overlap, normal, at in self.contacts(points, motions):\n            if overlap > 0 and slot in seen:\n                continue\n            seen |= {slot} if overlap > 0 else set()\n            point",
    ),
    (
        1,
        "limits without the tangential stiffness",
        LAW,
        "normal, self.k_t, energy)",
        "normal, 0.0, energy)",
    ),
    (
        1,
        "limits without friction's lever arm",
        SUMS,
        "tangential * (load.w + load.wi * (rx * nx + ry * ny) ** 2)",
        "tangential * load.w",
    ),
    (
        0,
        "no support impulse of fixed bodies",
        SUMS,
        "return (0.0,) * 3 if motion in (\"fixed\", \"driven\") else (1.0,) * 3",
        "return (1.0,) * 3",
    ),
    (
        1,
        "torque of the wrong sign",
        SUMS,
        "load.torque -= rx * fy - ry * fx",
        "load.torque += rx * fy - ry * fx",
    ),
    (
        1,
        "energy of the springs without friction",
        LAW,
        "0.5 * (spring * overlap + self.k_t * now * now)",
        "0.5 * spring * overlap",
    ),
    (
        1,
        "sliding with the spring of after",
        LAW,
        "forces.slid += 0.5 * self.k_t * (now + before) * (moved_t - (now - before))",
        "forces.slid += self.k_t * now * (moved_t - (now - before))",
    ),
    (
        1,
        "sliding forgotten at an opening",
        LAW,
        "forces.slid += 0.5 * self.k_t * before * (moved_t + before)",
        "pass",
    ),
    (
        10,
        "rotation in degrees beyond 2 rad",
        DISCS,
        "m.angle + spin * step.dt)",
        "m.angle + spin * step.dt * (57.3 if abs(m.angle) > 2.0 else 1.0))",
    ),
    (
        1,
        "kick of a whole step",
        DISCS,
        "vx = m.vx + (load.fx / m.mass + gravity[0]) * step.kick",
        "vx = m.vx + (load.fx / m.mass + gravity[0]) * step.dt",
    ),
    (
        1,
        "gravity twice",
        DISCS,
        "gravity[1]) * step.kick",
        "2 * gravity[1]) * step.kick",
    ),
    (
        1,
        "spin by the mass",
        DISCS,
        "load.torque / m.inertia",
        "load.torque / m.mass",
    ),
    (
        1,
        "drift by the old velocity",
        DISCS,
        "m.y + vy * step.dt",
        "m.y + m.vy * step.dt",
    ),
    (
        4,
        "fixed bodies that turn",
        DISCS,
        "        if self.free:\n",
        "        if not self.free:\n            self.motion = m._replace(angle=m.angle + load.torque * step.kick * step.dt / m.inertia)\n        if self.free:\n",
    ),
    (
        1,
        "a restored run without its springs",
        DISCS,
        "self.springs.restore(state[\"springs\"])",
        "pass",
    ),
    (
        0,
        "inertia of a ring",
        LAW,
        "area * (0.5 * a**2 + x * x + y * y)",
        "area * (a**2 + x * x + y * y)",
    ),
    (
        0,
        "density times a square",
        LAW,
        "inertia[\"density\"] * area",
        "inertia[\"density\"] * 4 * self.radius**2",
    ),
    (
        0,
        "envelope without the sphero-radius",
        LAW,
        "return [(index, x, y, self.radius) for",
        "return [(index, x, y, 0.5 * self.radius) for",
    ),
    (
        0,
        "rounding to six digits",
        LAW,
        "return (distance, dx / distance, dy / distance) if",
        "return (round(distance, 6), dx / distance, dy / distance) if",
    ),
    (
        0,
        "contact by single precision",
        LAW,
        "overlap = shape.radius + point.radius - distance",
        "import struct\n                overlap = struct.unpack('f', struct.pack('f', shape.radius + point.radius - distance))[0]",
    ),
];

/// Copies a directory of Python files.
fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap().path();
        let to = to.join(entry.file_name().unwrap());
        if entry.is_dir() {
            copy(&entry, &to);
        } else {
            std::fs::copy(&entry, &to).unwrap();
        }
    }
}

#[test]
fn every_bug_of_physics_is_found_by_random_cases() {
    if !Need::Python.is_met(
        python_can_join(),
        "python3 cannot import iceoryx2: python/README.md",
    ) {
        return;
    }
    let place = Place::new();
    let mut missed = Vec::new();
    for (k, (seed, what, file, from, to)) in BUGS.iter().enumerate() {
        let package = place.path(&format!("bug{k}"));
        for part in ["tandem_solver", "examples"] {
            copy(&root().join("python").join(part), &package.join(part));
        }
        let file = package.join(file);
        let text = std::fs::read_to_string(&file).unwrap();
        assert_eq!(
            text.matches(from).count(),
            1,
            "{what}: {from} has to be there once"
        );
        std::fs::write(&file, text.replace(from, to)).unwrap();
        let command = format!("python3 '{}'", package.join(DISCS).display());
        // No time to make a case small: the first one that shows the bug is enough.
        let found = searches(Some(*seed)).find_map(|(seed, cases)| {
            let numbers = format!("--seed {seed} --cases {cases} --time 20 --shrink 0");
            let only = "J-1,T-1,F-8,F-7,F-5,F-6,F-9,E-4,R-3,L-2,N-1";
            let mut kit = vec!["conformance", "--dem", &command, "--only", only];
            kit.extend(numbers.split(' '));
            let ended = place.start(&kit).end();
            let again = ended.stdout.split("--seed ").nth(1).map(str::to_owned);
            again.filter(|_| ended.status.code() == Some(1) && ended.stdout.contains("FAIL"))
        });
        match found {
            Some(again) => println!("{what}: {}", again.lines().next().unwrap_or_default()),
            None => missed.push(*what),
        }
    }
    assert!(missed.is_empty(), "not found:\n{}", missed.join("\n"));
}

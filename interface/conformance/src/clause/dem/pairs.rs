//! Sections 6 and 7: contact between the points of two groups (`group_pairs`), by closed forms.

use interface::config::capability::CONTACTS;
use interface::config::{ContactLaw, DemConfig, GroupPair};
use interface::message::wire::{ContactState, ImpForce, flags};

use super::scene::{RADIUS, scene};
use crate::bench::{Bench, Points};
use crate::clause::Clause;
use crate::mutant::Flaw;
use crate::verdict::{Judgement, broken, near, require};

/// Normal stiffness in N/m: of no other scene of the kit, so that mutants know a pair by it.
const K_PAIR: f64 = 3.3e4;
/// Overlap of a pair in m.
const OVERLAP: f64 = 0.2 * RADIUS;

pub const CLAUSES: &[Clause] = &[
    Clause::must(
        "F-7y",
        "two points of a pair press on one another, equally and oppositely",
        balance,
    )
    .needs(&["pairs"])
    .after(&["F-7a", "T-1a", "T-6a"])
    .mutant("forgets the second point of a pair", || {
        of_pairs(|forces| forces[1].force = [0.0; 2])
    }),
    Clause::must(
        "F-6b",
        "a pair of points counts twice its stiffness at both ends",
        stiffness,
    )
    .needs(&["pairs"])
    .after(&["F-5a", "F-7a", "T-6a", "F-7y"])
    .mutant("counts the stiffness of a pair once", || {
        of_pairs(|forces| {
            for force in forces {
                force.stiffness *= 0.5;
            }
        })
    })
    .mutant("counts it at one end only", || {
        of_pairs(|forces| {
            forces[0].stiffness *= 2.0;
            forces[1].stiffness = f64::MIN_POSITIVE;
        })
    }),
    Clause::must(
        "I-10b",
        "the history of a pair of points survives a new set",
        remembered,
    )
    .needs(&["pairs", "feature:friction"])
    .after(&["F-7a", "F-7d", "T-6a", "F-7y", "I-9a", "I-10a"])
    .mutant("loses the spring of a pair at a new set", || {
        Flaw::forces(|header, forces| {
            if header.set > 1 && forces.iter().any(is_of_a_pair) {
                for force in forces {
                    force.force[1] = 0.0;
                }
            }
        })
    }),
];

/// Judged after what frames say of the contacts of bodies.
pub const IN_FRAMES: Clause = Clause::must(
    "R-6b",
    "the contacts of a frame include those of two points, with force and position",
    told,
)
.needs(&["pairs", CONTACTS])
.after(&["F-7y", "R-6a"])
.mutant("reports contacts of bodies only", || {
    Flaw::contacts(|header, contacts| {
        contacts.retain(|contact| contact.with != POINTS);
        header.count = contacts.len() as u64;
    })
})
.mutant("reports the first point as a body", || {
    of_points(|contact| contact.with = 1)
})
.mutant("reports the force on the second point", || {
    of_points(|contact| contact.force = contact.force.map(|f| -f))
})
.mutant("reports the position of the first point", || {
    of_points(|contact| contact.position = [0.0; 2])
});

/// What `with` is of a contact of two points.
const POINTS: u64 = 2;

/// Changes the contacts of two points.
fn of_points(change: fn(&mut ContactState)) -> Flaw {
    Flaw::contacts(move |_, contacts| {
        let pairs = contacts.iter_mut();
        pairs
            .filter(|contact| contact.with == POINTS)
            .for_each(change);
    })
}

fn is_of_a_pair(force: &ImpForce) -> bool {
    force.stiffness == 2.0 * K_PAIR
}

/// Changes the forces of the two points of a pair.
fn of_pairs(change: fn(&mut [ImpForce])) -> Flaw {
    Flaw::forces(move |_, forces| {
        if forces.len() >= 2 && forces.iter().all(is_of_a_pair) {
            change(forces);
        }
    })
}

/// Groups 0 and 1 touch; there are no bodies.
fn touching(friction: f64) -> DemConfig {
    let law = ContactLaw::Linear {
        normal_stiffness: K_PAIR,
        tangential_stiffness: 0.5 * K_PAIR,
        friction,
        damping_ratio: 0.0,
        damped_mass: 0.0,
    };
    DemConfig {
        group_pairs: vec![GroupPair {
            between: [0, 1],
            law,
        }],
        ..scene(Vec::new(), ContactLaw::default())
    }
}

/// Two points of groups 0 and 1 on a line, the second at this height (m) above the line through the first.
fn two(height: f64) -> Points {
    let mut points = Points::new().with([0.0; 2], [0.0; 2], RADIUS, 0.5).with(
        [2.0 * RADIUS - OVERLAP, height],
        [0.0; 2],
        RADIUS,
        0.7,
    );
    points.set[1].group = 1;
    points
}

fn balance(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&touching(0.0))?;
    let points = two(0.0);
    play.set(&points.set);
    let forces = play.step(0.0, &points.states)?.0.forces;
    let want = K_PAIR * OVERLAP;
    let tolerance = 1e-12 * K_PAIR * RADIUS;
    near(
        "force on the first along x",
        forces[0].force[0],
        -want,
        tolerance,
    )?;
    let [first, second] = [0, 1].map(|slot| forces[slot].force);
    let opposite = first == second.map(|f| -f);
    require(
        opposite,
        format_args!("{:?}", first.map(|f| -f)),
        format_args!("{second:?}"),
    )?;
    Ok(format!("{second:?} N/m"))
}

/// Two points that press, and one that touches nothing.
fn told(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&touching(0.0))?;
    let mut points = two(0.0).with([0.0, 40.0 * RADIUS], [0.0; 2], RADIUS, 0.5);
    points.set[2].group = 1;
    play.set(&points.set);
    let mut grant = play.next_grant(1e-5, 1, true);
    grant.flags |= flags::FRAME;
    play.send_grants(&[grant])?;
    play.exchange(&points.states)?;
    let told = play.report()?;
    let Some((header, contacts)) = &told.contacts else {
        return Err(broken("the contacts before the report", "none"));
    };
    let [contact] = contacts[..] else {
        return Err(broken("one contact", format_args!("{contacts:?}")));
    };
    let ids = [contact.body, contact.other];
    require(
        header.count == 1 && contact.with == POINTS && (ids == [0, 1] || ids == [1, 0]),
        "a contact of points 0 and 1",
        format_args!("{contact:?}"),
    )?;
    // Which of them is the first is for the solver to say.
    let away = if ids == [0, 1] { -1.0 } else { 1.0 };
    let (force, scale) = (away * K_PAIR * OVERLAP, K_PAIR * RADIUS);
    near("force in N/m", contact.force[0], force, 1e-12 * scale)?;
    near("force across in N/m", contact.force[1], 0.0, 1e-12 * scale)?;
    let middle = RADIUS - 0.5 * OVERLAP;
    near("contact point in m", contact.position[0], middle, 1e-12)?;
    near("contact point across", contact.position[1], 0.0, 1e-12)?;
    Ok(format!(
        "{:?} N/m at {:?} m",
        contact.force, contact.position
    ))
}

fn stiffness(bench: &Bench) -> Judgement {
    let mut play = bench.run_bodies(&touching(0.0))?;
    let points = two(0.0);
    play.set(&points.set);
    let forces = play.step(0.0, &points.states)?.0.forces;
    for (force, end) in forces.iter().zip(["first", "second"]) {
        let what = format!("stiffness at the {end}");
        near(&what, force.stiffness, 2.0 * K_PAIR, 1e-12 * K_PAIR)?;
    }
    Ok(format!("2 x {K_PAIR} N/m at both ends"))
}

/// A point is moved along another one, and a third one, far away, comes into the set with an id between theirs.
fn remembered(bench: &Bench) -> Judgement {
    let moved = 1e-2 * OVERLAP;
    let mut play = bench.run_bodies(&touching(10.0))?;
    let mut points = two(0.0);
    points.set[1].id = 2;
    play.set(&points.set);
    play.step(1e-4, &points.states)?;
    points.states[1].position[1] = moved;
    let before = play.step(1e-4, &points.states)?.0.forces;
    let mut more = two(moved).with([40.0 * RADIUS, 0.0], [0.0; 2], RADIUS, 0.5);
    more.set[2].group = 1;
    more.set.swap(1, 2);
    more.states.swap(1, 2);
    for (id, info) in (0..).zip(&mut more.set) {
        info.id = id;
    }
    play.set(&more.set);
    let after = play.step(1e-4, &more.states)?.0.forces;
    // The spring, less the share that the normal force has across: the line of centres has turned.
    let want = K_PAIR * moved * (0.5 - OVERLAP / (2.0 * RADIUS - OVERLAP));
    near("force across", before[0].force[1], want, 1e-2 * want)?;
    for (slot, slot_after) in [(0, 0), (1, 2)] {
        for a in 0..2 {
            let (got, want) = (after[slot_after].force[a], before[slot].force[a]);
            near(
                "force after the new set",
                got,
                want,
                1e-12 * K_PAIR * RADIUS,
            )?;
        }
    }
    Ok(format!("{:?} N/m", after[0].force))
}

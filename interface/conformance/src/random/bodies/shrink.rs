//! Makes a case that fails smaller: fewer points, bodies and features.

use interface::config::{BodyConfig, BodyShape, ContactLaw, Motion};

use super::super::plan::{self, Course};
use super::case::{Along, Case, Walker};

/// The smaller cases to try for a case, the boldest first.
pub fn smaller(case: &Case, step: u32) -> Vec<Case> {
    let mut smaller = Vec::new();
    let mut with = |change: &dyn Fn(&mut Case)| {
        let mut other = case.clone();
        change(&mut other);
        if other != *case {
            smaller.push(other);
        }
    };
    for k in 0..case.points.len() {
        with(&|c| without_point(c, k));
    }
    for b in 0..case.config.bodies.len() {
        with(&|c| without_body(c, b));
    }
    for first in [step, step / 2, 1] {
        with(&|c| later(c, first));
    }
    with(&|c| c.config.gravity = [0.0; 2]);
    with(&|c| c.config.body_contact = None);
    with(&|c| c.config.contact_pairs.clear());
    with(&|c| c.config.group_pairs.clear());
    for (_, change) in LAWS {
        with(&|c| change(&mut c.config.point_contact));
        with(&|c| c.config.body_contact.iter_mut().for_each(change));
        with(&|c| {
            c.config
                .group_pairs
                .iter_mut()
                .for_each(|pair| change(&mut pair.law));
        });
        with(&|c| {
            c.config
                .contact_pairs
                .iter_mut()
                .for_each(|pair| change(&mut pair.law));
        });
    }
    for b in 0..case.config.bodies.len() {
        for change in BODIES {
            with(&|c| change(&mut c.config.bodies[b]));
        }
    }
    for k in 0..case.points.len() {
        for change in POINTS {
            with(&|c| change(&mut c.points[k], step));
        }
    }
    smaller
}

/// Bodies that are simpler.
const BODIES: [fn(&mut BodyConfig); 7] = [
    |body| body.spin = 0.0,
    |body| body.velocity = [0.0; 2],
    |body| body.motion = Motion::Fixed,
    |body| body.motion = Motion::Free,
    |body| body.shape = BodyShape::Disc,
    |body| body.angle = 0.0,
    |body| body.position = [0.0; 2],
];

/// Points that are simpler, given the step that fails.
const POINTS: [fn(&mut Walker, u32); 8] = [
    |point, _| point.noise = [0.0; 2],
    |point, _| point.spin = 0.0,
    |point, _| point.present = vec![[0, u32::MAX]],
    |point, _| point.group = 0,
    |point, step| point.way = Course(vec![(0, point.way.at(step))]),
    |point, step| point.overlap = Course(vec![(0, point.overlap.at(step))]),
    |point, _| point.way = Course(vec![(0, 0.0)]),
    |point, step| {
        let ends = [step.saturating_sub(1), step].map(|s| (s, point.way.at(s)));
        point.way = Course(ends.to_vec());
    },
];

/// A part of a law, and the law without it.
type Simpler = (&'static str, fn(&mut ContactLaw));

/// Laws that are simpler.
const LAWS: [Simpler; 4] = [
    ("friction", |law| match law {
        ContactLaw::Linear { friction, .. }
        | ContactLaw::Granular { friction, .. }
        | ContactLaw::HertzMindlin { friction, .. }
        | ContactLaw::Area { friction, .. } => *friction = 0.0,
    }),
    ("damping", |law| match law {
        ContactLaw::Linear { damping_ratio, .. } | ContactLaw::Granular { damping_ratio, .. } => {
            *damping_ratio = 0.0;
        }
        ContactLaw::HertzMindlin { restitution, .. } => *restitution = 1.0,
        ContactLaw::Area { .. } => {}
    }),
    ("adhesion", |law| match law {
        ContactLaw::Granular { adhesion, .. } | ContactLaw::HertzMindlin { adhesion, .. } => {
            *adhesion = 0.0;
        }
        _ => {}
    }),
    ("damped mass", |law| match law {
        ContactLaw::Linear { damped_mass, .. } | ContactLaw::Granular { damped_mass, .. } => {
            *damped_mass = 0.0;
        }
        _ => {}
    }),
];

fn without_point(case: &mut Case, gone: usize) {
    let leaning = |along: Along| along == Along::Point(gone);
    if case.points.iter().any(|point| leaning(point.along)) {
        return;
    }
    case.points.remove(gone);
    for point in &mut case.points {
        if let Along::Point(k) = &mut point.along
            && *k > gone
        {
            *k -= 1;
        }
    }
}

fn without_body(case: &mut Case, gone: usize) {
    if case
        .points
        .iter()
        .any(|point| point.along == Along::Body(gone))
    {
        return;
    }
    case.config.bodies.remove(gone);
    for point in &mut case.points {
        if let Along::Body(b) = &mut point.along
            && *b > gone
        {
            *b -= 1;
        }
    }
}

/// The same from a later step on, as if it were the first.
fn later(case: &mut Case, first: u32) {
    let [_, rest] = plan::parts(&case.epochs, first);
    case.epochs = rest;
    for point in &mut case.points {
        for course in [&mut point.way, &mut point.overlap] {
            let start = (0, course.at(first));
            course.0.retain(|(step, _)| *step > first);
            course.0.iter_mut().for_each(|(step, _)| *step -= first);
            course.0.insert(0, start);
        }
        for range in &mut point.present {
            *range = range.map(|step| step.saturating_sub(first));
        }
    }
}

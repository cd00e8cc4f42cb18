//! What was answered then and now, number by number.

use core::fmt::Display;
use std::collections::BTreeMap;

use crate::message::control::{Party, Ready};
use crate::message::wire::{Number, Record};
use crate::message::{Channel, Kind, Message, Payload};

/// Numbers of a report that depend on the machine and not on the run.
const OF_THE_MACHINE: [&str; 4] = ["compute_ns", "exchange_ns", "wait_ns", "cpu_ns"];

/// What a field is measured by: the largest number of its unit. What is small against the others of its unit, such as the
/// energy lost where nothing is, is rounding of theirs and not to be measured by itself.
fn unit_of(name: &'static str) -> &'static str {
    match name {
        "position" | "travel" | "lower" | "upper" | "reach" | "radius" | "radius_min" => "length",
        "velocity" | "speed" | "spin" => "velocity",
        "kinetic" | "kinetic_rotation" | "elastic" | "gravity" | "contact" | "friction_work"
        | "viscous_work" | "plastic_work" | "driven_work" | "stress_work" | "transfer_work" => {
            "energy"
        }
        "momentum" | "applied_impulse" | "contact_impulse" | "angular_momentum"
        | "applied_moment" | "contact_moment" => "impulse",
        "force" | "contact_force" | "point_force" | "body_force" | "point_torque"
        | "body_torque" => "force",
        "omega_sq" | "contact_omega_sq" => "frequency",
        name => name,
    }
}

/// The least that a field is measured by: an angle by one radian.
fn least_scale(name: &'static str) -> f64 {
    if name == "angle" { 1.0 } else { 0.0 }
}

/// How alike the answers are.
#[derive(Debug)]
pub struct Comparison {
    party: Party,
    tolerance: f64,
    /// Numbers that were compared.
    pub numbers: u64,
    /// How many of them differ.
    pub differing: u64,
    /// The first difference: step, channel, record and field, what was recorded and what was replayed.
    pub first: Option<String>,
    /// The largest difference of all numbers that are not counts, relative to the largest of its unit so far.
    pub largest: f64,
    scales: BTreeMap<&'static str, f64>,
    /// Ids of the IMPs, slot by slot.
    set: Vec<u64>,
}

/// A field of the header, or of the record in a slot.
type Field = (Option<usize>, &'static str, Number);

impl Comparison {
    pub(super) fn new(party: Party, tolerance: f64) -> Self {
        Self {
            party,
            tolerance,
            numbers: 0,
            differing: 0,
            first: None,
            largest: 0.0,
            scales: BTreeMap::new(),
            set: Vec::new(),
        }
    }

    /// The set whose slots the states and forces have from now on.
    pub(super) fn take_set(&mut self, set: &Message) {
        if let Payload::Set(set) = &set.payload {
            self.set = set.iter().map(|imp| imp.id).collect();
        }
    }

    fn differ(&mut self, step: u64, place: impl Display, then: impl Display, now: impl Display) {
        self.differing += 1;
        self.first.get_or_insert_with(|| {
            format!("step {step}, {place}: recorded {then}, replayed {now}")
        });
    }

    /// Two answers in words that differ.
    pub(super) fn words(&mut self, step: u64, then: &str, now: &str) {
        self.differ(
            step,
            Channel::of(self.party, Kind::Notice).name(),
            then,
            now,
        );
    }

    /// Two configurations taken. Identity, notes and bytes are the program's own affair.
    pub(super) fn ready(&mut self, recorded: &Ready, replayed: &Ready) {
        if recorded.scene_hash != replayed.scene_hash {
            self.words(0, &recorded.scene_hash, &replayed.scene_hash);
        }
        let [then, now] = [recorded, replayed].map(|ready| {
            let r = &ready.readiness;
            [
                ("items", Number::Count(r.items)),
                ("courant_time", Number::Real(r.courant_time)),
                ("mass_min", Number::Real(r.mass_min)),
                ("stiffness_max", Number::Real(r.stiffness_max)),
            ]
        });
        for ((name, then), (_, now)) in then.into_iter().zip(now) {
            self.number(0, Kind::Notice, name, (then, now), || format!("`{name}`"));
        }
    }

    /// Two messages of one kind.
    pub(super) fn messages(&mut self, step: u64, recorded: &Message, replayed: &Message) {
        let kind = recorded.kind();
        self.take_set(recorded);
        // Records that only one of them has are compared with nothing below.
        let [then, now] = [recorded, replayed].map(|message| message.payload.len());
        if then != now {
            let channel = Channel::of(self.party, kind).name();
            let place = format_args!("{channel}, number of records");
            self.differ(step, place, then, now);
        }
        let [then, now] = [recorded, replayed].map(|message| {
            let mut fields: Vec<Field> = Vec::new();
            let header = &message.header;
            header.visit(&mut |name, number| fields.push((None, name, number)));
            let records = message.payload.records();
            records.visit(&mut |slot, name, number| fields.push((Some(slot), name, number)));
            fields
        });
        let set = std::mem::take(&mut self.set);
        let (mut last, mut component, mut id) = ("", 0, 0);
        for ((slot, name, then), (.., now)) in then.into_iter().zip(now) {
            component = if name == last { component + 1 } else { 0 };
            last = name;
            if let ("id" | "body", Number::Count(count)) = (name, then) {
                id = count;
            }
            if OF_THE_MACHINE.contains(&name) {
                continue;
            }
            self.number(step, kind, name, (then, now), || {
                let y = if component == 1 { ", y" } else { "" };
                let Some(slot) = slot else {
                    return format!("header `{name}`{y}");
                };
                let who = match kind {
                    Kind::States | Kind::Forces => set.get(slot).map(|id| ("point", *id)),
                    Kind::Set | Kind::Points => Some(("point", id)),
                    Kind::Envelopes => Some(("body", id)),
                    Kind::Groups => Some(("group", slot as u64)),
                    Kind::Bodies => Some(("body", slot as u64)),
                    _ => None,
                };
                match who {
                    Some((what, id)) => format!("record {slot} ({what} {id}) `{name}`{y}"),
                    None => format!("`{name}`{y}"),
                }
            });
        }
        self.set = set;
    }

    fn number(
        &mut self,
        step: u64,
        kind: Kind,
        name: &'static str,
        numbers: (Number, Number),
        place: impl Fn() -> String,
    ) {
        self.numbers += 1;
        let channel = Channel::of(self.party, kind).name();
        let (then, now) = match numbers {
            (Number::Real(then), Number::Real(now)) => (then, now),
            (then, now) if then == now => return,
            (then, now) => {
                let [then, now] = [then, now].map(|number| match number {
                    Number::Count(count) => count.to_string(),
                    Number::Real(x) => format!("{x:e}"),
                });
                return self.differ(step, format_args!("{channel}, {}", place()), then, now);
            }
        };
        let scale = self.scales.entry(unit_of(name)).or_default();
        *scale = scale.max(then.abs()).max(least_scale(name));
        // Travel is an upper bound (F-9), so a larger one is correct too.
        let wider = kind == Kind::Forces && name == "travel" && now > then;
        if then.to_bits() == now.to_bits() || (wider && now.is_finite()) {
            return;
        }
        let difference = (then - now).abs();
        if difference > 0.0 {
            self.largest = self.largest.max(difference / *scale);
        }
        if self.tolerance > 0.0 && difference <= self.tolerance * *scale {
            return;
        }
        let place = format_args!("{channel}, {}", place()).to_string();
        let apart = apart(then, now);
        self.differ(
            step,
            place,
            format_args!("{then:e}"),
            format_args!("{now:e} ({apart})"),
        );
    }
}

/// How far apart two numbers are: relative to the larger one, and in numbers of f64.
fn apart(a: f64, b: f64) -> String {
    let larger = a.abs().max(b.abs());
    let relative = if larger > 0.0 {
        (a - b).abs() / larger
    } else {
        0.0
    };
    // Maps bits to integers in the order of the numbers, with -0 next to +0.
    let place = |x: f64| {
        let bits = i128::from(x.to_bits() & (u64::MAX >> 1));
        if x.is_sign_negative() {
            -1 - bits
        } else {
            bits
        }
    };
    let ulps = (place(a) - place(b)).unsigned_abs();
    format!("{relative:.1e} relative, {ulps} ulp")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::wire::{ImpForce, ImpInfo, StepHeader};

    fn forces(x: f64) -> Message {
        let force = |x| ImpForce {
            force: [0.0, x],
            stiffness: 5.0,
            ..ImpForce::default()
        };
        Message::new(
            StepHeader::default(),
            Payload::Forces(vec![force(1000.0), force(x)]),
        )
    }

    fn set() -> Message {
        let imp = |id| ImpInfo {
            id,
            ..ImpInfo::default()
        };
        Message::new(StepHeader::default(), Payload::Set(vec![imp(4), imp(9)]))
    }

    #[test]
    fn the_first_difference_is_named_with_its_place() {
        let mut comparison = Comparison::new(Party::Dem, 0.0);
        comparison.take_set(&set());
        comparison.messages(6, &forces(1.0), &forces(1.0));
        assert_eq!(comparison.first, None);
        assert_eq!(comparison.numbers, 2 * 5 + 6);
        comparison.messages(7, &forces(1.0), &forces(1.0 + f64::EPSILON));
        comparison.messages(8, &forces(1.0), &forces(2.0));
        let first = comparison.first.unwrap();
        assert_eq!(
            first,
            "step 7, imp/forces, record 1 (point 9) `force`, y: recorded 1e0, replayed 1.0000000000000002e0 (2.2e-16 relative, 1 ulp)"
        );
        assert_eq!((comparison.differing, comparison.largest), (2, 1e-3));
    }

    #[test]
    fn a_tolerance_is_of_the_largest_so_far() {
        let mut comparison = Comparison::new(Party::Dem, 1e-6);
        comparison.messages(0, &forces(0.0), &forces(0.9e-3));
        assert_eq!(comparison.first, None);
        comparison.messages(1, &forces(0.0), &forces(1.1e-3));
        assert!(comparison.first.unwrap().starts_with("step 1, "));
        let mut nan = Comparison::new(Party::Dem, 1e-6);
        nan.messages(0, &forces(0.0), &forces(f64::NAN));
        assert_eq!(nan.differing, 1);
    }

    #[test]
    fn bits_count_where_no_tolerance_is_given() {
        let mut comparison = Comparison::new(Party::Dem, 0.0);
        comparison.messages(0, &forces(0.0), &forces(-0.0));
        assert!(
            comparison
                .first
                .unwrap()
                .ends_with("(0.0e0 relative, 1 ulp)")
        );
        assert_eq!(apart(-1.0, 1.0), "2.0e0 relative, 9214364837600034817 ulp");
    }

    #[test]
    fn a_larger_travel_is_as_right_and_a_smaller_one_is_not() {
        let mut wider = forces(1.0);
        wider.header.travel = 2e-3;
        let mut comparison = Comparison::new(Party::Dem, 0.0);
        comparison.messages(3, &forces(1.0), &wider);
        assert_eq!((comparison.differing, comparison.largest), (0, 0.0));
        comparison.messages(4, &wider, &forces(1.0));
        assert_eq!(comparison.differing, 1);
    }

    #[test]
    fn other_flags_and_counts_are_differences() {
        let [mut flags, mut fewer] = [forces(1.0), forces(1.0)];
        flags.header.flags = 2;
        fewer.payload = Payload::Forces(Vec::new());
        let rows = [
            (flags, "header `flags`: recorded 0, replayed 2"),
            (fewer, "number of records: recorded 2, replayed 0"),
        ];
        for (other, words) in rows {
            let mut comparison = Comparison::new(Party::Dem, 0.5);
            comparison.messages(3, &forces(1.0), &other);
            let first = comparison.first.unwrap_or_default();
            assert_eq!(first, format!("step 3, imp/forces, {words}"));
        }
    }
}

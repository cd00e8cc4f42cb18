//! What was answered then and now, number by number.

use core::fmt::{self, Display};
use std::collections::BTreeMap;

use interface::message::control::{Party, Ready};
use interface::message::wire::{Number, Record};
use interface::transport::raw::{Channel, Kind, Message, Payload};

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
        "momentum" | "applied_impulse" | "contact_impulse" => "impulse",
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
    /// The first difference.
    pub first: Option<Difference>,
    /// The largest difference of all numbers that are not counts, relative to the largest of its unit so far.
    pub largest: f64,
    scales: BTreeMap<&'static str, f64>,
    /// Ids of the IMPs, slot by slot.
    set: Vec<u64>,
}

impl Default for Comparison {
    fn default() -> Self {
        Self::new(Party::Dem, 0.0)
    }
}

/// Two answers that differ.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// In which step, or before which.
    pub step: u64,
    /// Where: channel, record, field.
    pub place: String,
    /// As recorded.
    pub recorded: String,
    /// As replayed.
    pub replayed: String,
    /// How far apart they are, of numbers.
    pub apart: Option<Apart>,
}

/// A number of a record.
#[derive(Clone, Copy)]
struct Field {
    kind: Kind,
    name: &'static str,
    component: usize,
}

impl Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let y = if self.component == 1 { ", y" } else { "" };
        write!(f, "`{}`{y}", self.name)
    }
}

/// How far apart two numbers are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apart {
    /// Relative to the larger one.
    pub relative: f64,
    /// Numbers of f64 from one to the other.
    pub ulps: u64,
}

impl Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (recorded, replayed) = (&self.recorded, &self.replayed);
        write!(f, "step {}, {}: ", self.step, self.place)?;
        write!(f, "recorded {recorded}, replayed {replayed}")?;
        if let Some(Apart { relative, ulps }) = self.apart {
            write!(f, " ({relative:.1e} relative, {ulps} ulp)")?;
        }
        Ok(())
    }
}

impl Apart {
    fn between(a: f64, b: f64) -> Self {
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
        Self {
            relative,
            ulps: u64::try_from(ulps).unwrap_or(u64::MAX),
        }
    }
}

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

    /// Two answers in words that differ.
    pub(super) fn words(&mut self, step: u64, recorded: String, replayed: String) {
        self.differing += 1;
        let place = Channel::of(self.party, Kind::Notice).name().to_string();
        self.first.get_or_insert(Difference {
            step,
            place,
            recorded,
            replayed,
            apart: None,
        });
    }

    /// Two configurations taken. Identity, notes and bytes are the program's own affair.
    pub(super) fn ready(&mut self, recorded: &Ready, replayed: &Ready) {
        if recorded.scene_hash != replayed.scene_hash {
            let (then, now) = (&recorded.scene_hash, &replayed.scene_hash);
            self.words(0, then.clone(), now.clone());
        }
        let (then, now) = (&recorded.readiness, &replayed.readiness);
        let real = |then, now| (Number::Real(then), Number::Real(now));
        let numbers = [
            (
                "items",
                (Number::Count(then.items), Number::Count(now.items)),
            ),
            ("courant_time", real(then.courant_time, now.courant_time)),
            ("mass_min", real(then.mass_min, now.mass_min)),
            ("stiffness_max", real(then.stiffness_max, now.stiffness_max)),
        ];
        for (name, pair) in numbers {
            let field = Field {
                kind: Kind::Notice,
                name,
                component: 0,
            };
            self.number(0, field, pair, |_| String::new());
        }
    }

    /// Two messages of one kind.
    pub(super) fn messages(&mut self, step: u64, recorded: &Message, replayed: &Message) {
        let (kind, then, now) = (recorded.kind(), &recorded.header, &replayed.header);
        self.record(step, kind, then, now, |_| "header ".into());
        match (&recorded.payload, &replayed.payload) {
            (Payload::Report(a), Payload::Report(b)) => self.records(step, kind, a, b, |_, _| None),
            (Payload::Groups(a), Payload::Groups(b)) => {
                self.records(step, kind, a, b, |_, slot| Some(("group", slot as u64)));
            }
            (Payload::Points(a), Payload::Points(b)) => {
                self.records(step, kind, a, b, |_, slot| Some(("point", a[slot].id)));
            }
            (Payload::Bodies(a), Payload::Bodies(b)) => {
                self.records(step, kind, a, b, |_, slot| Some(("body", slot as u64)));
            }
            (Payload::Set(a), Payload::Set(b)) => {
                self.take_set(recorded);
                self.records(step, kind, a, b, |_, slot| Some(("point", a[slot].id)));
            }
            (Payload::States(a), Payload::States(b)) => self.records(step, kind, a, b, Self::imp),
            (Payload::Forces(a), Payload::Forces(b)) => self.records(step, kind, a, b, Self::imp),
            (Payload::Envelopes(a), Payload::Envelopes(b)) => {
                self.records(step, kind, a, b, |_, slot| Some(("body", a[slot].body)));
            }
            _ => {}
        }
    }

    fn imp(&self, slot: usize) -> Option<(&'static str, u64)> {
        self.set.get(slot).map(|id| ("point", *id))
    }

    fn records<T: Record>(
        &mut self,
        step: u64,
        kind: Kind,
        recorded: &[T],
        replayed: &[T],
        who: impl Fn(&Self, usize) -> Option<(&'static str, u64)>,
    ) {
        for (slot, (then, now)) in recorded.iter().zip(replayed).enumerate() {
            self.record(step, kind, then, now, |this| match who(this, slot) {
                Some((what, id)) => format!("record {slot} ({what} {id}) "),
                None => String::new(),
            });
        }
    }

    fn record<T: Record>(
        &mut self,
        step: u64,
        kind: Kind,
        recorded: &T,
        replayed: &T,
        place: impl Fn(&Self) -> String,
    ) {
        let mut now = Vec::with_capacity(40);
        replayed.visit(&mut |_, number| now.push(number));
        let (mut slot, mut last, mut component) = (0, "", 0);
        recorded.visit(&mut |name, then| {
            component = if name == last { component + 1 } else { 0 };
            (last, slot) = (name, slot + 1);
            if !OF_THE_MACHINE.contains(&name) {
                let field = Field {
                    kind,
                    name,
                    component,
                };
                self.number(step, field, (then, now[slot - 1]), &place);
            }
        });
    }

    fn number(
        &mut self,
        step: u64,
        field: Field,
        (then, now): (Number, Number),
        place: impl Fn(&Self) -> String,
    ) {
        let Field { kind, name, .. } = field;
        self.numbers += 1;
        let apart = match (then, now) {
            (Number::Real(then), Number::Real(now)) => {
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
                Some(Apart::between(then, now))
            }
            (then, now) if then == now => return,
            _ => None,
        };
        self.differing += 1;
        if self.first.is_none() {
            let show = |number| match number {
                Number::Count(n) => n.to_string(),
                Number::Real(x) => format!("{x:e}"),
            };
            let channel = Channel::of(self.party, kind).name();
            self.first = Some(Difference {
                step,
                place: format!("{channel}, {}{field}", place(self)),
                recorded: show(then),
                replayed: show(now),
                apart,
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface::message::wire::{ImpForce, ImpInfo, StepHeader};

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
        let first = comparison.first.unwrap().to_string();
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
        assert_eq!(comparison.first.unwrap().step, 1);
        let mut nan = Comparison::new(Party::Dem, 1e-6);
        nan.messages(0, &forces(0.0), &forces(f64::NAN));
        assert_eq!(nan.differing, 1);
    }

    #[test]
    fn bits_count_where_no_tolerance_is_given() {
        let mut comparison = Comparison::new(Party::Dem, 0.0);
        comparison.messages(0, &forces(0.0), &forces(-0.0));
        let first = comparison.first.unwrap();
        assert_eq!(first.apart.unwrap().ulps, 1);
        assert_eq!(Apart::between(-1.0, 1.0).relative, 2.0);
        assert!(Apart::between(-1.0, 1.0).ulps > 1 << 62);
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
        let mut other = forces(1.0);
        other.header.flags = 2;
        let mut comparison = Comparison::new(Party::Dem, 0.5);
        comparison.messages(3, &forces(1.0), &other);
        let first = comparison.first.unwrap().to_string();
        assert!(
            first.starts_with("step 3, imp/forces, header `flags`: recorded 0"),
            "{first}"
        );
    }
}

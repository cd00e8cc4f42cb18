//! What a solver answers beside what an oracle expects.

use std::collections::BTreeMap;
use std::fmt::{Debug, Display};

use interface::Vec2;
use interface::message::wire::Ledger;

/// Where a solver differs from the oracle.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// The clause that is broken.
    pub clause: &'static str,
    /// The step.
    pub step: u32,
    /// What differs, of whom: "force on point 3".
    pub what: String,
    /// What PROTOCOL.md asks for.
    pub expected: String,
    /// What the solver said.
    pub got: String,
}

/// What has been compared: how often each clause, and the largest difference as a share of what is allowed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Compared {
    /// Numbers.
    pub count: u64,
    /// Largest difference over what is allowed.
    pub largest: f64,
}

/// Compares numbers of one step.
pub struct Judge<'a> {
    /// The clauses that are asked for.
    pub asked: &'a [&'a str],
    /// By clause.
    pub compared: BTreeMap<&'static str, Compared>,
    /// The step.
    pub step: u32,
    /// What was answered, bit by bit.
    pub bits: Vec<u64>,
}

/// Whether the solver answered as the oracle does.
pub type Result = std::result::Result<(), Box<Difference>>;

impl<'a> Judge<'a> {
    /// Of a case that is to begin.
    pub fn new(asked: &'a [&'a str]) -> Self {
        Self {
            asked,
            compared: BTreeMap::new(),
            step: 0,
            bits: Vec::new(),
        }
    }

    /// Keeps numbers of an answer.
    pub fn keep(&mut self, numbers: impl IntoIterator<Item = f64>) {
        self.bits.extend(numbers.into_iter().map(f64::to_bits));
    }

    /// A difference, if its clause is asked for.
    pub fn differ(
        &self,
        clause: &'static str,
        what: impl Display,
        expected: impl Display,
        got: impl Display,
    ) -> Result {
        if !self.asked.contains(&clause) {
            return Ok(());
        }
        Err(Box::new(Difference {
            clause,
            step: self.step,
            what: what.to_string(),
            expected: expected.to_string(),
            got: got.to_string(),
        }))
    }

    /// What has to be the same to the bit.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "what is compared is made for that"
    )]
    pub fn same<T: PartialEq + Debug>(
        &mut self,
        clause: &'static str,
        what: impl Display,
        got: T,
        want: T,
    ) -> Result {
        if got == want {
            self.count(clause, 0.0);
            return Ok(());
        }
        self.differ(
            clause,
            what,
            format_args!("{want:?}"),
            format_args!("{got:?}"),
        )
    }

    /// Counts a number that is as far off as this share of what is allowed.
    pub fn count(&mut self, clause: &'static str, share: f64) {
        let compared = self.compared.entry(clause).or_default();
        compared.count += 1;
        compared.largest = compared.largest.max(share);
    }

    /// A number within a tolerance.
    pub fn near(
        &mut self,
        clause: &'static str,
        what: impl Display,
        got: f64,
        want: f64,
        tolerance: f64,
    ) -> Result {
        let off = (got - want).abs();
        if off <= tolerance {
            self.count(clause, off / tolerance.max(f64::MIN_POSITIVE));
            return Ok(());
        }
        let got = format_args!("{}, {} off", Number(got), Number(off)).to_string();
        self.differ(clause, what, Number(want), got)
    }

    /// Two numbers within a tolerance.
    pub fn near_vector(
        &mut self,
        clause: &'static str,
        what: impl Display,
        got: [f64; 2],
        want: Vec2,
        tolerance: f64,
    ) -> Result {
        let off = (Vec2::from(got) - want).norm();
        if off <= tolerance {
            self.count(clause, off / tolerance.max(f64::MIN_POSITIVE));
            return Ok(());
        }
        let got = format_args!("{}, {} off", Vector(got), Number(off)).to_string();
        self.differ(clause, what, Vector(want.into()), got)
    }

    /// The impulses of two ledgers within `impulse` (N s/m), their contact forces within `force` (N/m), and the same number of
    /// contacts.
    pub fn near_impulses(
        &mut self,
        clause: &'static str,
        [got, want]: [&Ledger; 2],
        impulse: f64,
        force: f64,
    ) -> Result {
        for ((what, want), (_, got)) in impulses(want).into_iter().zip(impulses(got)) {
            self.near_vector(clause, what, got, want.into(), impulse)?;
        }
        let [at, to] = [got, want].map(|ledger| ledger.contact_force);
        self.near_vector(clause, "contact_force in N/m", at, to.into(), force)?;
        let [got, want] = [got, want].map(|ledger| ledger.contacts as f64);
        self.near(clause, "contacts", got, want, 0.0)
    }

    /// A number that is a bound.
    pub fn at_least(
        &mut self,
        clause: &'static str,
        what: impl Display,
        got: f64,
        least: f64,
    ) -> Result {
        if got >= least * (1.0 - 1e-7) {
            self.count(clause, if got > 0.0 { least / got } else { 0.0 });
            return Ok(());
        }
        self.differ(
            clause,
            what,
            format_args!("at least {}", Number(least)),
            Number(got),
        )
    }
}

/// The energies of a ledger in J/m that both sides may have, by name.
pub fn energies(l: &Ledger) -> [(&'static str, f64); 8] {
    [
        ("kinetic in J/m", l.kinetic),
        ("kinetic_rotation in J/m", l.kinetic_rotation),
        ("elastic in J/m", l.elastic),
        ("gravity in J/m", l.gravity),
        ("contact in J/m", l.contact),
        ("friction_work in J/m", l.friction_work),
        ("plastic_work in J/m", l.plastic_work),
        ("driven_work in J/m", l.driven_work),
    ]
}

/// Its impulses in N s/m, by name.
fn impulses(l: &Ledger) -> [(&'static str, [f64; 2]); 3] {
    [
        ("momentum in N s/m", l.momentum),
        ("applied_impulse in N s/m", l.applied_impulse),
        ("contact_impulse in N s/m", l.contact_impulse),
    ]
}

/// A number for people: six digits.
pub struct Number(pub f64);

impl Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let magnitude = self.0.abs();
        if self.0 == 0.0 || (1e-3..1e5).contains(&magnitude) {
            let digits = if magnitude > 0.0 {
                (5.0 - magnitude.log10().floor()).clamp(0.0, 9.0)
            } else {
                0.0
            };
            write!(f, "{:.*}", digits as usize, self.0)
        } else {
            write!(f, "{:.5e}", self.0)
        }
    }
}

/// Two numbers for people.
pub struct Vector(pub [f64; 2]);

impl Display for Vector {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "({}, {})", Number(self.0[0]), Number(self.0[1]))
    }
}

//! What a solver answers beside what an oracle expects.

use std::collections::BTreeMap;
use std::fmt::{Debug, Display};

use interface::message::wire::{Ledger, Number, Record};

/// Where a solver differs from the oracle.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// The clause that is broken.
    pub clause: &'static str,
    /// The step.
    pub step: u32,
    /// What PROTOCOL.md asks for, of whom: "force on point 3: 12".
    pub expected: String,
    /// What the solver answered.
    pub got: String,
    /// How many times what is allowed it is off; infinite where nothing is.
    pub share: f64,
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
    /// The clauses that are selected.
    pub selected: &'a [&'static str],
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
    pub fn new(selected: &'a [&'static str]) -> Self {
        Self {
            selected,
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
        if !self.selected.contains(&clause) {
            return Ok(());
        }
        Err(Box::new(Difference {
            clause,
            step: self.step,
            expected: format!("{what}: {expected}"),
            got: got.to_string(),
            share: f64::INFINITY,
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
        self.differ(clause, what, format!("{want:?}"), format!("{got:?}"))
    }

    /// Counts a number that is as far off as this share of what is allowed.
    pub fn count(&mut self, clause: &'static str, share: f64) {
        let compared = self.compared.entry(clause).or_default();
        compared.count += 1;
        compared.largest = compared.largest.max(share);
    }

    /// Numbers within a tolerance: their distance.
    pub fn near(
        &mut self,
        clause: &'static str,
        what: impl Display,
        got: &[f64],
        want: &[f64],
        tolerance: f64,
    ) -> Result {
        let pairs = got.iter().zip(want);
        let off = pairs.fold(0.0, |off: f64, (got, want)| off.hypot(got - want));
        let share = off / tolerance.max(f64::MIN_POSITIVE);
        if off <= tolerance {
            self.count(clause, share);
            return Ok(());
        }
        let got = format!("{}, {} off", show(got), show(&[off]));
        let differs = self.differ(clause, what, show(want), got);
        differs.map_err(|mut difference| {
            difference.share = share;
            difference
        })
    }

    /// Fields of a record, in this order: each with its clause, its name and how far off it may be.
    pub fn fields<T: Record>(
        &mut self,
        whom: &str,
        records: [&T; 2],
        rows: &[(&'static str, &'static str, f64)],
    ) -> Result {
        let [got, want] = records.map(numbers);
        for &(clause, name, tolerance) in rows {
            let what = format_args!("{name}{whom}");
            self.near(clause, what, &got[name], &want[name], tolerance)?;
        }
        Ok(())
    }

    /// What both sides may have in their ledgers: energies within `energy` (J/m), impulses within `impulse` (N s/m), contact
    /// forces within `force` (N/m), and the same number of contacts.
    pub fn ledgers(
        &mut self,
        clause: &'static str,
        ledgers: [&Ledger; 2],
        [energy, impulse, force]: [f64; 3],
    ) -> Result {
        let impulses = ["momentum", "applied_impulse", "contact_impulse"];
        let rows = ENERGIES.map(|name| (clause, name, energy)).into_iter();
        let rows = rows.chain(impulses.map(|name| (clause, name, impulse)));
        let rows = rows.chain([(clause, "contact_force", force), (clause, "contacts", 0.0)]);
        self.fields("", ledgers, &rows.collect::<Vec<_>>())
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
        let least = format!("at least {}", show(&[least]));
        self.differ(clause, what, least, show(&[got]))
    }
}

/// The numbers of a record by their names.
fn numbers<T: Record>(record: &T) -> BTreeMap<&'static str, Vec<f64>> {
    let mut numbers = BTreeMap::<_, Vec<f64>>::new();
    record.visit(&mut |name, number| {
        numbers.entry(name).or_default().push(match number {
            Number::Count(count) => count as f64,
            Number::Real(x) => x,
        });
    });
    numbers
}

/// The energies that both sides may have in their ledgers.
const ENERGIES: [&str; 8] = [
    "kinetic",
    "kinetic_rotation",
    "elastic",
    "gravity",
    "contact",
    "friction_work",
    "plastic_work",
    "driven_work",
];

/// The sum of their magnitudes in J/m.
pub fn energies(ledger: &Ledger) -> f64 {
    let numbers = numbers(ledger);
    ENERGIES.map(|name| numbers[name][0].abs()).iter().sum()
}

/// Numbers for people: six digits of each.
pub fn show(numbers: &[f64]) -> String {
    let each = |x: &f64| {
        let magnitude = x.abs();
        if *x == 0.0 {
            "0".to_owned()
        } else if (1e-3..1e5).contains(&magnitude) {
            let digits = (5.0 - magnitude.log10().floor()).clamp(0.0, 9.0);
            format!("{x:.*}", digits as usize)
        } else {
            format!("{x:.5e}")
        }
    };
    let numbers: Vec<String> = numbers.iter().map(each).collect();
    match &numbers[..] {
        [one] => one.clone(),
        several => format!("({})", several.join(", ")),
    }
}

//! A saved state: what of the solver is in it, and how it is checked.
//!
//! Each struct that has state says next to its definition what of it is saved. It takes itself apart field by field, so
//! that whoever adds a field has to say there whether it is state, follows from the configuration, or is of one
//! evaluation only. Lists are not in it: they follow, in their order, from where bodies and points were when they were
//! built, and that is in it.

use interface::config::DemConfig;
use interface::message::wire::{ImpInfo, Record};
use interface::solver::Refusal;
use mechanics::books::Totals;
use serde::{Deserialize, Serialize};

use crate::body::bodies::SavedBody;
use crate::body::load::{Load, PairLoad};
use crate::body::odometer::{Odometer, SavedOdometer};
use crate::contact::pairs::SavedPairs;
use crate::contact::points::SavedPoints;
use crate::law::Numbers;
use crate::setup::configure::System;

/// Name of the format of the bytes.
pub const FORMAT: &str = "tandem-dem 1";

/// The state before a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SavedSystem {
    marks: Marks,
    bodies: Vec<SavedBody>,
    /// In m/s.
    speed: f64,
    published: SavedOdometer,
    totals: Totals,
    points: SavedPoints,
    pairs: Option<SavedPairs>,
}

impl System {
    /// The state before the next step.
    pub fn save(&self) -> SavedSystem {
        let Self {
            bodies,
            points,
            pairs,
            speed,
            published,
            totals,
            marks,
            // Of the configuration.
            gravity: _,
            threads: _,
            outer_acceleration: _,
            first_contact: _,
            skin: _,
            // Of an evaluation, which begins each of them anew.
            point_loads: _,
            body_loads: _,
            pushed_by_points: _,
            kicked: _,
            fastest: _,
            kicked_speed: _,
            // Answers that have been given.
            envelopes: _,
            measurement: _,
            per_resolution_sq: _, // of the configuration
        } = self;
        SavedSystem {
            marks: marks.clone(),
            bodies: bodies.save(),
            speed: *speed,
            published: published.save(),
            totals: *totals,
            points: points.save(),
            pairs: pairs.as_ref().map(|pairs| pairs.save()),
        }
    }

    /// Takes over a state that was saved. After a refusal no points are expected that were not before, but bodies may have
    /// other lists.
    ///
    /// # Errors
    /// A refusal that says what differs.
    pub fn restore(&mut self, saved: &SavedSystem) -> Result<(), Refusal> {
        let SavedSystem {
            marks,
            bodies,
            speed,
            published,
            totals,
            points,
            pairs,
        } = saved;
        self.marks.check(marks)?;
        let bodies = self.bodies.restored(bodies)?;
        finite(|| "the largest speed".into(), &[*speed])?;
        finite(|| "a sum of the books".into(), &numbers(totals))?;
        let published = Odometer::restored(published, &bodies)?;
        match (&mut self.pairs, pairs) {
            (Some(here), Some(saved)) => here.restore(saved, &bodies)?,
            (None, None) => {}
            _ => {
                return Err(refusal(
                    "contact between bodies is in one of state and scene",
                ));
            }
        }
        self.points.restore(points, &bodies)?;
        (self.bodies, self.speed) = (bodies, *speed);
        (self.published, self.totals) = (published, *totals);
        self.point_loads.fill(Load::default());
        self.body_loads.fill(PairLoad::default());
        self.pushed_by_points = true; // the next evaluation clears what the last one left
        Ok(())
    }
}

/// The numbers of the books.
fn numbers(totals: &Totals) -> [f64; 7] {
    let Totals {
        friction_work,
        viscous_work,
        driven_work,
        applied_impulse,
        contact_impulse,
    } = *totals;
    let ([ax, ay], [cx, cy]) = (applied_impulse.value(), contact_impulse.value());
    [friction_work, viscous_work, driven_work, ax, ay, cx, cy]
}

/// The refusal of a state.
pub fn refusal(text: impl Into<String>) -> Refusal {
    Refusal::new("restore", text)
}

/// Refuses another number of things than there are here.
///
/// # Errors
/// Both numbers.
pub fn count(what: &str, found: usize, expected: usize) -> Result<(), Refusal> {
    if found == expected {
        return Ok(());
    }
    let text = format!("the saved state has {found} {what}, expected {expected}");
    Err(refusal(text))
}

/// Refuses numbers that are not finite.
///
/// # Errors
/// Of what they are.
pub fn finite(what: impl Fn() -> String, numbers: &[f64]) -> Result<(), Refusal> {
    if numbers.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    let text = format!("{}: a number that is not finite", what());
    Err(refusal(text))
}

/// What a configuration is told by: a state of another one is refused with the key that differs.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Marks {
    /// One for each of [`KEYS`]; none without a configuration.
    keys: Vec<u64>,
    /// One for each body.
    bodies: Vec<u64>,
}

/// Keys of the configuration other than bodies, in the order of [`Marks::keys`].
const KEYS: [&str; 9] = [
    "dem.gravity",
    "dem.point_contact",
    "dem.body_contact",
    "dem.overlap",
    "dem.contact_pairs",
    "dem.point_surfaces",
    "dem.group_pairs",
    "dem.interface",
    "dem.skin",
];

impl Marks {
    /// Those of `config`.
    pub fn new(config: &DemConfig) -> Self {
        let DemConfig {
            gravity,
            bodies,
            point_contact,
            body_contact,
            overlap,
            contact_resolution: _, // of the step alone, which the coupler may choose anew
            contact_pairs,
            point_surfaces,
            group_pairs,
            interface,
            skin,
            threads: _, // any number of threads gives the same bits
        } = config;
        let keys = [
            mark(gravity),
            mark(point_contact),
            mark(body_contact),
            mark(overlap),
            mark(contact_pairs),
            mark(point_surfaces),
            mark(group_pairs),
            mark(interface),
            mark(skin),
        ];
        Self {
            keys: keys.to_vec(),
            bodies: bodies.iter().map(mark).collect(),
        }
    }

    /// Refuses the state of another configuration.
    ///
    /// # Errors
    /// The first key that differs.
    pub fn check(&self, saved: &Self) -> Result<(), Refusal> {
        count("bodies", saved.bodies.len(), self.bodies.len())?;
        count("marks", saved.keys.len(), self.keys.len())?;
        let other = |key: &str| refusal(format!("the saved state is of another `{key}`"));
        for (key, (is, was)) in KEYS.iter().zip(self.keys.iter().zip(&saved.keys)) {
            if is != was {
                return Err(other(key));
            }
        }
        let mut bodies = self.bodies.iter().zip(&saved.bodies);
        match bodies.position(|(is, was)| is != was) {
            Some(i) => Err(other(&format!("dem.body[{i}]"))),
            None => Ok(()),
        }
    }
}

/// Fowler, Noll and Vo's hash (FNV-1a) of a value's bytes: it tells mistakes apart, not attacks.
fn mark<T: Serialize>(value: &T) -> u64 {
    let bytes = interface::saved::pack("", value);
    let add = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, add)
}

/// What the contacts of a list remember. Most pairs of a list do not touch and remember nothing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SavedHistories {
    /// Length of the list.
    pairs: u64,
    /// Pairs that remember something, ascending.
    at: Vec<u32>,
    /// What they remember, one after another.
    numbers: Vec<f64>,
}

impl SavedHistories {
    /// Those of a list.
    pub fn of<H: Numbers>(histories: &[H]) -> Self {
        let mut saved = Self {
            pairs: histories.len() as u64,
            ..Self::default()
        };
        for (k, history) in (0..).zip(histories) {
            let from = saved.numbers.len();
            history.put(&mut saved.numbers);
            // By bits: minus zero is not nothing.
            if saved.numbers[from..].iter().all(|x| x.to_bits() == 0) {
                saved.numbers.truncate(from);
            } else {
                saved.at.push(k);
            }
        }
        saved
    }

    /// For a list of `pairs` pairs.
    ///
    /// # Errors
    /// A refusal if they are of another list or another law.
    pub fn restored<H: Numbers>(&self, pairs: usize) -> Result<Vec<H>, Refusal> {
        let Self {
            pairs: length,
            at,
            numbers,
        } = self;
        count("pairs in a list", *length as usize, pairs)?;
        count("numbers of contacts", numbers.len(), at.len() * H::COUNT)?;
        finite(|| "the memory of a contact".into(), numbers)?;
        let mut histories = vec![H::default(); pairs];
        let mut numbers = numbers.iter().copied();
        for &k in at {
            let history = histories.get_mut(k as usize);
            let text = || refusal(format!("a contact of pair {k} in a list of {pairs}"));
            *history.ok_or_else(text)? = H::take(&mut numbers);
        }
        Ok(histories)
    }
}

/// A set of points as bytes.
pub fn save_set(set: &[ImpInfo]) -> Vec<u8> {
    let mut bytes = vec![0; size_of_val(set)];
    for (info, bytes) in set.iter().zip(bytes.chunks_mut(size_of::<ImpInfo>())) {
        info.write(bytes);
    }
    bytes
}

/// The set in these bytes.
///
/// # Errors
/// A refusal if they are no set.
pub fn restored_set(bytes: &[u8]) -> Result<Vec<ImpInfo>, Refusal> {
    let (records, rest) = bytes.as_chunks::<{ size_of::<ImpInfo>() }>();
    count("bytes beyond the set", rest.len(), 0)?;
    let read = |bytes: &[u8; size_of::<ImpInfo>()]| {
        let info = ImpInfo::read(bytes);
        let named = |field| refusal(format!("point {}: {field} is not allowed", info.id));
        info.check().map_err(named)?;
        Ok(info)
    };
    records.iter().map(read).collect()
}

//! Contacts of any [`PairKind`], for any law: lists, histories, chunks, sums and saved state.
//!
//! An evaluation writes histories to `next`. [`Side::commit`] then makes them those of the next step, if a step follows.

use std::fmt::Debug;
use std::sync::Mutex;

use interface::message::wire::{ImpInfo, ImpState};
use interface::saved::{pack, refusal, unpack};
use interface::solver::Refusal;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::body::bodies::Bodies;
use crate::contact::approach::{Near, crossing_rate, turning_rate};
use crate::contact::damping::{Damping, Shares};
use crate::contact::pair_geometry::Moves;
use crate::contact::side::{AfterKick, Interval, Side, Sums, Targets};
use crate::law::history::{All, Numbers};
use crate::law::{Law, PairProperties};
use crate::lists::now::{Among, Now, Sets, Slots};
use crate::lists::watch::{Look, Watching};
use crate::threads::{CHUNK, Spare, chunks};
use mechanics::threads::Threads;

/// Pairs in a list: which may touch.
pub trait Listing: Debug + Send + Sync + Sized + 'static {
    /// How many of the two are points.
    const POINTS: u32;
    /// Two that may touch.
    type Pair: Copy + Debug + Send + Sync;
    /// What distinguishes a pair from the others of a list.
    type Key: Copy + Ord;
    /// What belongs to a list beside its pairs.
    type Extra: Debug + Default + Send + Sync;
    /// Where the two were when the list was built.
    type Watch: Watching;

    /// Lists the pairs for the places and margins of `watch`, in ascending order of their keys.
    fn list(
        &self,
        among: &Among,
        watch: &Self::Watch,
        pairs: &mut Vec<Self::Pair>,
        extra: &mut Self::Extra,
    );
    /// Key of a pair whose points are in other slots; `None` if one of them is in none.
    fn key(pair: Self::Pair, slot: impl Fn(u32) -> Option<u32>) -> Option<Self::Key>;
    /// The constants of a pair for its law.
    fn properties(&self, among: &Among, pair: Self::Pair) -> PairProperties;
    /// Its bodies.
    fn bodies(pair: Self::Pair) -> [Option<u32>; 2];
}

/// A kind of pairs: where they touch, and on what their force acts.
pub trait PairKind: Listing {
    /// What the geometry remembers of a pair from step to step.
    type Memory: Clone + Debug + Default + Send + Sync + Serialize + DeserializeOwned;
    /// The results of a chunk that the step limit needs.
    type Found: Debug + Default + Send + Sync;
    /// Those that are added to sums.
    type Added: Debug + Default + Send + Sync;
    /// Working memory for a chunk.
    type Room<L: Law>: Debug + Default + Send;

    /// Evaluates the pairs of a chunk. `next` gets their histories.
    fn evaluate<L: Law>(
        chunk: &Chunk<Self, L>,
        room: &mut Self::Room<L>,
        next: &mut [(L::History, Self::Memory)],
        results: (&mut Self::Found, &mut Self::Added),
    );
    /// Adds the results of a chunk; if the interval is measured with the energy, and the contacts that press.
    fn add(on: &On<Self>, added: &Self::Added, to: &mut Targets, sums: &mut Sums);
    /// The larger ones of `known` and of the rates in 1/s^2, upper bounds of squared frequencies: of the chunk's pairs in
    /// reach, and of those whose contact opens or closes ([`crate::contact::impact`]). `stiffest` is the largest stiffness
    /// in N/m of a pair that presses.
    fn rates(
        _found: &Self::Found,
        _pairs: &[Self::Pair],
        known: [f64; 2],
        _after: &AfterKick,
        _stiffest: f64,
    ) -> [f64; 2] {
        known
    }
    /// Upper bound in 1/s of [`crossing_rate`] for surfaces up to `speed` (m/s).
    fn fastest_crossing(_extra: &Self::Extra, _speed: f64) -> f64 {
        0.0
    }
    /// Calls `act` for the pairs of a chunk, with their numbers in it, that are within `closing` (m) of one another, or as
    /// `watch` says.
    fn each_near(
        _found: &Self::Found,
        _pairs: &[Self::Pair],
        _bodies: &Bodies,
        _margins: (&Self::Watch, f64),
        _act: impl FnMut(usize, &Near),
    ) {
    }
}

/// What an evaluation reads.
#[derive(Debug)]
pub struct On<'a, K: Listing> {
    /// The kind of the pairs.
    pub kind: &'a K,
    /// The bodies.
    pub bodies: &'a Bodies,
    /// The set of points.
    pub set: &'a [ImpInfo],
    /// Their states.
    pub states: &'a [ImpState],
    /// The pairs of the list.
    pub pairs: &'a [K::Pair],
    /// What belongs to them.
    pub extra: &'a K::Extra,
    /// Where the two were when it was built.
    pub watch: &'a K::Watch,
    /// The intervals before and after.
    pub interval: Interval,
    /// How the bodies have moved in the last step.
    pub moves: Moves<'a>,
    /// Which pairs are looked at.
    pub look: Look,
}

impl<K: Listing> Clone for On<'_, K> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K: Listing> Copy for On<'_, K> {}

/// Some pairs of a list, and the data that their evaluation needs.
#[derive(Debug)]
pub struct Chunk<'a, K: PairKind, L: Law> {
    /// What all chunks read. It is a copy, so that loops have it in registers.
    pub on: On<'a, K>,
    /// The law.
    pub law: &'a L,
    /// Number of the chunk.
    pub number: usize,
    /// The pairs.
    pub pairs: &'a [K::Pair],
    /// Their constants.
    pub constants: &'a [L::Pair],
    /// Their mobilities in 1/kg, with bodies that do not rotate.
    pub mobility: &'a [f64],
    /// Histories.
    pub history: &'a [(L::History, K::Memory)],
}

/// The state of the contacts of a list, which is the watch and the histories, and the list, which follows from the places of
/// the watch.
#[derive(Debug)]
struct Kept<K: PairKind, L: Law> {
    watch: K::Watch,
    history: Vec<(L::History, K::Memory)>,
    pairs: Vec<K::Pair>,
    extra: K::Extra,
    constants: Vec<L::Pair>,
    /// Mobility of each pair in 1/kg, with bodies that do not rotate.
    mobility: Vec<f64>,
    damping: Damping,
}

impl<K: PairKind, L: Law> Kept<K, L> {
    fn new(watch: K::Watch, history: Vec<(L::History, K::Memory)>) -> Self {
        Self {
            watch,
            history,
            pairs: Vec::new(),
            extra: K::Extra::default(),
            constants: Vec::new(),
            mobility: Vec::new(),
            damping: Damping::default(),
        }
    }

    /// Builds the list, with the constants of its pairs.
    fn build(&mut self, law: &L, kind: &K, among: &Among) {
        kind.list(among, &self.watch, &mut self.pairs, &mut self.extra);
        let pairs = &self.pairs;
        let of = |pair| kind.properties(among, pair);
        match pairs.first() {
            Some(&any) => self.constants.resize(pairs.len(), law.pair(&of(any))),
            None => self.constants.clear(),
        }
        self.mobility.resize(pairs.len(), 0.0);
        let constants = self.constants.chunks_mut(CHUNK);
        let constants = constants.zip(self.mobility.chunks_mut(CHUNK));
        let chunks = pairs.chunks(CHUNK).zip(constants);
        (among.threads).each(chunks, |(pairs, (constants, mobility))| {
            for ((&pair, constants), mobility) in pairs.iter().zip(constants).zip(mobility) {
                let properties = of(pair);
                (*constants, *mobility) = (law.pair(&properties), 1.0 / properties.mass);
            }
        });
        let constants = (&self.constants[..], &self.mobility[..]);
        self.damping = Damping::of::<K, L>(law, among, pairs, constants);
    }

    /// Takes the histories from an `old` list.
    fn carry(&mut self, old: &Self, slots: &Slots, threads: &Threads) {
        let key = |pair: K::Pair| K::key(pair, Some).expect("every slot is one");
        let (pairs, all) = (&old.pairs, &self.pairs);
        self.history.resize(all.len(), Default::default());
        let chunks = all.chunks(CHUNK).zip(self.history.chunks_mut(CHUNK));
        threads.each(chunks, |(new, histories)| {
            let mut at = 0;
            for (&pair, history) in new.iter().zip(histories) {
                *history = Default::default();
                let Some(wanted) = K::key(pair, |slot| slots.before(slot)) else {
                    continue;
                };
                // Mostly it is the one after the last one.
                if pairs.get(at).is_none_or(|&next| key(next) != wanted) {
                    at = pairs.partition_point(|&other| key(other) < wanted);
                }
                if pairs.get(at).is_some_and(|&next| key(next) == wanted) {
                    history.clone_from(&old.history[at]);
                    at += 1;
                }
            }
        });
    }
}

/// Contacts by the law `L` of pairs of the kind `K`.
#[derive(Debug)]
pub struct Contacts<K: PairKind, L: Law> {
    law: L,
    kind: K,
    kept: Kept<K, L>,
    /// Room for the next list.
    spare: Kept<K, L>,
    next: Vec<(L::History, K::Memory)>,
    rooms: Spare<K::Room<L>>,
    /// The results of each chunk.
    found: Vec<K::Found>,
    added: Vec<K::Added>,
    sums: Sums,
    /// The argument of the last evaluation.
    interval: Interval,
    /// Constants of the dashpots in reach.
    damping: Damping,
    shares: Shares,
}

impl<K: PairKind, L: Law> Contacts<K, L> {
    /// No list yet.
    pub fn new(law: L, kind: K, skin: f64) -> Self {
        Self {
            law,
            kind,
            kept: Kept::new(K::Watch::new(skin), Vec::new()),
            spare: Kept::new(K::Watch::new(skin), Vec::new()),
            next: Vec::new(),
            rooms: Spare::default(),
            found: Vec::new(),
            added: Vec::new(),
            sums: Sums::default(),
            interval: Interval::default(),
            damping: Damping::default(),
            shares: Shares::default(),
        }
    }

    /// Finds [`Side::damping`] after an evaluation.
    fn find_damping(&mut self, bodies: &Bodies) {
        self.damping = Damping::default();
        if self.sums.in_reach == 0 {
            return;
        }
        self.damping = self.kept.damping;
        if K::POINTS > 0 || self.damping.delay.is_finite() {
            return;
        }
        // Most pairs of a list are out of reach, and nothing else bounds the dashpots of springs that stiffen.
        let mut shares = std::mem::take(&mut self.shares);
        shares.clear(bodies);
        for ((found, pairs), constants) in self.results().zip(self.kept.constants.chunks(CHUNK)) {
            let margins = (&self.kept.watch, self.interval.closing);
            K::each_near(found, pairs, bodies, margins, |number, near| {
                let [_, squares] = self.law.dashpots(&constants[number]);
                shares.add(bodies, near, squares);
            });
        }
        self.damping.own = self.damping.own.min(shares.largest());
        self.shares = shares;
    }

    fn chunk<'a>(&'a self, on: On<'a, K>, number: usize) -> Chunk<'a, K, L> {
        let now = &self.kept;
        let from = number * CHUNK;
        let here = from..now.history.len().min(from + CHUNK);
        Chunk {
            on,
            law: &self.law,
            number,
            pairs: &now.pairs[here.clone()],
            constants: &now.constants[here.clone()],
            mobility: &now.mobility[here.clone()],
            history: &now.history[here],
        }
    }

    /// The results of each chunk, and its pairs.
    fn results(&self) -> impl Iterator<Item = (&K::Found, &[K::Pair])> {
        self.found.iter().zip(self.kept.pairs.chunks(CHUNK))
    }
}

impl<K: PairKind, L: Law> Side for Contacts<K, L> {
    fn update_list(&mut self, now: &Now, threads: &Threads) {
        if self.kept.watch.holds(now, K::POINTS) {
            return;
        }
        let slots = Slots::of(now.sets);
        self.spare.watch.begin(&self.kept.watch, now, &slots);
        let among = Among {
            bodies: now.bodies,
            set: &now.sets.now,
            threads,
        };
        self.spare.build(&self.law, &self.kind, &among);
        self.spare.carry(&self.kept, &slots, threads);
        std::mem::swap(&mut self.kept, &mut self.spare);
    }

    fn evaluate(&mut self, now: &Now, interval: Interval, threads: &Threads, to: &mut Targets) {
        let look = self.kept.watch.look(interval.closing);
        let mut next = std::mem::take(&mut self.next);
        let mut found = std::mem::take(&mut self.found);
        let mut added = std::mem::take(&mut self.added);
        next.resize(self.kept.history.len(), Default::default());
        let opening = Moves::opening(now.bodies, interval.last_step);
        let moves = Moves::of(now.bodies, interval.last_step, &opening);
        let on = On {
            kind: &self.kind,
            bodies: now.bodies,
            set: &now.sets.now,
            states: now.states,
            pairs: &self.kept.pairs,
            extra: &self.kept.extra,
            watch: &self.kept.watch,
            interval,
            moves,
            look,
        };
        let evaluate = |i: usize, (next, found): (&mut [_], _), added: &mut K::Added| {
            let mut room = self.rooms.take();
            K::evaluate(&self.chunk(on, i), &mut room, next, (found, added));
            self.rooms.give_back(room);
        };
        let mut sums = Sums::default();
        let add = |added: &K::Added| K::add(&on, added, to, &mut sums);
        found.resize_with(next.len().div_ceil(CHUNK), K::Found::default);
        let places = next.chunks_mut(CHUNK).zip(&mut found);
        chunks(threads, places, &mut added, evaluate, add);
        (self.next, self.found, self.added) = (next, found, added);
        (self.sums, self.interval) = (sums, interval);
        self.find_damping(now.bodies);
    }

    fn sums(&self) -> &Sums {
        &self.sums
    }

    /// `max over contacts (Lambda_A + Lambda_B)`, with `Lambda` the trace of each body's own `M^-1 K`. In contact space
    /// the operator is a sum of positive semidefinite parts, one for each body. The part of body `b` acts on the
    /// contacts of that body, and its norm is at most `Lambda_b`. So the Rayleigh quotient of a vector `x` is at most
    /// `sum_b Lambda_b |x on b's contacts|^2 / |x|^2`, and this is at most the largest `Lambda_A + Lambda_B` of one
    /// contact. The bound is exact for two bodies and one contact.
    fn omega(&self, after: &AfterKick, threads: &Threads) -> [f64; 2] {
        let all = Mutex::new([0.0_f64; 2]);
        threads.each(self.results(), |(found, pairs)| {
            let known = || all.lock().expect("nobody panics while he holds it");
            let before = *known();
            let now = K::rates(found, pairs, before, after, self.sums.stiffest);
            // The largest of all does not depend on the order.
            let mut known = known();
            *known = [known[0].max(now[0]), known[1].max(now[1])];
        });
        let [stiff, impact] = all.into_inner().expect("likewise");
        let mut largest = stiff.max(after.impacts.count * impact).sqrt();
        let most = K::fastest_crossing(&self.kept.extra, after.impacts.speed);
        let most = most.max(turning_rate(after.spin));
        if most <= largest || self.sums.in_reach == 0 {
            return [largest, stiff];
        }
        let constants = self.kept.constants.chunks(CHUNK);
        for ((found, pairs), constants) in self.results().zip(constants) {
            let margins = (&self.kept.watch, self.interval.closing);
            K::each_near(found, pairs, after.bodies, margins, |number, near| {
                let kicked = after.impacts.kicked;
                largest = largest.max(crossing_rate(after.bodies, kicked, near));
                let stiffness = self.law.stiffness(&constants[number], near.length);
                if stiffness.tangential + stiffness.rolling > 0.0 {
                    let [a, b] = near.bodies.map(|b| turning_rate(kicked[b as usize].1));
                    largest = largest.max(a).max(b);
                }
            });
        }
        [largest, stiff]
    }

    fn damping(&self) -> Damping {
        self.damping
    }

    fn commit(&mut self) {
        std::mem::swap(&mut self.kept.history, &mut self.next);
        self.kept.watch.commit();
    }

    fn advance(&mut self, speed: f64, dt: f64) {
        self.kept.watch.advance(speed, dt);
    }

    fn save(&self) -> Vec<u8> {
        let Kept { watch, history, .. } = &self.kept;
        let history = history
            .iter()
            .map(|(of_law, memory)| (All::of(of_law), memory));
        let history: Vec<_> = history.collect();
        pack("contacts", &(watch, history))
    }

    fn restore(&mut self, saved: &[u8], bodies: &Bodies, sets: &Sets) -> Result<(), Refusal> {
        type State<K> = (<K as Listing>::Watch, Vec<(All, <K as PairKind>::Memory)>);
        let (watch, history): State<K> = unpack("contacts", saved)?;
        let own = |(all, memory)| (L::History::take(&all), memory);
        let history = history.into_iter().map(own).collect();
        let mut kept = Kept::<K, L>::new(watch, history);
        if let Some(then) = kept.watch.bodies_then(bodies) {
            let among = Among {
                bodies: &then,
                set: sets.replaced.as_ref().unwrap_or(&sets.now),
                threads: &Threads::default(),
            };
            kept.build(&self.law, &self.kind, &among);
        }
        let (found, expected) = (kept.history.len(), kept.pairs.len());
        if found != expected {
            let text = format!("the saved state has {found} pairs in a list, expected {expected}");
            return Err(refusal(text));
        }
        self.kept = kept;
        Ok(())
    }
}

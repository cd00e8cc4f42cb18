//! The energy ledger and the momentum balance of both sides together (docs/physics.md section 7).

use interface::message::wire::{BodyState, GroupState, Ledger};
use serde::{Deserialize, Serialize};

/// The energies of both sides, one a line: what it is, its name, its value for the ledgers of continuum and bodies.
macro_rules! energies {
    ($($(#[$doc:meta])* $name:ident, $value:expr;)*) => {
        /// Energies of both sides at one time in J/m, as `summary.json` has them.
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
        pub struct Energies {
            $($(#[$doc])* pub $name: f64,)*
        }

        impl Energies {
            fn of(mpm: &Ledger, dem: &Ledger) -> Self {
                let sum = |value: fn(&Ledger) -> f64| value(mpm) + value(dem);
                Self { $($name: sum($value),)* }
            }

            /// Every part with its name, in J/m.
            pub fn parts(&self) -> [(&'static str, f64); 12] {
                [$((stringify!($name), self.$name),)*]
            }
        }
    };
}

energies! {
    /// Kinetic energy of points and of the bodies' translation.
    kinetic, |l| l.kinetic;
    /// Kinetic energy of the bodies' rotation.
    rotation, |l| l.kinetic_rotation;
    /// Elastic energy of the points.
    elastic, |l| l.elastic;
    /// Potential energy of gravity.
    gravity, |l| l.gravity;
    /// Energy in contact springs.
    contact, |l| l.contact;
    /// Dissipated by friction.
    friction, |l| l.friction_work;
    /// Dissipated by viscosity.
    viscous, |l| l.viscous_work;
    /// Dissipated by plastic flow.
    plastic, |l| l.plastic_work;
    /// Taken from the motion by the transfer between points and nodes; below zero if it has given more than it took.
    transfer, |l| l.transfer_work;
    /// Work put in by driven bodies and boundaries.
    driven, |l| l.driven_work;
    /// Conserved except for the residual of the transfer scheme: energies held, plus energies dissipated, minus work
    /// put in.
    total, total;
    /// Work of the stress of the points so far, less what plastic flow and viscous stress took; 0 for a continuum
    /// without the capability `stress_work`. It is not part of the total: if the law has an energy, it grows as
    /// `elastic` does.
    stress_work, |l| l.stress_work;
}

impl Energies {
    /// Energy in play: all energies, with gravity counted from its value at the start, so that the choice of the origin
    /// does not matter. That of contacts that adhere may be below zero.
    fn in_play(&self, start: &Self) -> f64 {
        let held = self.kinetic + self.rotation + self.elastic + self.contact.abs();
        let lost = self.friction + self.viscous + self.plastic + self.transfer.max(0.0);
        held + lost + (self.gravity - start.gravity).abs() + self.driven.abs()
    }
}

/// What one side conserves apart from the residual of the transfer scheme, in J/m: energies held, plus energy dissipated,
/// minus work put in.
fn total(side: &Ledger) -> f64 {
    side.kinetic
        + side.kinetic_rotation
        + side.elastic
        + side.gravity
        + side.contact
        + side.friction_work
        + side.viscous_work
        + side.plastic_work
        // A transfer that gives has created energy, which is a residual and no loss.
        + side.transfer_work.max(0.0)
        - side.driven_work
}

/// `part` over `whole`, 0 of nothing.
fn share(part: f64, whole: f64) -> f64 {
    if part == 0.0 { 0.0 } else { part / whole }
}

/// Created energy above this share of the energy in play is reported.
pub const TOLD: f64 = 0.01;

/// Says how much energy the computation has created, as a share of the energy in play; `None` if that is little.
pub fn created_words(created: f64) -> Option<String> {
    (created > TOLD).then(|| {
        format!(
            "{:.2} % of the energy in play was created numerically",
            100.0 * created
        )
    })
}

/// The balance so far.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Balance {
    start: Option<(Energies, [f64; 3])>,
    /// Whether the continuum keeps the work of its stress (capability `stress_work`).
    pub keeps_stress_work: bool,
    /// Whether points go round through periodic walls, so that no angular momentum is kept.
    pub goes_round: bool,
    /// Energies at the last measurement.
    pub now: Energies,
    /// Total minus the total at the start in J/m.
    pub residual: f64,
    /// Largest energy in play so far in J/m.
    pub scale: f64,
    /// Largest positive residual so far relative to [`Self::scale`].
    pub residual_max: f64,
    /// Largest positive residual so far in J/m.
    created: f64,
    /// Largest momentum so far in N s/m: that of all motion ([`Moving::momentum`]), or the impulse of contact or from outside.
    momentum_scale: f64,
    /// Total momentum at the last measurement, minus the initial one and the applied impulses, relative to the largest
    /// momentum so far.
    pub momentum_error: f64,
    /// Largest of these so far.
    pub momentum_error_max: f64,
    /// Largest angular momentum so far in N s, about the centre of mass: the sum over all groups and bodies, or that of a side, or
    /// the moment of contact or from outside.
    angular_momentum_scale: f64,
    /// Its change at the last measurement, minus the moments from outside, and the largest so far, in N s.
    angular_momentum_gap: [f64; 2],
}

/// How all groups and bodies move.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moving {
    /// Sum of `sqrt(2 m E)` of their kinetic energies in N s/m: of their momenta, had all their motion one direction. So what
    /// cancels counts too, between them and within what swings or spins.
    pub momentum: f64,
    /// Sum of the same in N s, each times the distance of its centre from [`Self::centre`] and its radius of gyration; of groups,
    /// half their diagonal.
    pub angular_momentum: f64,
    /// Centre of mass in m.
    pub centre: [f64; 2],
}

impl Moving {
    /// Of these groups and bodies.
    pub fn of(groups: &[GroupState], bodies: &[BodyState]) -> Self {
        let groups = groups.iter().map(|g| {
            let [x, y] = [0, 1].map(|a| 0.5 * (g.upper[a] - g.lower[a]));
            (g.mass, g.position, g.mass * (x * x + y * y), g.kinetic)
        });
        let bodies = bodies.iter().map(|b| {
            let [x, y] = b.velocity;
            let kinetic = 0.5 * (b.mass * (x * x + y * y) + b.inertia * b.spin * b.spin);
            (b.mass, b.position, b.inertia, kinetic)
        });
        let all = groups.chain(bodies);
        let mass: f64 = all.clone().map(|(mass, ..)| mass).sum();
        let centre = [0, 1].map(|a| {
            let sum: f64 = all.clone().map(|(mass, x, ..)| mass * x[a]).sum();
            sum / mass.max(f64::MIN_POSITIVE)
        });
        let mut moving = Self {
            centre,
            ..Self::default()
        };
        for (mass, x, inertia, kinetic) in all {
            let momentum = (2.0 * mass * kinetic).sqrt();
            let arm = (x[0] - centre[0]).hypot(x[1] - centre[1]);
            moving.momentum += momentum;
            moving.angular_momentum += momentum * arm + (2.0 * inertia * kinetic).sqrt();
        }
        moving
    }

    /// The moment about the centre in N s of an impulse (N s/m) that has the moment `of` about the origin.
    fn moment(&self, of: f64, [x, y]: [f64; 2]) -> f64 {
        of - (self.centre[0] * y - self.centre[1] * x)
    }
}

impl Balance {
    /// Takes a measurement of both sides, of the same step.
    pub fn take(&mut self, mpm: &Ledger, dem: &Ledger, moving: &Moving) {
        self.now = Energies::of(mpm, dem);
        let [x, y] = std::array::from_fn(|i| {
            mpm.momentum[i] + dem.momentum[i] - mpm.applied_impulse[i] - dem.applied_impulse[i]
        });
        let turning = mpm.angular_momentum + dem.angular_momentum;
        let unbalanced = [x, y, turning - mpm.applied_moment - dem.applied_moment];
        let (start, unbalanced_start) = *self.start.get_or_insert((self.now, unbalanced));
        self.residual = self.now.total - start.total;
        self.scale = self.scale.max(self.now.in_play(&start));
        self.residual_max = self.residual_max.max(self.residual_relative());
        self.created = self.created.max(self.residual);
        self.momentum_scale = self.momentum_scale.max(moving.momentum);
        self.angular_momentum_scale = self.angular_momentum_scale.max(moving.angular_momentum);
        for side in [mpm, dem] {
            for (seen, moment) in [
                (side.momentum, side.angular_momentum),
                (side.applied_impulse, side.applied_moment),
                (side.contact_impulse, side.contact_moment),
            ] {
                self.momentum_scale = self.momentum_scale.max(seen[0].hypot(seen[1]));
                let about_centre = moving.moment(moment, seen).abs();
                self.angular_momentum_scale = self.angular_momentum_scale.max(about_centre);
            }
        }
        let error =
            (unbalanced[0] - unbalanced_start[0]).hypot(unbalanced[1] - unbalanced_start[1]);
        self.momentum_error = share(error, self.momentum_scale);
        self.momentum_error_max = self.momentum_error_max.max(self.momentum_error);
        let gap = (unbalanced[2] - unbalanced_start[2]).abs();
        self.angular_momentum_gap = [gap, gap.max(self.angular_momentum_gap[1])];
    }

    /// Change of the angular momentum at the last measurement, minus the moments from outside, and the largest so far, relative to the
    /// largest angular momentum so far; `None` if points go round.
    pub fn angular_momentum_error(&self) -> Option<[f64; 2]> {
        let relative = |gap| share(gap, self.angular_momentum_scale);
        (!self.goes_round).then_some(self.angular_momentum_gap.map(relative))
    }

    /// Energies at the first measurement.
    pub fn start(&self) -> Energies {
        self.start.map(|(energies, _)| energies).unwrap_or_default()
    }

    /// Work of the stress that is neither stored nor dissipated, in J/m. If it is positive, the law has taken it from
    /// the motion; if it is negative, the law has created it. `None` if the continuum does not report that work.
    pub fn work_gap(&self) -> Option<f64> {
        let start = self.start();
        let stored = self.now.elastic - start.elastic;
        let done = self.now.stress_work - start.stress_work;
        self.keeps_stress_work.then_some(done - stored)
    }

    /// The same relative to the largest energy in play so far.
    pub fn work_gap_relative(&self) -> Option<f64> {
        self.work_gap().map(|gap| share(gap, self.scale))
    }

    /// The most that was created relative to the largest energy in play: by the end of a run that begins with nothing, also
    /// what its first rows divide by hardly any energy is small.
    pub fn created_relative(&self) -> f64 {
        share(self.created, self.scale)
    }

    /// What the transfer has taken relative to the largest energy in play so far.
    pub fn transfer_relative(&self) -> f64 {
        share(self.now.transfer, self.scale)
    }

    /// The residual relative to the largest energy in play so far.
    pub fn residual_relative(&self) -> f64 {
        share(self.residual, self.scale)
    }
}

/// The point from which sums are counted. If a scene begins with the state of another run, its sums begin with its
/// first measurement, under its own laws.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub enum Since {
    /// From the start of the first run.
    #[default]
    Ever,
    /// From the next measurement.
    Next,
    /// From these values, of the continuum, of the bodies and of each chain.
    Here(Vec<f64>),
}

/// The sums of a side: work of friction, viscosity, plastic flow, drives, stress and transfer in J/m, then moments and impulses
/// from outside and of contact.
fn sums(side: &mut Ledger) -> [&mut f64; 12] {
    let [outside_x, outside_y] = &mut side.applied_impulse;
    let [contact_x, contact_y] = &mut side.contact_impulse;
    [
        &mut side.friction_work,
        &mut side.viscous_work,
        &mut side.plastic_work,
        &mut side.driven_work,
        &mut side.stress_work,
        &mut side.transfer_work,
        &mut side.applied_moment,
        &mut side.contact_moment,
        outside_x,
        outside_y,
        contact_x,
        contact_y,
    ]
}

impl Since {
    /// The ledgers of both sides with their sums since then; those of chains are changed in place.
    pub fn count(&mut self, mut sides: [Ledger; 2], chains: &mut [GroupState]) -> [Ledger; 2] {
        // In place of kinetic energy a chain has its angular shift.
        let shifts = chains.iter_mut().map(|chain| &mut chain.kinetic);
        let sums: Vec<&mut f64> = sides.iter_mut().flat_map(sums).chain(shifts).collect();
        if *self == Self::Next {
            *self = Self::Here(sums.iter().map(|sum| **sum).collect());
        }
        if let Self::Here(before) = self {
            for (sum, before) in sums.into_iter().zip(before) {
                *sum -= *before;
            }
        }
        sides
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving(momentum: f64) -> Moving {
        Moving {
            momentum,
            ..Moving::default()
        }
    }

    /// A measurement of a side alone.
    fn take(balance: &mut Balance, side: Ledger) {
        balance.take(&side, &Ledger::default(), &Moving::default());
    }

    #[test]
    fn the_origin_of_gravity_does_not_matter() {
        let fall = |offset: f64| {
            let mut balance = Balance::default();
            for (gravity, kinetic) in [(offset + 10.0, 0.0), (offset, 10.1)] {
                let side = Ledger {
                    gravity,
                    kinetic,
                    ..Ledger::default()
                };
                take(&mut balance, side);
            }
            balance.residual_relative()
        };
        assert!((fall(0.0) - fall(-1e3)).abs() < 1e-9);
        assert!((fall(0.0) - 0.1 / 20.1).abs() < 1e-12);
    }

    #[test]
    fn what_the_transfer_takes_is_named_and_what_it_gives_is_created() {
        let point = |kinetic: f64, transfer_work: f64| Ledger {
            kinetic,
            transfer_work,
            ..Ledger::default()
        };
        let mut balance = Balance::default();
        for (kinetic, taken, residual) in [(4.0, 0.0, 0.0), (3.0, 1.0, 0.0), (5.0, -1.0, 1.0)] {
            take(&mut balance, point(kinetic, taken));
            assert_eq!(balance.residual, residual);
            assert_eq!(balance.now.transfer, taken);
        }
        assert_eq!(balance.residual_max, 0.2);
    }

    #[test]
    fn created_energy_is_told_from_a_hundredth_on() {
        assert_eq!(created_words(0.01), None);
        let words = created_words(0.1234).unwrap();
        assert!(
            words.starts_with("12.34 % of the energy in play"),
            "{words}"
        );
    }

    #[test]
    fn sums_of_a_branch_begin_with_its_first_measurement() {
        let side = |friction_work: f64| Ledger {
            kinetic: 2.0,
            friction_work,
            applied_impulse: [friction_work, 1.0],
            ..Ledger::default()
        };
        let mut since = Since::Next;
        let count = |since: &mut Since, friction_work, kinetic| {
            let mut chains = [GroupState {
                kinetic,
                ..GroupState::default()
            }];
            let [first, _] = since.count([side(friction_work), side(0.0)], &mut chains);
            (first, chains[0].kinetic)
        };
        let (first, shift) = count(&mut since, 3.0, 5.0);
        assert_eq!((first.kinetic, first.friction_work, shift), (2.0, 0.0, 0.0));
        let (later, shift) = count(&mut since, 3.5, 4.0);
        assert_eq!((later.friction_work, shift), (0.5, -1.0));
        assert_eq!(later.applied_impulse, [0.5, 0.0]);
        assert_eq!(count(&mut Since::Ever, 3.5, 4.0), (side(3.5), 4.0));
    }

    #[test]
    fn momentum_that_an_impulse_explains_is_no_error() {
        let mut balance = Balance::default();
        take(&mut balance, Ledger::default());
        let given = Ledger {
            momentum: [3.0, 4.0],
            applied_impulse: [3.0, 4.0],
            angular_momentum: 8.0,
            applied_moment: 8.0,
            ..Ledger::default()
        };
        take(&mut balance, given);
        assert_eq!(balance.momentum_error, 0.0);
        let lost = Ledger {
            momentum: [3.0, 3.0],
            angular_momentum: 6.0,
            ..given
        };
        assert_eq!(balance.angular_momentum_error(), Some([0.0; 2]));
        take(&mut balance, lost);
        assert_eq!(balance.momentum_error, 0.2);
        assert_eq!(balance.momentum_error_max, 0.2);
        assert_eq!(balance.angular_momentum_error(), Some([0.25; 2]));
        balance.goes_round = true;
        assert_eq!(balance.angular_momentum_error(), None);
    }

    /// Two equal bodies fly apart or together. The momentum of their side is only rounding, and so is its change.
    #[test]
    fn rounding_of_momenta_that_cancel_is_no_error() {
        let bodies = |rounding: f64| Ledger {
            momentum: [rounding, 0.0],
            ..Ledger::default()
        };
        let mut balance = Balance::default();
        balance.take(&Ledger::default(), &bodies(1e-16), &moving(2.0 * 3.0));
        balance.take(&Ledger::default(), &bodies(-4e-16), &moving(2.0 * 3.0));
        assert!(balance.momentum_error_max < 1e-16);
        // Energy that is really lost is still found.
        balance.take(&Ledger::default(), &bodies(6e-3), &moving(2.0 * 3.0));
        assert!((balance.momentum_error - 1e-3).abs() < 1e-15);
    }

    /// Two bodies that adhere swing: what is created counts against the energy of their contact, which is below zero.
    #[test]
    fn energy_below_zero_is_in_play() {
        let bodies = |contact: f64, kinetic: f64| Ledger {
            contact,
            kinetic,
            ..Ledger::default()
        };
        let mut balance = Balance::default();
        take(&mut balance, bodies(-4.0, 0.0));
        take(&mut balance, bodies(-3.75, 0.5));
        assert_eq!(balance.residual_max, 0.75 / 4.25);
    }

    /// A group and a body that turn in place have no momentum, but motion to compare rounding with.
    #[test]
    fn what_turns_in_place_has_a_scale_of_momentum() {
        let group = GroupState {
            mass: 2.0,
            kinetic: 4.0,
            ..GroupState::default()
        };
        let body = BodyState {
            mass: 2.0,
            inertia: 8.0,
            spin: -1.0,
            ..BodyState::default()
        };
        assert_eq!(Moving::of(&[group], &[]).momentum, 4.0);
        let body = Moving::of(&[], &[body]);
        assert_eq!((body.momentum, body.angular_momentum), (4.0, 8.0));
    }

    /// A load rests on points. Momenta are only rounding, and the impulses of weight and support balance.
    #[test]
    fn rounding_of_impulses_that_balance_is_no_error() {
        let side = |impulse: f64, rounding: f64| Ledger {
            momentum: [0.0, rounding],
            applied_impulse: [0.0, -impulse],
            contact_impulse: [0.0, impulse],
            ..Ledger::default()
        };
        let mut balance = Balance::default();
        balance.take(&side(0.0, 0.0), &side(0.0, 0.0), &Moving::default());
        balance.take(&side(1e3, 1e-13), &side(-1e3, 0.0), &moving(1e-13));
        assert!(balance.momentum_error_max < 1e-15);
    }

    /// A prestressed body does work of 3 J/m, of which its energy contains 2.
    #[test]
    fn work_that_is_not_stored_is_a_line_of_its_own() {
        let ledger = |elastic: f64, stress_work: f64, kinetic: f64| Ledger {
            elastic,
            stress_work,
            kinetic,
            ..Ledger::default()
        };
        let mut balance = Balance {
            keeps_stress_work: true,
            ..Balance::default()
        };
        take(&mut balance, ledger(5.0, 0.0, 0.0));
        take(&mut balance, ledger(3.0, -3.0, 3.0));
        assert_eq!(balance.work_gap(), Some(-1.0));
        assert_eq!(balance.work_gap_relative(), Some(-1.0 / 6.0));
        // Energy that the law creates is in the residual too.
        assert_eq!(balance.residual, 1.0);
        balance.keeps_stress_work = false;
        assert_eq!(balance.work_gap(), None);
    }
}

//! Energies, momenta and impulses (docs/physics.md section 7). Impulses are counted in every step, the rest only where a step
//! is measured.

use interface::impulse::at;
use interface::message::wire::GroupState;
use interface::solver::MpmMeasurement;
use interface::step::Step;

use super::markers::add_shift;
use crate::kernel::lanes::{Lanes, ZERO, largest, smallest, splat, sum};
use crate::kernel::point_tile::Tile;
use crate::kernel::shape::Shape;
use crate::kernel::transfer::AffineState;
use crate::state::continuum::Continuum;
use crate::state::imps::Imps;
use crate::state::markers::Markers;
use crate::state::point_set::PointSet;
use crate::state::points::{Cloud, StressReport, TileReport};
use crate::state::totals::KickWork;

/// Sums over the points of a cloud.
#[derive(Debug, Clone, Copy, Default)]
pub struct Motions {
    /// Momentum in N s/m.
    pub momentum: [f64; 2],
    kinetic: f64,
}

/// Counts the impulses of the step. If the step is measured, takes the quantities at `t_n` and `t_{n-1/2}`.
pub fn update_ledger<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    step: &Step,
) {
    let kick = step.kick();
    continuum.kick = KickWork::default();
    if step.dt_before + step.dt > 0.0 {
        let mass: f64 = continuum.clouds.iter().map(Cloud::total_mass).sum();
        let (gravity, mut moment) = (continuum.grid.gravity, 0.0);
        if gravity != [0.0; 2] {
            let sums = continuum.clouds.iter().map(Cloud::mass_times_place);
            moment = sums.map(|sum| at(sum, gravity)[2]).sum();
        }
        let [x, y] = gravity.map(|g| kick * mass * g);
        continuum.state.totals.applied_impulse += [x, y, kick * moment];
        for tile in &continuum.grid.tiles {
            continuum.state.totals.applied_impulse += tile.wall.impulse;
            continuum.kick.driven += tile.wall.work;
            continuum.kick.friction += tile.lost_by_friction();
            continuum.kick.transfer += tile.smoothing_work;
        }
        continuum.state.totals.applied_impulse += continuum.holds.impulse;
        if continuum.books_kick() {
            let of_nodes = continuum.grid.tiles.iter();
            let gained = of_nodes.map(|tile| tile.gained() + tile.lost_by_damping());
            continuum.kick.transfer += gained.sum::<f64>() + continuum.kinetic_of_points();
        }
    }
    let ahead = core::mem::take(&mut continuum.state.totals.ahead);
    let totals = &mut continuum.state.totals;
    let mut add = |[plastic, viscous, work]: [f64; 3]| {
        totals.plastic_work += plastic;
        totals.viscous_work += viscous;
        totals.stress_work += work - plastic - viscous;
    };
    add(ahead);
    for cloud in &continuum.clouds {
        for loss in losses_of_tiles(&cloud.state.stress_reports, cloud.volume) {
            add(loss);
        }
    }
    let (mut contact_force, mut moment) = ([0.0; 2], 0.0);
    for (m, f) in (continuum.imps.state.members.iter()).zip(&continuum.imps.forces) {
        if f.force == [0.0; 2] && f.couple == 0.0 {
            continue; // most points: no body presses on them
        }
        for a in 0..2 {
            contact_force[a] += f.force[a];
        }
        let place = continuum.imps.position(*m, &continuum.clouds);
        moment += at(place, f.force)[2] + f.couple;
    }
    let [x, y] = contact_force;
    continuum.state.totals.contact_impulse += [x, y, moment].map(|f| kick * f);
    add_shift(continuum, kick);
    if step.measure {
        measure(continuum, contact_force, 1.0 - step.centring());
        measure_sets(continuum, kick, 1.0 - step.centring());
    }
}

/// Counts the impulse of points that damp their own velocities, as the filter of the transfer has left them.
pub fn count_damping_of_points<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    if let Some(damping) = continuum.damping_of_points() {
        let own = 1.0 - continuum.transfer.pic_fraction;
        let impulse = damping.beyond_nodes(&continuum.clouds, &continuum.grid, own);
        continuum.state.totals.applied_impulse += impulse;
    }
}

/// Adds up the reports of a stress update at the end of the step, before the points are sorted into other tiles.
pub fn sum_stress_ahead<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
) {
    let mut ahead = [0.0; 3];
    for cloud in &mut continuum.clouds {
        for loss in losses_of_tiles(&cloud.state.stress_reports, cloud.volume) {
            for (sum, of_tile) in ahead.iter_mut().zip(loss) {
                *sum += of_tile;
            }
        }
        for report in &mut cloud.state.stress_reports {
            (report.lost, report.work) = ([0.0; 2], 0.0);
        }
    }
    continuum.state.totals.ahead = ahead;
}

/// If the step is measured, takes the quantities at `t_{n+1/2}`.
pub fn close_ledger<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    step: &Step,
) {
    if step.dt_before + step.dt > 0.0 {
        let of_points = |taken: fn(&TileReport) -> f64| {
            let of_cloud = |cloud: &Cloud<W, S, A>| {
                0.5 * cloud.mass * cloud.reports.iter().map(taken).sum::<f64>()
            };
            continuum.clouds.iter().map(of_cloud).sum::<f64>()
        };
        let [taken, damped] = [|r: &TileReport| r.taken, |r: &TileReport| r.damped].map(of_points);
        if let Some(damping) = continuum.damping {
            // What walls have taken of the nodes counts as a force.
            let by_walls = continuum.kick.driven - continuum.kick.friction;
            continuum.kick.damping = damped - damping.beside(by_walls);
        }
        if continuum.books_kick() {
            continuum.kick.transfer -= continuum.kick.damping + continuum.kinetic_of_points();
        } else {
            continuum.kick.transfer += taken;
        }
    }
    let kick = continuum.kick;
    if step.measure {
        close_measurement(continuum, step.centring());
        // At t_n the kick counts with the same share as the velocities.
        let ledger = &mut continuum.measurement.ledger;
        ledger.applied_impulse = continuum.state.totals.applied_impulse.value();
        ledger.applied_moment = continuum.state.totals.applied_impulse.moment();
        ledger.friction_work += step.centring() * kick.friction;
        ledger.viscous_work += step.centring() * kick.damping;
        ledger.driven_work += step.centring() * kick.driven;
        ledger.transfer_work += step.centring() * kick.transfer;
    }
    continuum.state.totals.friction_work += kick.friction;
    continuum.state.totals.viscous_work += kick.damping;
    continuum.state.totals.driven_work += kick.driven;
    continuum.state.totals.transfer_work += kick.transfer;
}

impl<const W: usize, S: Shape<W>, A: AffineState> Continuum<W, S, A> {
    /// In J/m.
    fn kinetic_of_points(&self) -> f64 {
        self.clouds
            .iter()
            .map(|cloud| cloud.motions().kinetic)
            .sum()
    }
}

/// Takes the quantities at `t_{n+1/2}`, with the weight `after`.
fn close_measurement<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    after: f64,
) {
    let MpmMeasurement { ledger, groups } = &mut continuum.measurement;
    let (groups, sets) = groups.split_at_mut(continuum.clouds.len());
    let holds = continuum.holds.all.iter().map(|hold| &hold.points);
    for (set, state) in continuum.probes.iter().chain(holds).zip(sets) {
        let (velocity, kinetic) = set.motion(&continuum.clouds[set.cloud as usize]);
        state.kinetic += after * kinetic;
        for a in 0..2 {
            state.velocity[a] += after * velocity[a];
        }
    }
    (ledger.momentum, ledger.angular_momentum) = ([0.0; 2], 0.0);
    let cell = continuum.grid.geometry.cell;
    for (cloud, group) in continuum.clouds.iter().zip(groups) {
        let motions = cloud.motions();
        let kinetic = after * motions.kinetic;
        group.kinetic += kinetic;
        ledger.angular_momentum += cloud.angular_momentum(cell);
        ledger.kinetic += kinetic;
        for a in 0..2 {
            let mass = group.mass.max(f64::MIN_POSITIVE);
            group.velocity[a] += after * motions.momentum[a] / mass;
            ledger.momentum[a] += motions.momentum[a];
        }
    }
}

/// Starts a measurement; quantities at `t_{n-1/2}` get the weight `before`.
fn measure<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    contact_force: [f64; 2],
    before: f64,
) {
    let MpmMeasurement { ledger, groups } = &mut continuum.measurement;
    *ledger = interface::message::wire::Ledger {
        friction_work: continuum.state.totals.friction_work,
        driven_work: continuum.state.totals.driven_work,
        plastic_work: continuum.state.totals.plastic_work,
        viscous_work: continuum.state.totals.viscous_work,
        stress_work: continuum.state.totals.stress_work,
        transfer_work: continuum.state.totals.transfer_work,
        applied_impulse: continuum.state.totals.applied_impulse.value(),
        contact_impulse: continuum.state.totals.contact_impulse.value(),
        applied_moment: continuum.state.totals.applied_impulse.moment(),
        contact_moment: continuum.state.totals.contact_impulse.moment(),
        contact_force,
        ..Default::default()
    };
    groups.clear();
    for cloud in &continuum.clouds {
        let motions = cloud.motions();
        let mut group = cloud.extent();
        group.kinetic = before * motions.kinetic;
        // A group whose points have all been removed has no velocity.
        let mass = group.mass.max(f64::MIN_POSITIVE);
        group.velocity = motions.momentum.map(|p| before * p / mass);
        ledger.kinetic += group.kinetic;
        ledger.elastic += cloud
            .tiles
            .iter()
            .map(|t| cloud.elastic_energy(t))
            .sum::<f64>();
        let [gx, gy] = continuum.grid.gravity;
        ledger.gravity -= group.mass * (gx * group.position[0] + gy * group.position[1]);
        groups.push(group);
    }
    for (m, f) in continuum
        .imps
        .state
        .members
        .iter()
        .zip(&continuum.imps.forces)
    {
        if f.force != [0.0; 2] {
            ledger.contacts += 1;
            let x = continuum.imps.position(*m, &continuum.clouds);
            count_contact(&mut groups[m.cloud as usize], f.force, x);
        }
    }
}

/// Adds a record for each probe and each hold to those of the groups; `kick` is the length of the kick in s.
fn measure_sets<const W: usize, S: Shape<W>, A: AffineState>(
    continuum: &mut Continuum<W, S, A>,
    kick: f64,
    before: f64,
) {
    let Continuum {
        clouds,
        imps,
        probes,
        holds,
        measurement,
        ..
    } = continuum;
    let groups = &mut measurement.groups;
    let mut report = |set: &PointSet, support: Option<[f64; 2]>| {
        let cloud = &clouds[set.cloud as usize];
        let mut state = set.extent(cloud);
        let (velocity, kinetic) = set.motion(cloud);
        (state.velocity, state.kinetic) = (velocity.map(|v| before * v), before * kinetic);
        for (m, f) in imps.state.members.iter().zip(&imps.forces) {
            // A marker does not belong to the points of a set.
            if imps.markers.is_none() && f.force != [0.0; 2] && set.has(m.cloud, m.local) {
                let x = cloud.position(cloud.lane_of[m.local as usize] as usize);
                count_contact(&mut state, f.force, x);
            }
        }
        state.contact_force = support.unwrap_or(state.contact_force);
        groups.push(state);
    };
    for probe in probes.iter() {
        report(probe, None);
    }
    let per_kick = if kick > 0.0 { 1.0 / kick } else { 0.0 };
    for hold in &holds.all {
        report(&hold.points, Some(hold.impulse.map(|p| p * per_kick)));
    }
    if let Some(markers) = &imps.markers {
        for number in 0..markers.chains.len() {
            groups.push(chain_state(markers, number, imps));
        }
    }
}

/// The state of a chain: its position, the force of the bodies on it, and as `kinetic` the angular momentum in N s that
/// its weights have added so far.
fn chain_state(markers: &Markers, number: usize, imps: &Imps) -> GroupState {
    let chain = &markers.chains[number];
    let own = chain.first..chain.first + chain.count;
    let mut state = GroupState {
        kinetic: markers.state.spun[number],
        lower: markers.state.x[chain.first],
        upper: markers.state.x[chain.first],
        ..GroupState::default()
    };
    for marker in own.clone() {
        for a in 0..2 {
            let (x, v) = (markers.state.x[marker][a], markers.state.v[marker][a]);
            state.position[a] += x / chain.count as f64;
            state.velocity[a] += v / chain.count as f64;
            state.lower[a] = state.lower[a].min(x);
            state.upper[a] = state.upper[a].max(x);
        }
    }
    for (m, f) in imps.state.members.iter().zip(&imps.forces) {
        let marker = m.local as usize;
        if f.force != [0.0; 2] && own.contains(&marker) {
            count_contact(&mut state, f.force, markers.state.x[marker]);
        }
    }
    state
}

/// For each tile in the last stress pass, of points of this `volume` (m^2): what it lost to plastic flow and to viscous
/// stress, and the work of its stress, in J/m.
fn losses_of_tiles(reports: &[StressReport], volume: f64) -> impl Iterator<Item = [f64; 3]> {
    reports.iter().map(move |report| {
        let [plastic, viscous] = report.lost;
        [plastic, viscous, report.work].map(|sum| volume * sum)
    })
}

/// Counts a point at `x` (m) on which bodies press with `force` (N/m).
fn count_contact(group: &mut GroupState, force: [f64; 2], x: [f64; 2]) {
    group.contacts += 1;
    if group.contacts == 1 {
        (group.loaded_lower, group.loaded_upper) = (x, x);
    }
    for a in 0..2 {
        group.contact_force[a] += force[a];
        group.loaded_lower[a] = group.loaded_lower[a].min(x[a]);
        group.loaded_upper[a] = group.loaded_upper[a].max(x[a]);
    }
}

impl<const W: usize, S: Shape<W>, A: AffineState> Cloud<W, S, A> {
    /// Momentum, and kinetic energy with that of the affine part: `m/2 (v.v + tr(C D C^T))`, `C = B D^-1` (eq. 29).
    pub fn motions(&self) -> Motions {
        let inverse_inertia = splat(1.0 / S::INVERSE_INERTIA.unwrap_or(1.0));
        let (mut p, mut twice) = ([ZERO; 2], ZERO);
        for tile in &self.tiles {
            for b in 0..tile.blocks {
                let motion = &self.state.motion[tile.first + b];
                let live = tile.live(b);
                let mut square = ZERO;
                for a in 0..2 {
                    p[a] += live * motion.v[a];
                    square += motion.v[a] * motion.v[a];
                }
                if A::PRESENT {
                    // C L is what is kept; D = L^2 / inverse_inertia.
                    let affine: Lanes = motion
                        .affine
                        .slopes()
                        .as_flattened()
                        .iter()
                        .fold(ZERO, |sum, &c| c.mul_add(c, sum));
                    square += affine * inverse_inertia;
                }
                twice += live * square;
            }
        }
        Motions {
            momentum: p.map(|p| self.mass * sum(p)),
            kinetic: 0.5 * self.mass * sum(twice),
        }
    }

    /// Angular momentum about the origin in N s, with that of the affine part: `m (x x v + B_yx - B_xy)`, on cells of `cell` (m).
    pub fn angular_momentum(&self, cell: f64) -> f64 {
        let mut total = ZERO;
        for tile in &self.tiles {
            for b in 0..tile.blocks {
                total += tile.live(b) * self.angular_momentum_of_block(tile.first + b, cell);
            }
        }
        sum(total)
    }

    /// `sum m_p x_p` in kg.
    fn mass_times_place(&self) -> [f64; 2] {
        let mut total = [ZERO; 2];
        for tile in &self.tiles {
            for b in 0..tile.blocks {
                let x = &self.state.x[tile.first + b];
                for a in 0..2 {
                    total[a] = tile.live(b).mul_add(x[a], total[a]);
                }
            }
        }
        total.map(|x| self.mass * sum(x))
    }

    /// Elastic energy in J/m of the points of `tile`.
    fn elastic_energy(&self, tile: &Tile) -> f64 {
        let energy = |b: usize| sum(self.energies(tile.first + b) * tile.live(b));
        (0..tile.blocks).map(energy).sum::<f64>() * self.volume
    }

    /// Mass, centre and extent; zeros if all points have been removed.
    fn extent(&self) -> GroupState {
        if self.tiles.is_empty() {
            return GroupState::default();
        }
        let (mut total, mut lower, mut upper) = ([ZERO; 2], self.state.x[0], self.state.x[0]);
        for tile in &self.tiles {
            for b in 0..tile.blocks {
                let x = &self.state.x[tile.first + b];
                // Lanes without a point follow the first of their tile, so they do not widen the extent.
                for a in 0..2 {
                    total[a] += tile.live(b) * x[a];
                    lower[a] = lower[a].fast_min(x[a]);
                    upper[a] = upper[a].fast_max(x[a]);
                }
            }
        }
        GroupState {
            mass: self.total_mass(),
            position: total.map(|x| sum(x) / self.len() as f64),
            lower: lower.map(smallest),
            upper: upper.map(largest),
            ..Default::default()
        }
    }
}

//! The records that processes exchange, with their layout in bytes.
//!
//! Every record is `repr(C)`, little-endian on the machines that iceoryx2 runs on, free of padding (reserved bytes are
//! named), and its size and field offsets are part of [`LAYOUT`], whose hash each channel carries as an attribute. To
//! iceoryx2 itself all records are bytes.
//!
//! A record from another party is checked on receipt by [`Record::check`].

use iceoryx2::prelude::ZeroCopySend;
use serde::{Deserialize, Serialize};
use zerocopy::{FromBytes, Immutable, IntoBytes};

// Bytes in shared memory and in files are those of the record.
const _: () = assert!(cfg!(target_endian = "little"));

/// A record of the wire: plain bytes plus the rule that its numbers obey.
pub trait Record:
    Copy
    + Default
    + core::fmt::Debug
    + PartialEq
    + FromBytes
    + IntoBytes
    + Immutable
    + Send
    + Sync
    + 'static
{
    /// Name, size, and `field:type@offset` of every field.
    const LAYOUT: &'static str;

    /// Whether it is `f64` throughout, of any sign.
    const IS_REAL: bool;

    /// Whether every value is allowed on the wire.
    ///
    /// # Errors
    /// The name of the first field that has a NaN or infinite number, or a negative one where none may be.
    fn check(&self) -> Result<(), &'static str>;

    /// Bit 63 is set if [`Self::check`] may refuse a value. There is no branch for each value, so that the compiler can
    /// test several at once. The other bits mean nothing.
    fn fault_bits(&self) -> u64;

    /// The bits of all of them. Numbers of one kind are read as one array, which takes half the time.
    fn fault_bits_of(records: &[Self]) -> u64 {
        if Self::IS_REAL {
            let (numbers, _) = bytes_of(records).as_chunks();
            let bits = numbers.iter().map(|x| f64::from_ne_bytes(*x).fault_bits());
            bits.fold(0, |all, bits| all | bits)
        } else {
            let bits = records.iter().map(Self::fault_bits);
            bits.fold(0, |all, bits| all | bits)
        }
    }

    /// Shows every number with the name of its field, in the order of the layout.
    fn visit(&self, see: &mut dyn FnMut(&'static str, Number));
}

/// The bytes of records, as on the wire.
pub fn bytes_of<T: Record>(records: &[T]) -> &[u8] {
    records.as_bytes()
}

/// The records in `bytes`, as on the wire; `None` if they are not whole records.
pub fn records_of<T: Record>(bytes: &[u8]) -> Option<Vec<T>> {
    let mut records = Vec::new();
    fill(&mut records, bytes).then_some(records)
}

/// Replaces `records` by those in `bytes`, in the same memory; whether the bytes are whole records.
pub(crate) fn fill<T: Record>(records: &mut Vec<T>, bytes: &[u8]) -> bool {
    let count = bytes.len() / size_of::<T>();
    records.resize(count, T::default());
    let (whole, rest) = bytes.split_at(count * size_of::<T>());
    records.as_mut_slice().as_mut_bytes().copy_from_slice(whole);
    rest.is_empty()
}

/// A number of a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// An id, a count or bits.
    Count(u64),
    /// Any other number.
    Real(f64),
}

/// A type that a field of a record may have.
trait Numbers: Sized {
    const IS_REAL: bool;
    /// Bit 63 is set if it is not finite.
    fn fault_bits(&self) -> u64;
    fn finite(&self) -> bool {
        self.fault_bits() >> 63 == 0
    }
    fn visit(&self, name: &'static str, see: &mut dyn FnMut(&'static str, Number));
}
macro_rules! number {
    ($type:ty, $is_real:literal, $kind:expr, $fault_bits:expr) => {
        impl Numbers for $type {
            const IS_REAL: bool = $is_real;
            fn fault_bits(&self) -> u64 {
                $fault_bits(*self)
            }
            fn visit(&self, name: &'static str, see: &mut dyn FnMut(&'static str, Number)) {
                see(name, $kind((*self).into()));
            }
        }
    };
}
// If a number is not finite, all bits of its exponent are one, and adding one carries into the sign bit.
number!(f64, true, Number::Real, |x: f64| {
    const LOWEST: u64 = 1 << 52;
    (x.to_bits() & (0x7ff * LOWEST)) + LOWEST
});
// The plastic strain of a point. Only a solver with that capability gives it a meaning, so clause R-5 checks it.
number!(f32, false, Number::Real, |_| 0);
number!(u64, false, Number::Count, |_| 0);
number!(u32, false, Number::Count, |_| 0);
impl<const N: usize> Numbers for [f64; N] {
    const IS_REAL: bool = true;
    fn fault_bits(&self) -> u64 {
        self.iter()
            .fold(0, |fault_bits, x| fault_bits | x.fault_bits())
    }
    fn visit(&self, name: &'static str, see: &mut dyn FnMut(&'static str, Number)) {
        for x in self {
            x.visit(name, see);
        }
    }
}

macro_rules! record {
    ($(#[$meta:meta])* $name:ident, $size:literal { $($(#[$field_meta:meta])* $field:ident : $type:ty = $offset:literal),* $(,)? }
        $(at least zero: $($bounded:ident),*)?) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(
            Debug, Clone, Copy, Default, PartialEq, FromBytes, IntoBytes, Immutable, Serialize,
            Deserialize,
        )]
        pub struct $name { $($(#[$field_meta])* pub $field: $type),* }
        const _: () = {
            assert!(size_of::<$name>() == $size);
            $(assert!(core::mem::offset_of!($name, $field) == $offset);)*
        };
        impl Record for $name {
            const LAYOUT: &'static str = concat!(
                stringify!($name), ":", $size, "{", $(stringify!($field), ":", stringify!($type), "@", $offset, ";"),* , "}"
            );
            const IS_REAL: bool =
                true $(&& <$type as Numbers>::IS_REAL)* $($(&& stringify!($bounded).is_empty())*)?;
            fn check(&self) -> Result<(), &'static str> {
                $(if !Numbers::finite(&self.$field) { return Err(stringify!($field)); })*
                $($(if self.$bounded < 0.0 { return Err(stringify!($bounded)); })*)?
                Ok(())
            }
            fn fault_bits(&self) -> u64 {
                0 $(| Numbers::fault_bits(&self.$field))* $($(| self.$bounded.to_bits())*)?
            }
            fn visit(&self, see: &mut dyn FnMut(&'static str, Number)) {
                $(Numbers::visit(&self.$field, stringify!($field), see);)*
            }
        }
    };
}

/// Plain bytes are a record too: control messages and saved states are slices of them.
impl Record for u8 {
    const LAYOUT: &'static str = "u8:1{}";
    const IS_REAL: bool = false;
    fn check(&self) -> Result<(), &'static str> {
        Ok(())
    }
    fn fault_bits(&self) -> u64 {
        0
    }
    fn visit(&self, see: &mut dyn FnMut(&'static str, Number)) {
        see("byte", Number::Count((*self).into()));
    }
}

record! {
    /// Header of every message between the solvers (user header of the sample).
    // Its default name in iceoryx2 is the path in this crate, which no other language has.
    #[derive(ZeroCopySend)]
    #[type_name("tandem/StepHeader")]
    StepHeader, 48 {
        /// Epoch of the grant that this message belongs to.
        epoch: u64 = 0,
        /// Number of the step.
        step: u64 = 8,
        /// Number of records that follow.
        count: u64 = 16,
        /// Bits of [`flags`].
        flags: u64 = 24,
        /// `FORCES`: largest displacement of any body's surface, at the end of this step, since its envelopes were
        /// published, in m. Zero elsewhere.
        travel: f64 = 32,
        /// Generation of the IMP set that the records are ordered by.
        set: u64 = 40,
    }
    at least zero: travel
}

/// Meaning of the bits of [`StepHeader::flags`] and [`Grant::flags`].
pub mod flags {
    /// `STATES`: no states follow; the continuum stops before this step and the session needs a new grant.
    pub const HALT_BEFORE: u64 = 1;
    /// `FORCES`: the bodies' limits have fallen below the granted step; both sides stop after this step.
    pub const HALT_AFTER: u64 = 2;
    /// `STATES`: no states follow; the bodies' envelopes are wanted.
    pub const WANT_ENVELOPES: u64 = 4;
    /// `STATES`: an IMP set with a new generation precedes these states.
    pub const NEW_SET: u64 = 8;
    /// `GRANT`: measure the first step of the window.
    pub const MEASURE: u64 = 16;
    /// `GRANT`, with [`MEASURE`] only: send all points as they are before the first step of the window.
    pub const FRAME: u64 = 32;
    /// `GRANT`: send the state as it is before the first step of the window (capability `save`).
    pub const CHECKPOINT: u64 = 64;
    /// `SAVED`, `RESTORE`: the last piece; its payload is the BLAKE3 hash of all bytes before.
    pub const LAST: u64 = 128;
}

record! {
    /// State of one IMP: position at `t_n`, velocity at `t_{n-1/2}`. Slots are ordered as the last IMP set.
    ImpState, 40 {
        /// Position in m.
        position: [f64; 2] = 0,
        /// Velocity in m/s.
        velocity: [f64; 2] = 16,
        /// Spin in rad/s with which its surface has turned in the last step: that of the field that moved it. 0 where the
        /// last forces had no tangential stiffness.
        spin: f64 = 32,
    }
}

record! {
    /// Who an IMP is. Sent when the set is rebuilt; the order of the records defines the slots.
    ImpInfo, 32 {
        /// Identity of the material point, stable for the whole run.
        id: u64 = 0,
        /// Contact radius `r_p` in m.
        radius: f64 = 8,
        /// Mass in kg/m.
        mass: f64 = 16,
        /// Index of the point group, by which contact laws are looked up.
        group: u32 = 24,
        /// 0: a point by itself. k: a segment of its boundary goes from this slot to slot k - 1, material on the left
        /// (capability `segments`; nobody else looks at it).
        next: u32 = 28,
    }
}

record! {
    /// Contact force on one IMP at `t_n`, summed over bodies.
    ImpForce, 40 {
        /// Force on the point in N/m.
        force: [f64; 2] = 0,
        /// Its moment about the point in N: friction acts on the surface of the point.
        couple: f64 = 16,
        /// Stiffness in N/m per m with which bodies press, or may begin to press before the next exchange, on this
        /// point: sum over the bodies within reach; 0 where none is. The continuum's share of the step limit.
        stiffness: f64 = 24,
        /// Tangential stiffness of the same contacts in N/m per m, which acts on the surface of the point; 0 where there is
        /// no friction.
        tangential: f64 = 32,
    }
    at least zero: stiffness, tangential
}

record! {
    /// One vertex of a body's envelope. Consecutive records of one body form its closed outline
    /// (one vertex: a disc; two: a rounded segment).
    EnvelopeVertex, 32 {
        /// Index of the body.
        body: u64 = 0,
        /// Position of the vertex in m.
        position: [f64; 2] = 8,
        /// Contact begins where the distance to the outline is below this plus the point's radius (m).
        reach: f64 = 24,
    }
    at least zero: reach
}

record! {
    /// The coupler's permission to do steps.
    Grant, 88 {
        /// Epoch: an interval of equal steps, counted from 1.
        epoch: u64 = 0,
        /// Number of the first step granted.
        first: u64 = 8,
        /// Steps granted.
        steps: u64 = 16,
        /// Bits of [`flags`].
        flags: u64 = 24,
        /// Time at the start of the epoch in s.
        epoch_start: f64 = 32,
        /// Steps of the epoch already done.
        steps_in_epoch: u64 = 40,
        /// Step before the epoch in s.
        dt_before_epoch: f64 = 48,
        /// Step in s.
        dt: f64 = 56,
        /// The receiving side halts when its squared frequencies (own plus contact) exceed this, in 1/s^2.
        budget_omega_sq: f64 = 64,
        /// The receiving side halts when its fastest surface or IMP exceeds this, in m/s.
        budget_speed: f64 = 72,
        /// The receiving side halts when its `damping` is larger than this.
        budget_damping: f64 = 80,
    }
    at least zero: dt, dt_before_epoch, budget_omega_sq, budget_speed, budget_damping
}

record! {
    /// A side's limits, as shares of the composed stability criterion (docs/physics.md section 4).
    Limits, 48 {
        /// Bound of the largest squared frequency without contact between points and bodies, in 1/s^2.
        omega_sq: f64 = 0,
        /// What contact between points and bodies adds on this side: `lambda_max(S k S^T M^-1)` on the continuum's
        /// side, `k n (1/m + r^2/I)` on the bodies', in 1/s^2.
        contact_omega_sq: f64 = 8,
        /// Damping ratio of the dashpots of contacts in reach together (PROTOCOL L-2; bodies' side, 0 elsewhere).
        damping: f64 = 16,
        /// Speed of the fastest IMP, or of the fastest point of a body's surface, in m/s.
        speed: f64 = 24,
        /// Radius of the smallest IMP in m (continuum's side, 0 where there is none).
        radius_min: f64 = 32,
        /// Interface mobility `W` in 1/kg, for information.
        mobility: f64 = 40,
    }
    at least zero: omega_sq, contact_omega_sq, damping, speed, radius_min, mobility
}

record! {
    /// Energies, momenta and impulses of one side at `t_n` of a measured step, per metre of thickness.
    Ledger, 184 {
        /// Kinetic energy in J/m (points: with the affine part; bodies: translation).
        kinetic: f64 = 0,
        /// Kinetic energy of rotation in J/m (bodies).
        kinetic_rotation: f64 = 8,
        /// Elastic energy in J/m (points): what they store, a function of their state.
        elastic: f64 = 16,
        /// Potential energy of gravity in J/m, zero at the origin.
        gravity: f64 = 24,
        /// Energy in contact springs in J/m (bodies).
        contact: f64 = 32,
        /// Dissipated by friction so far in J/m.
        friction_work: f64 = 40,
        /// Dissipated by viscous contact or viscous stress so far in J/m.
        viscous_work: f64 = 48,
        /// Dissipated by plastic flow so far in J/m.
        plastic_work: f64 = 56,
        /// Work done on the system by driven bodies and moving boundaries so far in J/m.
        driven_work: f64 = 64,
        /// Linear momentum at `t_{n+1/2}` in N s/m.
        momentum: [f64; 2] = 72,
        /// Impulse applied from outside so far, through the kick of this step: gravity, walls, fixed and driven
        /// bodies, in N s/m.
        applied_impulse: [f64; 2] = 88,
        /// Sum of the impulses of the contact forces between points and bodies so far, as felt on this side, in N s/m.
        contact_impulse: [f64; 2] = 104,
        /// Sum of the contact forces between points and bodies at `t_n`, as felt on this side, in N/m.
        contact_force: [f64; 2] = 120,
        /// IMPs or bodies with a non-zero contact force at `t_n`.
        contacts: u64 = 136,
        /// Work of the stress on the points so far, less what plastic flow and viscous stress have taken of it, in J/m
        /// (points; capability [`stress_work`](crate::config::capability::STRESS_WORK)). Where the law has an energy it
        /// grows as `elastic` does.
        stress_work: f64 = 144,
        /// Taken from the motion so far by the transfer between points and nodes in J/m (points); below zero if it has
        /// given more than it took.
        transfer_work: f64 = 152,
        /// Angular momentum about the origin in N s, with the velocities of `momentum` and the places at the end of the step.
        angular_momentum: f64 = 160,
        /// Moment of `applied_impulse` about the origin in N s.
        applied_moment: f64 = 168,
        /// Moment of `contact_impulse` about the origin in N s.
        contact_moment: f64 = 176,
    }
}

record! {
    /// What a side says when its window is done or it halted.
    Report, 320 {
        /// Epoch of the grant.
        epoch: u64 = 0,
        /// Number of the next step: all before it are done.
        next: u64 = 8,
        /// 1 if the side halted before the window was done.
        halted: u64 = 16,
        /// 1 if `ledger` holds the measured first step of the window.
        measured: u64 = 24,
        /// Points or bodies.
        items: u64 = 32,
        /// IMPs at present.
        imps: u64 = 40,
        /// Rebuilds of the IMP set so far.
        rebuilds: u64 = 48,
        /// Nanoseconds so far: computing.
        compute_ns: u64 = 56,
        /// Nanoseconds so far: copying to and from the channels.
        exchange_ns: u64 = 64,
        /// Nanoseconds so far: waiting for the others.
        wait_ns: u64 = 72,
        /// Nanoseconds of CPU time of this process (or thread, in one process) so far.
        cpu_ns: u64 = 80,
        /// Limits for the next step.
        limits: Limits = 88,
        /// The measurement.
        ledger: Ledger = 136,
    }
}

/// A record within a record.
macro_rules! nested {
    ($($name:ident)*) => {
        $(impl Numbers for $name {
            const IS_REAL: bool = false;
            fn finite(&self) -> bool {
                self.check().is_ok()
            }
            fn fault_bits(&self) -> u64 {
                Record::fault_bits(self)
            }
            fn visit(&self, _: &'static str, see: &mut dyn FnMut(&'static str, Number)) {
                Record::visit(self, see);
            }
        })*
    };
}
nested!(Limits Ledger);

record! {
    /// Sums over one point group at `t_n` of a measured step.
    GroupState, 136 {
        /// Mass in kg/m.
        mass: f64 = 0,
        /// Centre of mass in m.
        position: [f64; 2] = 8,
        /// Mean velocity (momentum over mass) in m/s.
        velocity: [f64; 2] = 24,
        /// Kinetic energy in J/m.
        kinetic: f64 = 40,
        /// Contact force of bodies on the group in N/m.
        contact_force: [f64; 2] = 48,
        /// Smallest coordinates in m.
        lower: [f64; 2] = 64,
        /// Largest coordinates in m.
        upper: [f64; 2] = 80,
        /// Points with a non-zero contact force.
        contacts: u64 = 96,
        /// Smallest coordinates of the points with a non-zero contact force, in m; zero where there is none.
        loaded_lower: [f64; 2] = 104,
        /// Largest coordinates of the same, likewise.
        loaded_upper: [f64; 2] = 120,
    }
}

record! {
    /// One body at `t_n` of a measured step.
    BodyState, 120 {
        /// Centre of mass in m.
        position: [f64; 2] = 0,
        /// Velocity in m/s.
        velocity: [f64; 2] = 16,
        /// Angle in rad.
        angle: f64 = 32,
        /// Angular velocity in rad/s.
        spin: f64 = 40,
        /// Mass in kg/m.
        mass: f64 = 48,
        /// Moment of inertia about the centre of mass in kg m.
        inertia: f64 = 56,
        /// Force of the points on the body in N/m.
        point_force: [f64; 2] = 64,
        /// Torque of the points on the body about its centre of mass in N.
        point_torque: f64 = 80,
        /// Force of other bodies in N/m.
        body_force: [f64; 2] = 88,
        /// Torque of other bodies in N.
        body_torque: f64 = 104,
        /// Points that overlap it, with a force or without.
        contacts: u64 = 112,
    }
}

record! {
    /// One material point, for the state hash and for frames.
    PointState, 96 {
        /// Identity.
        id: u64 = 0,
        /// Position in m.
        position: [f64; 2] = 8,
        /// Velocity in m/s.
        velocity: [f64; 2] = 24,
        /// Cauchy stress xx, yy, zz, xy in Pa, tension positive, as it was last updated.
        stress: [f64; 4] = 40,
        /// Volume in m^2, likewise.
        volume: f64 = 72,
        /// Mass in kg/m.
        mass: f64 = 80,
        /// Index of the point group.
        group: u32 = 88,
        /// The plastic strain, of a solver with the capability `plastic_strain`: 0 where the material keeps none.
        plastic_strain: f32 = 92,
    }
    at least zero: volume, mass
}

record! {
    /// One contact at `t_n` of a measured step with a frame (capability `contacts`).
    ContactState, 56 {
        /// Index of the body; identity of the first point where two points touch.
        body: u64 = 0,
        /// Whom it touches: index of another body, or identity of a point.
        other: u64 = 8,
        /// Who touch: 0 two bodies, 1 a body and a point, 2 two points (`group_pairs`).
        with: u64 = 16,
        /// Contact point in m.
        position: [f64; 2] = 24,
        /// Force on the body, or on the first point, in N/m.
        force: [f64; 2] = 40,
    }
}

/// What the limits of a side may become within the granted step before it must halt.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// Squared frequencies, own and contact, in 1/s^2.
    pub omega_sq: f64,
    /// Speed in m/s.
    pub speed: f64,
    /// Damping ratio.
    pub damping: f64,
}

impl Budget {
    /// No limit: the side never halts. The numbers are finite, because others must not be sent.
    pub const UNLIMITED: Self = Self {
        omega_sq: f64::MAX,
        speed: f64::MAX,
        damping: f64::MAX,
    };
}

impl Grant {
    /// This grant, for a side with this budget.
    #[must_use]
    pub fn within(self, budget: Budget) -> Self {
        Self {
            budget_omega_sq: budget.omega_sq,
            budget_speed: budget.speed,
            budget_damping: budget.damping,
            ..self
        }
    }

    /// Whether a side with these limits may continue with the granted step.
    pub fn allows(&self, limits: &Limits) -> bool {
        limits.omega_sq + limits.contact_omega_sq <= self.budget_omega_sq
            && limits.speed <= self.budget_speed
            && limits.damping <= self.budget_damping
    }
}

/// The layouts of all records, in the order of this file. Its hash is the `layout` attribute of every channel.
pub const LAYOUT: [&str; 13] = [
    StepHeader::LAYOUT,
    ImpState::LAYOUT,
    ImpInfo::LAYOUT,
    ImpForce::LAYOUT,
    EnvelopeVertex::LAYOUT,
    Grant::LAYOUT,
    Limits::LAYOUT,
    Ledger::LAYOUT,
    Report::LAYOUT,
    GroupState::LAYOUT,
    BodyState::LAYOUT,
    PointState::LAYOUT,
    ContactState::LAYOUT,
];

/// First 16 hexadecimal digits of the BLAKE3 hash of [`LAYOUT`], joined by newlines.
pub fn layout_hash() -> String {
    blake3::hash(LAYOUT.join("\n").as_bytes()).to_hex()[..16].to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_is_not_finite_is_named() {
        let mut state = ImpState {
            position: [1.0, 2.0],
            velocity: [0.0, 0.0],
            spin: 0.0,
        };
        assert_eq!(state.check(), Ok(()));
        state.velocity[1] = f64::NAN;
        assert_eq!(state.check(), Err("velocity"));
        let backwards = Limits {
            speed: -1.0,
            ..Default::default()
        };
        assert_eq!(backwards.check(), Err("speed"));
        let report = Report {
            limits: Limits {
                omega_sq: f64::INFINITY,
                ..Default::default()
            },
            ..Default::default()
        };
        assert_eq!(report.check(), Err("limits"));
    }
}

//! Four material points at a time: the unit in which all loops over points run.

/// One number of each of four points.
pub type Lanes = wide::f64x4;

/// Points in a block.
pub const LANES: usize = 4;

/// The same number in every lane.
#[inline(always)]
pub fn splat(value: f64) -> Lanes {
    Lanes::splat(value)
}

/// Zero in every lane.
pub const ZERO: Lanes = Lanes::ZERO;

/// Upper bound of the numbers that [`indices`] returns.
pub const INDEX_LIMIT: usize = 128;

/// Whole numbers from 0 to 127 held as floats, as indices.
///
/// Adding 2^52 puts the integer into the low bits of the significand: one vector addition instead of four scalar
/// conversions with their range checks. The mask tells the compiler the range.
#[inline(always)]
pub fn indices(whole: Lanes) -> [usize; LANES] {
    const TWO_TO_52: f64 = 4_503_599_627_370_496.0;
    let [a, b, c, d] = (whole + splat(TWO_TO_52)).to_array();
    let low = |x: f64| x.to_bits() as usize & (INDEX_LIMIT - 1);
    [low(a), low(b), low(c), low(d)]
}

/// Sum of the four lanes, in a fixed order.
#[inline]
pub fn sum(lanes: Lanes) -> f64 {
    let [a, b, c, d] = lanes.to_array();
    (a + b) + (c + d)
}

/// Largest of the four lanes.
#[inline]
pub fn largest(lanes: Lanes) -> f64 {
    let [a, b, c, d] = lanes.to_array();
    a.max(b).max(c.max(d))
}

/// Smallest of the four lanes.
#[inline]
pub fn smallest(lanes: Lanes) -> f64 {
    -largest(-lanes)
}

/// One in the first `count` lanes, zero in the rest.
#[inline]
pub fn first(count: usize) -> Lanes {
    Lanes::new(core::array::from_fn(|k| if k < count { 1.0 } else { 0.0 }))
}

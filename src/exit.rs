//! Exit statuses of `tandem` besides 0 (README.md has the table).

/// Bad input: arguments, a scene, a file that cannot be read.
pub const BAD_INPUT: u8 = 2;

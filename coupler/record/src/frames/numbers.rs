//! Numbers of points and bodies that follow from the arrays of a frame, for pictures and pages.

use super::vtu::{Array, Mesh};

/// A number that points or bodies have if the frame has its arrays.
pub struct Number {
    /// Its name in expressions.
    pub name: &'static str,
    /// Its unit; `1` of a pure number.
    pub unit: &'static str,
    /// Names of its arrays, and how many numbers of each `of` reads.
    arrays: &'static [(&'static str, usize)],
    /// The number, of what each array has of one point or body.
    of: fn(&[&[f64]]) -> f64,
}

impl Number {
    /// All of them.
    pub const ALL: [Self; 16] = [
        number("vx", "m/s", &[("velocity", 1)], |v| v[0][0]),
        number("vy", "m/s", &[("velocity", 2)], |v| v[0][1]),
        number("speed", "m/s", &[("velocity", 2)], |v| {
            v[0][0].hypot(v[0][1])
        }),
        number("spin", "rad/s", &[("spin", 1)], first),
        number("stress_xx", "Pa", &[("stress", 1)], first),
        number("stress_yy", "Pa", &[("stress", 2)], |s| s[0][1]),
        number("stress_zz", "Pa", &[("stress", 3)], |s| s[0][2]),
        number("stress_xy", "Pa", &[("stress", 4)], |s| s[0][3]),
        number("pressure", "Pa", &[("stress", 3)], |s| {
            -(s[0][0] + s[0][1] + s[0][2]) / 3.0
        }),
        // The largest in the plane.
        number("shear", "Pa", &[("stress", 4)], |s| {
            (0.5 * (s[0][0] - s[0][1])).hypot(s[0][3])
        }),
        number("volume", "m^2", &[("volume", 1)], first),
        number("mass", "kg/m", &[("mass", 1)], first),
        number("density", "kg/m^3", &[("mass", 1), ("volume", 1)], |mv| {
            mv[0][0] / mv[1][0]
        }),
        number("group", "1", &[("group", 1)], first),
        number("id", "1", &[("id", 1)], first),
        number("plastic_strain", "1", &[("plastic_strain", 1)], first),
    ];

    /// The one of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|number| number.name == name)
    }
}

const fn number(
    name: &'static str,
    unit: &'static str,
    arrays: &'static [(&'static str, usize)],
    of: fn(&[&[f64]]) -> f64,
) -> Number {
    Number {
        name,
        unit,
        arrays,
        of,
    }
}

fn first(of: &[&[f64]]) -> f64 {
    of[0][0]
}

/// A number of all points or bodies of a frame.
pub struct Column<'m> {
    arrays: Vec<&'m Array>,
    of: fn(&[&[f64]]) -> f64,
}

impl<'m> Column<'m> {
    /// The number of this name, or the array of this name with one number of each; `None` if the frame has none.
    pub fn of(mesh: &'m Mesh, name: &str) -> Option<Self> {
        let lone = [(name, 1)];
        let (names, of) = Number::named(name).map_or((&lone[..], first as _), |n| (n.arrays, n.of));
        let array = |&(name, least): &(&str, usize)| {
            // One of a damaged frame may have fewer.
            mesh.array(name).filter(|array| array.components >= least)
        };
        let arrays = names.iter().map(array).collect::<Option<_>>()?;
        Some(Self { arrays, of })
    }

    /// That of a point or body; NaN if a damaged frame has no such place.
    pub fn at(&self, place: usize) -> f64 {
        let mut parts: [&[f64]; 2] = [&[]; 2];
        for (part, array) in parts.iter_mut().zip(&self.arrays) {
            let begin = place * array.components;
            match array.values.get(begin..begin + array.components) {
                Some(numbers) => *part = numbers,
                None => return f64::NAN,
            }
        }
        (self.of)(&parts)
    }
}

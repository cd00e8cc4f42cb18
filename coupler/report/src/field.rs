//! What colours can say of points and bodies.

use coupler::record::frames::vtu::{Array, Mesh};
use serde::Serialize;

use crate::pack::Scale;

/// Share of the numbers at either end that may lie beyond the colours, where they would take most of them.
const EXTREMES: f64 = 0.002;
/// Point arrays that are not useful as a colour, or of which one of [`FIELDS`] is made.
const SILENT: [&str; 4] = ["id", "mass", "volume", "stress"];

/// A field that a frame may have.
struct Kind {
    name: &'static str,
    label: &'static str,
    unit: &'static str,
    /// The number of a point or a body from the arrays that it is made of.
    of: fn(&[&[f64]]) -> f64,
    /// Their names, and how many numbers of each `of` looks at.
    arrays: &'static [(&'static str, usize)],
}

/// Fields made of the arrays that every run keeps, the usual ones first.
const FIELDS: [Kind; 7] = [
    Kind {
        name: "speed",
        label: "Speed",
        unit: "m/s",
        of: |v| v[0][0].hypot(v[0][1]),
        arrays: &[("velocity", 2)],
    },
    Kind {
        name: "pressure",
        label: "Pressure",
        unit: "Pa",
        of: |s| -(s[0][0] + s[0][1] + s[0][2]) / 3.0,
        arrays: &[("stress", 3)],
    },
    Kind {
        name: "shear",
        label: "Largest shear stress in the plane",
        unit: "Pa",
        of: |s| (0.5 * (s[0][0] - s[0][1])).hypot(s[0][3]),
        arrays: &[("stress", 4)],
    },
    Kind {
        name: "density",
        label: "Density",
        unit: "kg/m^3",
        of: |mv| mv[0][0] / mv[1][0],
        arrays: &[("mass", 1), ("volume", 1)],
    },
    Kind {
        name: "vx",
        label: "Velocity to the right",
        unit: "m/s",
        of: |v| v[0][0],
        arrays: &[("velocity", 2)],
    },
    Kind {
        name: "vy",
        label: "Velocity upwards",
        unit: "m/s",
        of: |v| v[0][1],
        arrays: &[("velocity", 2)],
    },
    Kind {
        name: "spin",
        label: "Spin",
        unit: "rad/s",
        of: |w| w[0][0],
        arrays: &[("spin", 1)],
    },
];

/// A field that a run has.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// For the page's script.
    pub name: String,
    /// For people.
    pub label: String,
    /// Empty where it is not known.
    pub unit: String,
}

/// The data of a field for the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shown {
    /// As in [`Field`].
    pub name: String,
    /// Likewise.
    pub label: String,
    /// Likewise.
    pub unit: String,
    /// The number of the first colour and that of the last.
    pub range: [f64; 2],
    /// The least number and the largest.
    pub extremes: [f64; 2],
    /// Whether points have it.
    pub points: bool,
    /// Whether bodies have it.
    pub bodies: bool,
}

/// The fields that this mesh has of its points or of its cells.
pub fn fields(mesh: &Mesh) -> Vec<Field> {
    let made = FIELDS
        .iter()
        .filter(|kind| kind.arrays.iter().all(|of| array(mesh, *of).is_some()))
        .map(|kind| Field {
            name: kind.name.to_owned(),
            label: kind.label.to_owned(),
            unit: kind.unit.to_owned(),
        });
    // Fields of a later build are shown by their own names.
    let others = mesh.of_points.iter().filter(|array| {
        let known = SILENT.contains(&array.name.as_str());
        array.components == 1 && !known && !FIELDS.iter().any(|kind| kind.name == array.name)
    });
    let others = others.map(|array| Field {
        name: array.name.clone(),
        label: sentence(&array.name),
        unit: String::new(),
    });
    made.chain(others).collect()
}

/// An array that has so many numbers for each point or cell; one of a damaged frame may have fewer.
fn array<'a>(mesh: &'a Mesh, (name, least): (&str, usize)) -> Option<&'a Array> {
    mesh.array(name).filter(|array| array.components >= least)
}

/// The numbers of a field, of the points or cells at these places.
pub fn values(mesh: &Mesh, field: &Field, places: &[Option<u32>]) -> Vec<f32> {
    let kind = FIELDS.iter().find(|kind| kind.name == field.name);
    let names = kind.map_or_else(
        || vec![(field.name.as_str(), 1)],
        |kind| kind.arrays.to_vec(),
    );
    let arrays: Option<Vec<&Array>> = names.into_iter().map(|of| array(mesh, of)).collect();
    let Some(arrays) = arrays else {
        return vec![f32::NAN; places.len()];
    };
    let of = kind.map_or((|all: &[&[f64]]| all[0][0]) as fn(&[&[f64]]) -> f64, |k| {
        k.of
    });
    let mut parts: Vec<&[f64]> = Vec::new();
    let values = places.iter().map(|place| {
        let Some(place) = place else {
            return f32::NAN;
        };
        parts.clear();
        // A damaged frame may have fewer numbers than points.
        parts.extend(arrays.iter().filter_map(|array| {
            let begin = *place as usize * array.components;
            array.values.get(begin..begin + array.components)
        }));
        if parts.len() < arrays.len() {
            return f32::NAN;
        }
        of(&parts) as f32
    });
    values.collect()
}

/// The range of the colours: that of all numbers, unless a few of them lie far beyond the others.
pub fn range(numbers: &mut Vec<f32>) -> (Scale, Scale) {
    numbers.retain(|n| n.is_finite());
    let all = Scale::of(numbers.iter().map(|&n| f64::from(n)));
    if numbers.len() < 100 {
        return (all, all);
    }
    let beyond = (numbers.len() as f64 * EXTREMES) as usize;
    let at = |numbers: &mut Vec<f32>, k: usize| {
        let (_, number, _) = numbers.select_nth_unstable_by(k, f32::total_cmp);
        f64::from(*number)
    };
    let last = numbers.len() - 1;
    let most = Scale {
        low: at(numbers, beyond),
        high: at(numbers, last - beyond),
    };
    if all.high - all.low > 2.0 * (most.high - most.low) && most.high > most.low {
        (most, all)
    } else {
        (all, all)
    }
}

/// `plastic_strain` as `Plastic strain`.
fn sentence(name: &str) -> String {
    let mut letters = name.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string());
    first.unwrap_or_default() + &letters.as_str().replace('_', " ")
}

#[cfg(test)]
mod tests {
    use coupler::record::frames::vtu::Cell;

    use super::*;

    fn mesh() -> Mesh {
        let array =
            |name: &str, components, values: &[f64]| Array::real(name, components, values.to_vec());
        Mesh {
            cell: Cell::Vertex,
            points: vec![[0.0; 2]; 2],
            ends: vec![1, 2],
            of_points: vec![
                array("id", 1, &[0.0, 1.0]),
                array("velocity", 3, &[0.0, 0.0, 0.0, 3.0, 4.0, 0.0]),
                array(
                    "stress",
                    6,
                    &[
                        0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, -7.0, -1.0, 4.0, 0.0, 0.0,
                    ],
                ),
                array("mass", 1, &[1.0, 6.0]),
                array("volume", 1, &[1.0, 2.0]),
                array("plastic_strain", 1, &[0.0, 0.5]),
            ],
            of_cells: Vec::new(),
            names: Vec::new(),
        }
    }

    /// The report of a run with such a frame panicked.
    #[test]
    fn an_array_with_too_few_numbers_is_no_field() {
        let mut mesh = mesh();
        let speed = fields(&mesh).remove(0);
        mesh.of_points[1].values.truncate(3);
        let told = values(&mesh, &speed, &[Some(0), Some(1)]);
        assert!(told[0] == 0.0 && told[1].is_nan(), "{told:?}");
        mesh.of_points[1].components = 1;
        assert!(values(&mesh, &speed, &[Some(0)])[0].is_nan());
        assert!(fields(&mesh).iter().all(|field| field.name != "speed"));
    }

    #[test]
    fn fields_are_made_of_what_a_frame_has() {
        let mesh = mesh();
        let of_last: Vec<(String, f32)> = fields(&mesh)
            .into_iter()
            .map(|field| {
                let value = values(&mesh, &field, &[Some(1)])[0];
                (field.label, value)
            })
            .collect();
        let expected = [
            ("Speed", 5.0),
            ("Pressure", 3.0),
            ("Largest shear stress in the plane", 5.0),
            ("Density", 3.0),
            ("Velocity to the right", 3.0),
            ("Velocity upwards", 4.0),
            ("Plastic strain", 0.5),
        ];
        assert_eq!(
            of_last,
            expected.map(|(label, value)| (label.to_owned(), value))
        );
    }

    #[test]
    fn a_point_that_is_not_there_has_no_number() {
        let mesh = mesh();
        let speed = &fields(&mesh)[0];
        let found = values(&mesh, speed, &[None, Some(0)]);
        assert!(found[0].is_nan() && found[1] == 0.0);
    }

    #[test]
    fn a_few_far_numbers_do_not_take_the_colours() {
        let mut numbers: Vec<f32> = (0..10_000).map(|k| k as f32).collect();
        let (shown, all) = range(&mut numbers);
        assert_eq!((shown, all.high), (all, 9999.0));
        numbers.push(1e9);
        let (shown, all) = range(&mut numbers);
        assert_eq!(all.high, 1e9);
        assert!(shown.high < 1e4);
    }
}

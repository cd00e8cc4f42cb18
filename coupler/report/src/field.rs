//! What colours can say of points and bodies.

use coupler::record::frames::numbers::{Column, Number};
use coupler::record::frames::vtu::Mesh;
use serde::Serialize;

use crate::pack::Scale;
use crate::words::unit_of;

/// Share of the numbers at either end that may lie beyond the colours, where they would take most of them.
const EXTREMES: f64 = 0.002;
/// Point arrays that are not useful as a colour, or of which one of [`LABELS`] is made.
const SILENT: [&str; 4] = ["id", "mass", "volume", "stress"];

/// Labels of the numbers that are useful as a colour, the usual ones first.
const LABELS: [(&str, &str); 7] = [
    ("speed", "Speed"),
    ("pressure", "Pressure"),
    ("shear", "Largest shear stress in the plane"),
    ("density", "Density"),
    ("vx", "Velocity to the right"),
    ("vy", "Velocity upwards"),
    ("spin", "Spin"),
];

/// A field that a run has.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Field {
    /// For the page's script.
    pub name: String,
    /// For people.
    pub label: String,
    /// As it is printed; empty where it is not known.
    pub unit: String,
}

/// The data of a field for the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shown {
    /// What it is.
    #[serde(flatten)]
    pub field: Field,
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
    let field = |name: &str, label: String| {
        let unit = Number::named(name).map(|number| number.unit);
        let unit = unit.filter(|unit| *unit != "1");
        Column::of(mesh, name).map(|_| Field {
            name: name.to_owned(),
            label,
            unit: unit_of(unit.unwrap_or_default()),
        })
    };
    let usual = LABELS.iter();
    let usual = usual.filter_map(|(name, label)| field(name, (*label).to_owned()));
    // Arrays of a later build are shown by their own names.
    let others = mesh.of_points.iter().filter(|array| {
        let known = SILENT.contains(&array.name.as_str());
        array.components == 1 && !known && !LABELS.iter().any(|(name, _)| *name == array.name)
    });
    let others = others.filter_map(|array| field(&array.name, sentence(&array.name)));
    usual.chain(others).collect()
}

/// The numbers of a field, of the points or cells at these places.
pub fn values(mesh: &Mesh, field: &Field, places: &[Option<u32>]) -> Vec<f32> {
    let column = Column::of(mesh, &field.name);
    let at = |place: &Option<u32>| match (&column, place) {
        (Some(column), Some(place)) => column.at(*place as usize) as f32,
        _ => f32::NAN,
    };
    places.iter().map(at).collect()
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
    use coupler::record::frames::vtu::{Array, Cell};

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
        let colours = values(&mesh, &speed, &[Some(0), Some(1)]);
        assert!(colours[0] == 0.0 && colours[1].is_nan(), "{colours:?}");
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

//! What is allowed and probably not meant: numbers that look like a slip of the unit, with few bounds, each beyond what a
//! source lists; and hats whose scheme creates energy (docs/energy.md).

use std::f64::consts::{FRAC_PI_2, TAU};

use interface::config::{
    BodyInertia, Fill, MaterialModel, MpmConfig, ShapeFunction, StressUpdate, polygon,
};

use super::Scene;
use super::document::Document;
use super::needs::body_or_set;
use crate::diagnostic::FAULTS_LIMIT;

/// Fewest cells across a group of points: nothing is resolved below (docs/choosing.md).
const CELLS: f64 = 4.0;
/// Densities in kg/m^3, from expanded polystyrene to osmium (22,590, CRC Handbook of Chemistry and Physics).
const DENSITIES: [f64; 2] = [10.0, 22_600.0];
/// Fastest sound in m/s: in diamond along \[111\], from the elastic constants of McSkimin and Andreatch 1972.
const SOUND: f64 = 18_600.0;

/// What is probably not meant, each with its line.
pub(super) fn doubts(scene: &Scene, document: &Document) -> Vec<String> {
    let (mut doubts, mut more) = (Vec::new(), 0_u64);
    let mut doubt = |key: &str, words: String| {
        if doubts.len() < FAULTS_LIMIT {
            doubts.push(format!("{words} ({})", document.whereabouts(key)));
        } else {
            more += 1;
        }
    };
    if let Some(mpm) = &scene.mpm {
        if mpm.shape == ShapeFunction::Linear && mpm.stress_update == StressUpdate::Usf {
            let words = "with linear shape functions stress_update = \"usf\" creates energy wherever points cross from cell to \
                         cell under stress; \"usavg\" does not";
            doubt("mpm.shape", words.into());
        }
        resolution(mpm, &mut doubt);
        materials(mpm, &mut doubt);
    }
    let bodies = scene.dem.iter().flat_map(|dem| &dem.bodies);
    for (b, body) in bodies.enumerate() {
        let key = |field: &str| body_or_set(&format!("dem.body.{b}.{field}"), document);
        if let BodyInertia::Density(density) = body.inertia
            && !is_listed(density)
        {
            doubt(
                &key("density"),
                unlisted(&format!("body `{}`", body.name), density),
            );
        }
        if body.angle.abs() > TAU {
            let (angle, degrees) = (body.angle, body.angle.to_radians());
            let words = format!(
                "body `{}` is turned by {angle} rad, which is more than once around; {angle} degrees are {degrees:.4} rad",
                body.name
            );
            doubt(&key("angle"), words);
        }
    }
    if more > 0 {
        doubts.push(format!("{more} more numbers are probably not meant"));
    }
    doubts
}

fn is_listed(density: f64) -> bool {
    (DENSITIES[0]..=DENSITIES[1]).contains(&density)
}

fn unlisted(what: &str, density: f64) -> String {
    let [light, heavy] = DENSITIES;
    format!(
        "{what} has a density of {density} kg/m^3; solids and liquids have {light} (foam) to {heavy} (osmium), and 1 g/cm^3 is \
         1000 kg/m^3"
    )
}

/// Groups that are less than a few cells across.
fn resolution(mpm: &MpmConfig, doubt: &mut impl FnMut(&str, String)) {
    for (g, group) in mpm.groups.iter().enumerate() {
        let across = match &group.fill {
            // Points by themselves need not be a solid.
            Fill::Points { .. } => continue,
            Fill::Ring { radius, inner, .. } => radius - inner,
            Fill::Polygon { vertices } => {
                // Exact of long strips, and 0.7 of a square: what is thin is meant.
                4.0 * polygon::area(vertices).abs() / polygon::perimeter(vertices)
            }
            fill => {
                let [lower, upper] = fill.bounds();
                (upper[0] - lower[0]).min(upper[1] - lower[1])
            }
        };
        let cells = across / mpm.cell;
        if cells < CELLS * (1.0 - 1e-9) {
            let words = format!(
                "group `{}` is {cells:.1} cells of {} m across; nothing is resolved below {CELLS} cells",
                group.name, mpm.cell
            );
            doubt(&format!("mpm.points.{g}.fill"), words);
        }
    }
}

fn materials(mpm: &MpmConfig, doubt: &mut impl FnMut(&str, String)) {
    for (m, material) in mpm.materials.iter().enumerate() {
        let key = |field: &str| format!("mpm.material.{m}.{field}");
        let what = format!("material `{}`", material.name);
        if !is_listed(material.density) {
            doubt(&key("density"), unlisted(&what, material.density));
        }
        let (bulk, shear) = material.model.moduli();
        let sound = ((bulk + 4.0 / 3.0 * shear) / material.density).sqrt();
        if is_listed(material.density) && sound > SOUND {
            let words = format!(
                "in {what} sound has {sound:.3e} m/s, more than in diamond ({SOUND} m/s); moduli are in Pa"
            );
            doubt(&key("model"), words);
        }
        let (MaterialModel::DruckerPrager(friction) | MaterialModel::MohrCoulomb(friction)) =
            &material.model
        else {
            continue;
        };
        let angle = friction.friction_angle;
        // Any angle in radians is below this.
        if angle > 0.0 && angle < FRAC_PI_2 {
            let degrees = angle.to_degrees();
            let words = format!(
                "{what} has an angle of friction of {angle} degrees; {angle} rad are {degrees:.1} degrees"
            );
            doubt(&key("model"), words);
        }
    }
}

//! What the solvers say of a scene before it runs: the memory of their states, and the limits of the step at the start.

use std::f64::consts::PI;
use std::fmt::{self, Display};

use interface::message::control::Party;
use interface::solver::Readiness;

use crate::run::resources::Bytes;
use crate::run::stability::{Sides, Stability};
use crate::scene::Scene;

/// Least time in s that a step takes for a point, and for the exchange between the processes (docs/performance.md).
const POINT: f64 = 30e-9;
const EXCHANGE: f64 = 10e-6;
/// A run that takes longer is probably not meant, in s.
const LONG: f64 = 86_400.0;

/// What the solvers say of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The sides of the scene, with what they say as they are ready; none of another program, which is not asked.
    pub ready: Vec<(Party, Option<Readiness>)>,
    /// Upper limits of the step in s, each with where it comes from, smallest first. Empty if the solvers have not been asked.
    pub limits: Vec<(f64, String)>,
    /// The step in s while one contact of the lightest body opens or closes, if bodies can collide, and the number of such
    /// steps in an impact.
    pub impacts: Option<[f64; 2]>,
    end: f64,
}

impl Estimate {
    /// What follows from the readiness of the solvers, and from their limits after the opening step.
    pub fn new(scene: &Scene, [mpm, dem]: [Option<Readiness>; 2], limits: Option<&Sides>) -> Self {
        let limits = limits.map(|sides| step_limits(scene, [mpm.as_ref(), dem.as_ref()], sides));
        let impacts = dem.as_ref().and_then(|dem| impacts(scene, dem));
        let there = [
            (Party::Mpm, mpm, scene.mpm.is_some()),
            (Party::Dem, dem, scene.dem.is_some()),
        ];
        let there = there.into_iter().filter(|(_, _, there)| *there);
        Self {
            ready: there.map(|(party, ready, _)| (party, ready)).collect(),
            limits: limits.unwrap_or_default(),
            impacts,
            end: scene.time.end,
        }
    }

    /// Number of steps, if the step stays as it is at the start.
    fn steps(&self) -> Option<f64> {
        Some((self.end / self.limits.first()?.0).ceil())
    }

    /// That the run takes longer than a day, however fast the machine is.
    pub fn too_long(&self) -> Option<String> {
        let steps = self.steps()?;
        let points = self.ready.iter().filter(|(party, _)| *party == Party::Mpm);
        let points = points.filter_map(|(_, ready)| Some(ready.as_ref()?.items as f64));
        let seconds = steps * (EXCHANGE + POINT * points.sum::<f64>());
        (seconds > LONG).then(|| {
            format!(
                "about {steps:.1e} steps, which take {:.1} days or more; `tandem plan` measures it, and `time.end` is {} s",
                seconds / LONG,
                self.end
            )
        })
    }
}

fn step_limits(
    scene: &Scene,
    [mpm, dem]: [Option<&Readiness>; 2],
    sides: &Sides,
) -> Vec<(f64, String)> {
    let stability = Stability::new(&scene.time, mpm, dem);
    let at_the_start = stability.limit(sides);
    let name = format!("at the start ({})", at_the_start.bound.name());
    let mut limits = vec![(at_the_start.dt, name)];
    if let (Some(mpm), Some(dem)) = (mpm, dem)
        && mpm.mass_min > 0.0
        && sides.mpm.contact_omega_sq == 0.0
    {
        // docs/physics.md section 4: contact adds k_n over the mass of the point to the squared frequency.
        let mut touching = *sides;
        touching.mpm.contact_omega_sq = dem.stiffness_max / mpm.mass_min;
        let name = "once the lightest point presses on the stiffest contact";
        limits.push((stability.limit(&touching).dt, name.to_owned()));
    }
    let own = scene.time.max_step.unwrap_or(f64::INFINITY);
    limits.push((own, "the scene's own limit (time.max_step)".to_owned()));
    let every = scene.output.every;
    limits.push((every, "history interval (output.every)".to_owned()));
    limits.retain(|(step, _)| step.is_finite() && *step > 0.0);
    limits.sort_by(|a, b| a.0.total_cmp(&b.0));
    limits
}

/// The step of impacts, if bodies can collide.
fn impacts(scene: &Scene, ready: &Readiness) -> Option<[f64; 2]> {
    let dem = scene.dem.as_ref()?;
    dem.body_contact?;
    // A stiffness that grows with the overlap is not known in advance. Without another there is no frequency.
    let stiffness = dem.body_laws().filter_map(|law| law.constant_stiffness());
    let omega = (stiffness.fold(0.0, f64::max) / ready.mass_min).sqrt();
    let [resolution, _] = dem.resolutions();
    let angle = scene.time.safety * scene.time.step_factor * resolution;
    let cap = scene.time.max_step.unwrap_or(f64::INFINITY);
    let step = (angle / omega).min(cap);
    // Number of steps in half a period of an elastic contact.
    let steps = (PI / (omega * step)).ceil();
    (omega > 0.0 && step.is_finite() && step > 0.0).then_some([step, steps])
}

impl Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "before the first step")?;
        for (party, ready) in &self.ready {
            let things = if *party == Party::Mpm {
                "points"
            } else {
                "bodies"
            };
            let ready = ready.as_ref();
            let items =
                ready.map_or_else(|| "not known".to_owned(), |ready| ready.items.to_string());
            writeln!(f, "  {things:<8} {items}, memory {}", memory(ready))?;
        }
        for (i, (step, from)) in self.limits.iter().enumerate() {
            let name = if i == 0 { "step" } else { "" };
            let binds = if i == 0 { "  <- binds" } else { "" };
            writeln!(f, "  {name:<8} {step:.3e} s  {from}{binds}")?;
        }
        let more = if self.impacts.is_some() {
            ", and more for impacts"
        } else {
            ""
        };
        if let Some([step, steps]) = self.impacts {
            writeln!(
                f,
                "  impacts  {step:.3e} s  while bodies come into contact or separate: about {steps} steps each \
                 (dem.contact_resolution)"
            )?;
        }
        match self.steps() {
            Some(steps) => writeln!(f, "  steps    about {steps}{more}"),
            None => writeln!(f, "  step     not known before the run"),
        }
    }
}

/// The memory of a state in words, which a solver may not know.
fn memory(ready: Option<&Readiness>) -> String {
    match ready.map_or(0, |ready| ready.bytes) {
        0 => "not known".to_owned(),
        bytes => Bytes(bytes).to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An end of 800 s in place of 8 was not mentioned.
    #[test]
    fn a_run_of_days_is_told() {
        let of = |end: f64, items: u64| Estimate {
            ready: vec![(
                Party::Mpm,
                Some(Readiness {
                    items,
                    ..Readiness::default()
                }),
            )],
            limits: vec![(1e-5, String::new())],
            impacts: None,
            end,
        };
        assert_eq!(of(8.0, 100_000).too_long(), None);
        let message = of(800.0, 100_000).too_long().unwrap();
        assert!(
            message.starts_with("about 8.0e7 steps, which take 2.8 days or more"),
            "{message}"
        );
        assert!(message.ends_with("`time.end` is 800 s"), "{message}");
        assert_eq!(
            Estimate {
                limits: Vec::new(),
                ..of(800.0, 100_000)
            }
            .too_long(),
            None
        );
    }
}

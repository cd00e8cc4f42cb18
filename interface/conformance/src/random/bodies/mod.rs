//! The cases of a solver of bodies: points that walk along bodies as the kit says.

mod admit;
mod case;
mod compare;
mod generate;
mod law;
mod oracle;
mod run;
mod shrink;

use std::fmt::Write as _;
use std::time::Duration;

use interface::config::capability::Capabilities;
use interface::message::control::Configure;

use super::judge::{Judge, Number, Vector};
use super::plan::Epoch;
use super::run::{Begun, Stop, Window};
use crate::bench::{Bench, BodiesRun, configure};
use case::Along;
pub use case::Case;
use run::Stand;

impl super::run::Case for Case {
    type Run<'b> = BodiesRun<'b>;
    type Stand = Stand;
    const CAUSES: &'static [&'static str] = &["T-1", "J-1", "F-8", "F-7", "F-5", "F-6"];

    fn of_seed(seed: u64, takes: &Capabilities) -> Self {
        generate::case(seed, takes)
    }

    fn epochs(&mut self) -> &mut Vec<Epoch> {
        &mut self.epochs
    }

    fn possible(&self) -> u32 {
        admit::steps(self)
    }

    fn order(&self) -> Configure {
        configure(&self.config)
    }

    fn begun<'b>(&self, bench: &'b Bench, _: &mut Judge) -> Result<Begun<'b, Self>, Stop> {
        Ok((bench.run_bodies(&self.config)?, Stand::new(self)))
    }

    fn window(
        &self,
        run: &mut BodiesRun,
        stand: &mut Stand,
        window: Window,
        judge: &mut Judge,
    ) -> Result<(), Stop> {
        run::window_of(run, self, stand, window, judge)
    }

    fn end(&self, run: BodiesRun, _: Stand, _: &mut Judge) -> Result<(), Stop> {
        run.lead.closed()?.end(Duration::from_millis(500));
        Ok(())
    }

    fn barer(&self) -> Self {
        self.clone()
    }

    fn smaller(&self, step: u32) -> Vec<Self> {
        shrink::smaller(self, step)
    }

    fn story(&self, step: u32) -> Vec<String> {
        let (points, bodies) = (self.points.len(), self.config.bodies.len());
        let mut story = vec![format!("in {points} points and {bodies} bodies:")];
        for (b, body) in self.config.bodies.iter().enumerate() {
            story.push(format!("body {b}: {}", of_body(body)));
        }
        for point in &self.points {
            let along = match point.along {
                Along::Body(b) => format!("body {b}"),
                Along::Point(k) => format!("point {}", self.points[k].id),
                Along::Axis => "the x axis".to_owned(),
            };
            let overlap = Number(point.overlap.at(step) / point.radius);
            let way = point.way.at(step) - point.way.at(step.saturating_sub(1));
            story.push(format!(
                "point {}: at {along} with an overlap of {overlap} r_p, slides by {} r_p in the step, r_p = {} m",
                point.id,
                Number(way / point.radius),
                Number(point.radius)
            ));
        }
        let law =
            |law: &interface::config::ContactLaw| serde_json::to_string(law).unwrap_or_default();
        story.push(format!("contact: {}", law(&self.config.point_contact)));
        if let Some(between) = &self.config.body_contact {
            story.push(format!("body_contact: {}", law(between)));
        }
        story
    }
}

/// A body in words.
fn of_body(body: &interface::config::BodyConfig) -> String {
    let name = |value: serde_json::Result<serde_json::Value>| match value {
        Ok(serde_json::Value::String(name)) => name,
        Ok(serde_json::Value::Object(map)) => map.keys().next().cloned().unwrap_or_default(),
        _ => String::new(),
    };
    let mut words = format!(
        "{}, {}, sphero-radius {} m",
        name(serde_json::to_value(&body.shape)),
        name(serde_json::to_value(body.motion)),
        Number(body.sphero_radius)
    );
    if body.spin != 0.0 {
        let _ = write!(words, ", spin {} rad/s", Number(body.spin));
    }
    if body.velocity != [0.0; 2] {
        let _ = write!(words, ", velocity {} m/s", Vector(body.velocity));
    }
    words
}

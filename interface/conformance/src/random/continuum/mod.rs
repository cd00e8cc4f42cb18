//! The cases of a continuum: clouds of elastic points, on which bodies press as the kit says.

mod case;
mod compare;
mod generate;
mod oracle;
mod run;

use std::time::Duration;

use interface::config::capability::{Capabilities, STRESS_WORK};
use interface::message::control::{Configure, Order};

use super::judge::{Judge, Number, Vector};
use super::plan::Epoch;
use super::run::{Begun, Stop, Window};
use crate::bench::{Bench, ContinuumRun, configure};
pub use case::Case;
use oracle::Oracle;
use run::Stand;

impl super::run::Case for Case {
    type Run<'b> = ContinuumRun<'b>;
    type Stand = Stand;
    const CAUSES: &'static [&'static str] = &["T-1a", "F-1a", "I-2g", "I-7a", "I-6a"];

    fn of_seed(seed: u64, takes: &Capabilities) -> Self {
        generate::case(seed, takes)
    }

    fn epochs(&mut self) -> &mut Vec<Epoch> {
        &mut self.epochs
    }

    fn possible(&self) -> u32 {
        let sound = self.config.faults().is_empty() && !self.config.groups.is_empty();
        let known = sound && Oracle::new(&self.config).is_some();
        if known {
            super::plan::steps(&self.epochs)
        } else {
            0
        }
    }

    fn order(&self) -> Configure {
        configure(&self.config)
    }

    fn begun<'b>(&self, bench: &'b Bench, judge: &mut Judge) -> Result<Begun<'b, Self>, Stop> {
        let oracle = Oracle::new(&self.config).ok_or(Stop::Doubtful)?;
        let run = bench.run_continuum(&self.config)?;
        judge.readiness(&oracle, &run.ready.readiness)?;
        Ok((run, Stand::new(oracle, bench.takes(STRESS_WORK))))
    }

    fn window(
        &self,
        run: &mut ContinuumRun,
        stand: &mut Stand,
        window: Window,
        judge: &mut Judge,
    ) -> Result<(), Stop> {
        run::window_of(run, self, stand, window, judge)
    }

    fn end(&self, mut run: ContinuumRun, mut stand: Stand, judge: &mut Judge) -> Result<(), Stop> {
        let (header, points) = run.drain()?;
        judge.all_points("D-1a", (run.next(), header), &points, &mut stand)?;
        run.session.order(&Order::Close)?;
        run.session.end(Duration::from_millis(500));
        Ok(())
    }

    fn barer(&self) -> Self {
        let pushes = Vec::new();
        Self {
            pushes,
            ..self.clone()
        }
    }

    fn smaller(&self, _: u32) -> Vec<Self> {
        case::smaller(self)
    }

    fn story(&self, _: u32) -> Vec<String> {
        let c = &self.config;
        let word = |value: serde_json::Result<String>| value.unwrap_or_default();
        let mut story = vec![format!(
            "in {} cells of {} m, shape {}, transfer {}, stress_update {}, walls {}:",
            (c.domain[1][0] - c.domain[0][0]) / c.cell,
            c.cell,
            word(serde_json::to_string(&c.shape)),
            word(serde_json::to_string(&c.transfer)),
            word(serde_json::to_string(&c.stress_update)),
            word(serde_json::to_string(&c.walls)),
        )];
        for (g, group) in c.groups.iter().enumerate() {
            story.push(format!(
                "group {g}: {}, velocity {} m/s, fields {}",
                word(serde_json::to_string(&group.fill)),
                Vector(group.velocity),
                word(serde_json::to_string(&group.fields))
            ));
        }
        for push in &self.pushes {
            let [from, to] = push.steps;
            let (point, force) = (push.point, Vector(push.force));
            let stiffness = Number(push.stiffness);
            story.push(format!(
                "push on point {point} in steps {from} to {to}: {force} N/m, stiffness {stiffness} N/m"
            ));
        }
        story
    }
}

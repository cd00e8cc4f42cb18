//! The configuration of each solver.

use interface::config::{DemConfig, MpmConfig, to_json};
use interface::message::control::{Configure, Party};
use interface::session::{Part, Solvers};

use super::Run;
use crate::run::failure::RunError;
use crate::scene::unmet;

impl Run<'_> {
    pub(super) fn parts(&mut self, solvers: &Solvers) -> Result<Vec<Part>, RunError> {
        let parties = self.parties.clone();
        for &party in &parties {
            self.check_needs(party, solvers)?;
        }
        self.keep_checkpoints(solvers);
        Ok(parties.into_iter().map(|party| self.part(party)).collect())
    }

    /// K-2.
    fn check_needs(&self, party: Party, solvers: &Solvers) -> Result<(), RunError> {
        let hello = solvers.hello(party).expect("Hello has come");
        match unmet(self.scene, party, &hello.identity, &hello.capabilities) {
            Some(unmet) => Err(RunError::Unmet(unmet)),
            None => Ok(()),
        }
    }

    /// The configuration of a solver, with the state that it begins with.
    fn part(&mut self, party: Party) -> Part {
        let threads = self.options.threads;
        let (config, measured) = match party {
            Party::Mpm => {
                let config = self.scene.continuum().expect("it takes part");
                // Probes, holds and chains are reported like groups, after them.
                let sets = config.probes.len() + config.forcing.holds.len() + config.chains.len();
                let groups = config.groups.len() + sets;
                (to_json(&MpmConfig { threads, ..config }), groups)
            }
            Party::Dem => {
                let config = self.scene.dem.clone().expect("it takes part");
                let bodies = config.bodies.len();
                (to_json(&DemConfig { threads, ..config }), bodies)
            }
            Party::Coupler => unreachable!("the coupler has no configuration"),
        };
        let restored = self.restored.iter().position(|(of, _)| *of == party);
        Part {
            configure: Configure {
                scene_hash: self.scene.hash.clone(),
                config,
                coupled: self.parties.len() == 2,
                deadline: self.scene.coupling.deadline,
                restore: false,
            },
            measured,
            restore: restored.map(|at| self.restored.swap_remove(at).1),
        }
    }
}

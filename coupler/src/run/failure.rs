//! The reasons why a run did not reach its end, their exit statuses, and advice for the user.

use interface::message::control::Party;
use interface::session::SessionError;
use interface::solver::Fault;
use thiserror::Error;

use crate::record::rundir::RunDirError;
use crate::record::summary::Status;
use crate::run::launch::StartError;
use crate::run::stability::Bound;
use crate::scene::diagnostic::SceneErrors;
use crate::scene::{Scene, refused};

/// Why a run did not reach its end.
#[derive(Debug, Error)]
pub enum RunError {
    /// A solver could not be started.
    #[error(transparent)]
    Start(#[from] StartError),
    /// A party failed, vanished, was late, refused, or broke the protocol.
    #[error("{0}")]
    Session(#[from] SessionError),
    /// The limits ask for a step below the scene's shortest.
    #[error(
        "at t = {time:.6e} s (step {step}) the {bound} limit requires a step of {dt:.3e} s, below time.min_step = {min_step:.3e} s",
        bound = bound.name()
    )]
    Collapsed {
        /// Simulated time in s.
        time: f64,
        /// Step.
        step: u64,
        /// The limit that requires it.
        bound: Bound,
        /// Step asked for in s.
        dt: f64,
        /// The scene's shortest in s.
        min_step: f64,
    },
    /// The computation has created energy.
    #[error(
        "at t = {time:.6e} s (step {step}) {percent:.0} % of the energy in play was created numerically: the computation is {} with dt = {dt:.3e} s ({bound})",
        if *.stable { "stable, but not resolved," } else { "unstable" }
    )]
    BlowUp {
        /// Simulated time in s.
        time: f64,
        /// Step.
        step: u64,
        /// Residual in percent of the energy in play.
        percent: f64,
        /// Step in s.
        dt: f64,
        /// The limit that determined it.
        bound: &'static str,
        /// Whether the step was within the composed limit. Then the computation is stable, but contacts that open and
        /// close, or waves of a few cells, take too few steps.
        stable: bool,
    },
    /// The session ended because of what happened to shared memory.
    #[error("{cause}; {error}")]
    SharedMemory {
        /// How the session ended.
        error: SessionError,
        /// What happened to shared memory.
        cause: String,
    },
    /// The scene needs a capability that a solver does not list (clause K-2).
    #[error("{0}")]
    Unmet(SceneErrors),
    /// A defect of this program: a panic while the solvers share its thread.
    #[error("this program has a defect: {0}")]
    Panicked(String),
    /// The run was asked to end, and did not end in order: before which step, or why.
    #[error("interrupted {0}")]
    Interrupted(String),
    /// The run directory cannot be written any more.
    #[error(transparent)]
    Output(#[from] RunDirError),
}

impl RunError {
    /// What the user can do about it.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::Start(_) => "check the command: --mpm or --dem, or `[solvers]` of the scene",
            Self::Collapsed { .. } => {
                "find the cause of the small limit: a tiny mass or cell, a very stiff contact, a state that diverges"
            }
            Self::BlowUp { stable: true, .. } => {
                "resolve it: lower dem.contact_resolution (contacts that open and close) or time.safety, use finer cells, or mpm.stress_update = \"usavg\""
            }
            Self::BlowUp { stable: false, .. } => {
                "lower time.safety, time.step_factor or time.max_step"
            }
            Self::SharedMemory { .. } => {
                "the results so far are in the run directory, and `tandem resume` continues from its last checkpoint if it has one"
            }
            Self::Unmet(_) => "change these keys of the scene, or use another solver",
            Self::Panicked(_) => "please report it, with the scene",
            Self::Interrupted(_) => "the results until then are kept",
            Self::Output(error) => error.advice(),
            Self::Session(error) => match error {
                SessionError::Vanished { .. } => {
                    "the results until then are kept; the standard error of the solver is in mpm.log or dem.log"
                }
                SessionError::Late {
                    awaited: "its hello",
                    ..
                } => {
                    "its command may be wrong, or it may hang at its start: run it by hand; if it only needs more time, raise coupling.start_deadline"
                }
                SessionError::Late {
                    awaited: "that it is ready",
                    ..
                } => {
                    "if it only needs more time to take the scene, raise coupling.start_deadline; if it hangs, attach a debugger to its process"
                }
                SessionError::Late {
                    awaited: "its goodbye",
                    ..
                } => "it hangs after the last step; attach a debugger to its process",
                SessionError::Late { .. } => {
                    "if the solver only needs more time, raise coupling.deadline; if it hangs, attach a debugger to its process"
                }
                SessionError::Contract { .. } => {
                    "interface/PROTOCOL.md has the clause; the solver must be corrected"
                }
                SessionError::Refused { .. } => "change that key of the scene",
                SessionError::Recording(_) => "make room, or run without --record",
                SessionError::Failed { failure, .. }
                    if matches!(failure.fault, Some(Fault::LeftDomain { .. })) =>
                {
                    "nothing keeps the material on the grid: add a body or a wall (mpm.walls), enlarge mpm.domain, or write mpm.leaving = \"remove\""
                }
                SessionError::Failed { failure, .. } if failure.fault.is_none() => {
                    "what it names is a fault of the exchange: interface/PROTOCOL.md has the clauses, mpm.log and dem.log what the solvers wrote"
                }
                SessionError::Failed { .. } => {
                    "history.csv shows how the values grew; a smaller time.max_step may help"
                }
                _ => "log.jsonl in the run directory has the details",
            },
        }
    }

    /// The solver at which the run failed, if it is a solver's error.
    pub fn party(&self) -> Option<Party> {
        match self {
            Self::Session(
                SessionError::Vanished { who, .. }
                | SessionError::Late { who, .. }
                | SessionError::Contract { who, .. }
                | SessionError::Refused { who, .. }
                | SessionError::Failed { who, .. },
            ) => Some(*who),
            _ => None,
        }
    }

    /// That a solver does not take `scene`, with the lines of the scene.
    pub fn refusal(&self, scene: &Scene) -> Option<SceneErrors> {
        match self {
            Self::Session(SessionError::Refused { who, refusal }) => {
                Some(refused(scene, *who, refusal))
            }
            Self::Unmet(errors) => Some(errors.clone()),
            _ => None,
        }
    }

    /// The status of a run that ends with this error.
    pub fn status(&self) -> Status {
        match self {
            Self::Collapsed { .. } | Self::BlowUp { .. } => Status::Unstable,
            Self::Session(SessionError::Failed { failure, .. })
                if matches!(failure.fault, Some(Fault::NotFinite { .. })) =>
            {
                Status::Unstable
            }
            Self::Interrupted(_) => Status::Interrupted,
            Self::Session(_)
            | Self::SharedMemory { .. }
            | Self::Start(_)
            | Self::Output(_)
            | Self::Unmet(_)
            | Self::Panicked(_) => Status::Failed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interface::message::control::Failure;

    #[test]
    fn created_energy_is_reported_as_unstable_or_unresolved() {
        let blow_up = |stable: bool| RunError::BlowUp {
            time: 1.0,
            step: 2,
            percent: 60.0,
            dt: 1e-3,
            bound: "bodies",
            stable,
        };
        let unstable = blow_up(false).to_string();
        assert!(unstable.contains("is unstable with dt = 1.000e-3 s (bodies)"));
        let coarse = blow_up(true);
        assert!(
            coarse
                .to_string()
                .contains("is stable, but not resolved, with dt")
        );
        assert!(coarse.advice().contains("dem.contact_resolution"));
        assert!(!blow_up(false).advice().contains("resolution"));
    }

    /// "a smaller time.max_step may help" was advised where a solver had sent too few forces.
    #[test]
    fn a_fault_of_the_exchange_is_not_blamed_on_the_step() {
        let advice = |fault| {
            let failure = Failure {
                step: 0,
                fault,
                message: "the dem broke clause F-3 of the protocol".into(),
            };
            let who = Party::Mpm;
            RunError::Session(SessionError::Failed { who, failure }).advice()
        };
        assert!(advice(None).contains("interface/PROTOCOL.md"));
        assert!(!advice(None).contains("max_step"));
        let fault = Fault::Other("point 3 is near the middle of body 1".into());
        assert!(advice(Some(fault)).contains("max_step"));
    }

    /// D12, D14: "raise coupling.deadline" was advised where it has no effect, and "make room" for any write error.
    #[test]
    fn advice_is_for_the_error_at_hand() {
        let late = |awaited| {
            RunError::Session(SessionError::Late {
                who: Party::Dem,
                awaited,
                step: 0,
                waited: std::time::Duration::from_secs(30),
            })
        };
        for (awaited, key) in [
            ("its report", "coupling.deadline"),
            ("its hello", "coupling.start_deadline"),
            ("that it is ready", "coupling.start_deadline"),
        ] {
            assert!(late(awaited).advice().contains(&format!("raise {key}")));
        }
        assert!(!late("its goodbye").advice().contains("raise"));
        let output = |errno| {
            let source = std::io::Error::from_raw_os_error(errno);
            let failed = crate::record::fail("write", "history.csv".as_ref());
            RunError::Output(failed(source).into())
        };
        let (full, forbidden) = (output(28), output(13));
        assert!(full.advice().contains("the disk is full"));
        assert!(full.to_string().contains("No space left on device"));
        assert!(!forbidden.advice().contains("room"));
    }
}

//! `tandem check` and `tandem plan`: what a scene is, without a run.

use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use coupler::run::checkpoint::branch::Branch;
use coupler::run::resources;
use coupler::scene::{Scene, SceneFile, refused};
use interface::config::{DemConfig, MpmConfig};
use interface::message::control::Party;
use interface::message::wire::{ContactState, ImpForce};
use interface::solver::{DemSolver, Fault, MpmSolver};
use interface::step::Step;

use crate::cli::{CheckArgs, PlanArgs};
use crate::cost::measure;
use crate::exit::BAD_INPUT;
use crate::run::{options, untrusted};
use crate::terminal::{complain, say};
use crate::{machine, solvers};

/// Validates scenes, each with all of its variants unless one is asked for.
pub fn check(args: &CheckArgs) -> ExitCode {
    let mut code = ExitCode::SUCCESS;
    for path in &args.scenes {
        let file = match SceneFile::read(path) {
            Ok(file) => file,
            Err(errors) => {
                complain(errors);
                code = ExitCode::from(BAD_INPUT);
                continue;
            }
        };
        let mut variants = vec![args.variant.clone()];
        while let Some(variant) = variants.pop() {
            let loaded = file.scene(variant.as_deref(), &args.set);
            if variant.is_none()
                && let Ok(scene) = &loaded
            {
                variants.extend(scene.variants.iter().rev().cloned().map(Some));
            }
            let which = variant.map_or(String::new(), |name| format!(", variant {name}"));
            if let Err(reason) = loaded
                .map_err(|errors| errors.to_string())
                .and_then(|scene| valid(scene, path, &which))
            {
                complain(reason);
                code = ExitCode::from(BAD_INPUT);
            }
        }
    }
    code
}

/// Says that a scene is valid, if it is.
fn valid(mut scene: Scene, path: &Path, which: &str) -> Result<(), String> {
    let more = begin(&mut scene)?;
    for warning in scene.warnings.iter().chain(&more) {
        say(format_args!(
            "warning: {}{which}: {warning}",
            path.display()
        ));
    }
    say(format_args!(
        "{}: {} is a valid scene{which}",
        path.display(),
        scene.name
    ));
    Ok(())
}

/// Shows what would run.
pub fn plan(args: &PlanArgs) -> ExitCode {
    let shown = args
        .scene
        .load()
        .map_err(|errors| errors.to_string())
        .and_then(|mut scene| {
            say(scene.plan());
            say(format_args!("  shared   {}", resources::in_words(&scene)));
            if let Some(more) = begin(&mut scene)? {
                say(format_args!("  warning  {more}"));
            }
            if let Some(shortage) = machine::shortage(&scene, &args.how) {
                say(format_args!("  warning  {shortage}"));
            }
            say_cost(&scene, args);
            Ok(())
        });
    match shown {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            complain(reason);
            ExitCode::from(BAD_INPUT)
        }
    }
}

/// Prints the cost of a run, estimated from its first steps.
fn say_cost(scene: &Scene, args: &PlanArgs) {
    if args.measure == 0.0 {
        return;
    }
    let measured = match untrusted(scene, &args.how) {
        Some(_) => Err("the scene names programs as solvers (`--trust` starts them)".to_owned()),
        None => options(&args.how, false, scene)
            .and_then(|options| measure(scene, options, Duration::from_secs_f64(args.measure))),
    };
    match measured {
        Ok(cost) => say(format_args!("  time     {cost}")),
        Err(why) => say(format_args!("  time     not measured: {why}")),
    }
}

/// Lets the built-in solvers take the scene as a run begins: with the state of another run where `[start]` names one. What the
/// run changes in the scene is changed in it. Returned is a sentence on what presses already, or that the other run is not there.
///
/// # Errors
/// Why no run would come to its first step.
fn begin(scene: &mut Scene) -> Result<Option<String>, String> {
    if let Some(from) = scene.start.as_ref().filter(|start| !start.run.exists()) {
        let from = from.run.display();
        let missing = format!("`start.from` is not looked at: there is no {from} yet");
        return configured(scene).map(|_| Some(missing));
    }
    match Branch::find(scene).map_err(|errors| errors.to_string())? {
        Some(branch) => go_on(scene, &branch).map(|()| None),
        None => start(scene),
    }
}

/// Lets the built-in solvers take the scene and the state that it begins with.
///
/// # Errors
/// Why no run would come to its first step.
fn go_on(scene: &Scene, branch: &Branch) -> Result<(), String> {
    let refused = |refusal| refused(scene, &refusal).to_string();
    let (mpm, dem) = configured(scene)?;
    if let (Some(mut mpm), Some(saved)) = (mpm, branch.saved(Party::Mpm)) {
        mpm.restore(saved).map_err(refused)?;
    }
    if let (Some(mut dem), Some(saved)) = (dem, branch.saved(Party::Dem)) {
        dem.restore(saved).map_err(refused)?;
    }
    Ok(())
}

/// Lets the built-in solvers take the scene and do the opening step of a run, in which nothing moves: so a check refuses
/// what a run would, from the same code. A solver of another program is not asked. Returned is a sentence on what presses
/// already.
///
/// # Errors
/// Why no run would come to its first step.
fn start(scene: &Scene) -> Result<Option<String>, String> {
    let pressing = opening_step(configured(scene)?)
        .map_err(|fault| format!("error: at the start of a run {fault}"))?;
    Ok(told(scene, &pressing))
}

/// What presses at the start, which is meant where something stands and not where stones were put into one another.
fn told(scene: &Scene, pressing: &[ContactState]) -> Option<String> {
    let size = |contact: &&ContactState| contact.force[0].hypot(contact.force[1]);
    let most = pressing.iter().max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let name = |body: u64| {
        let body = scene.dem.as_ref()?.bodies.get(body as usize)?;
        Some(format!("body `{}`", body.name))
    };
    let point = || Some("a point".to_owned());
    let (on, other) = match most.with {
        0 => (name(most.body), name(most.other)),
        1 => (name(most.body), point()),
        _ => (point(), point()),
    };
    let count = pressing.len();
    Some(format!(
        "{count} contact{} at t = 0, the largest force is {:.3e} N/m, of {} on {}; what is not meant to press has to be moved",
        if count == 1 { " presses" } else { "s press" },
        size(&most),
        other?,
        on?,
    ))
}

/// The solvers of a scene; `None` for a side that it lacks or that another program computes.
type Solvers = (Option<Box<dyn MpmSolver>>, Option<Box<dyn DemSolver>>);

/// The built-in solvers that `scene` uses, which have taken it.
///
/// # Errors
/// Why they do not take it.
fn configured(scene: &Scene) -> Result<Solvers, String> {
    let refused = |refusal| refused(scene, &refusal).to_string();
    let ours = |config: &MpmConfig| {
        let mut mpm = solvers::mpm();
        mpm.configure(config).map(|_| mpm).map_err(refused)
    };
    let mpm = scene.mpm.as_ref().filter(|_| scene.solvers.mpm.is_none());
    let mpm = mpm.map(ours).transpose()?;
    let ours = |config: &DemConfig| {
        let mut dem = solvers::dem();
        dem.configure(config).map(|_| dem).map_err(refused)
    };
    let dem = scene.dem.as_ref().filter(|_| scene.solvers.dem.is_none());
    Ok((mpm, dem.map(ours).transpose()?))
}

/// The order of PROTOCOL.md for one step of length zero; returns the contacts that press in it.
fn opening_step((mpm, dem): Solvers) -> Result<Vec<ContactState>, Fault> {
    let step = Step {
        index: 0,
        time: 0.0,
        dt_before: 0.0,
        dt: 0.0,
        measure: false,
    };
    match (mpm, dem) {
        (Some(mut mpm), Some(mut dem)) => {
            let set = mpm.select_imps(dem.envelopes()).to_vec();
            dem.imp_set(&set);
            let mut forces = vec![ImpForce::default(); set.len()];
            let states = mpm.imp_states().to_vec();
            dem.contact(&step, &states, &mut forces)?;
            mpm.step(&step, &forces)?;
            Ok(dem.contacts(&step, &states))
        }
        (Some(mut mpm), None) => {
            mpm.step(&step, &[])?;
            Ok(Vec::new())
        }
        (None, Some(mut dem)) => {
            dem.contact(&step, &[], &mut [])?;
            Ok(dem.contacts(&step, &[]))
        }
        (None, None) => Ok(Vec::new()),
    }
}

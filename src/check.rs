//! `tandem check` and `tandem plan`: what a scene is, without a run.

use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use coupler::run::checkpoint::branch::Branch;
use coupler::run::estimate::Estimate;
use coupler::run::resources;
use coupler::run::stability::Sides;
use coupler::scene::{Scene, SceneFile, pressing, refuse_points_within_bodies, refused};
use interface::config::{DemConfig, MpmConfig};
use interface::forces::{Forces, Points};
use interface::message::control::Party;
use interface::solver::{DemSolver, Fault, MpmSolver, Readiness};
use interface::step::Step;

use crate::cli::{CheckArgs, PlanArgs};
use crate::cost::measure;
use crate::exit::{BAD_INPUT, Failed};
use crate::run::{options, timeline, trusted};
use crate::terminal::{complain, say};
use crate::{machine, solvers};

/// Most points for which a check asks the solvers: an answer should not take longer than a second.
const POINTS_AT_ONCE: f64 = 300_000.0;

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
    let begun = begin(&mut scene, POINTS_AT_ONCE)?;
    let lack = resources::check(&scene).err().map(|lack| lack.to_string());
    let too_long = Estimate::new(&scene, begun.ready, begun.limits.as_ref()).too_long();
    let warnings = scene.warnings.iter().chain(&begun.warning);
    for warning in warnings.chain(&too_long).chain(&lack) {
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
pub fn plan(args: &PlanArgs) -> Result<ExitCode, Failed> {
    let loaded = args.scene.load_with(&[]);
    let mut scene = loaded.map_err(|errors| errors.to_string())?;
    let begun = begin(&mut scene, f64::INFINITY)?;
    // Only now it is known when a scene begins that goes on from another run.
    let plan = scene.plan();
    let estimate = Estimate::new(&scene, begun.ready, begun.limits.as_ref());
    say(format_args!("{plan}{}", estimate.to_string().trim_end()));
    say(format_args!("  shared   {}", resources::in_words(&scene)));
    if let Some(more) = begun.warning {
        say(format_args!("  warning  {more}"));
    }
    if let Some(shortage) = machine::shortage(&scene, &args.how) {
        say(format_args!("  warning  {shortage}"));
    }
    say_cost(&scene, args);
    Ok(ExitCode::SUCCESS)
}

/// Prints the cost of a run, estimated from its first steps.
fn say_cost(scene: &Scene, args: &PlanArgs) {
    if args.measure == 0.0 {
        return;
    }
    let measured = match trusted(scene, &args.how) {
        Err(_) => Err("the scene names programs as solvers (`--trust` starts them)".to_owned()),
        Ok(()) => options(&args.how, false, scene).and_then(|mut options| {
            options.trace = timeline(&args.how)?;
            measure(scene, options, Duration::from_secs_f64(args.measure))
        }),
    };
    match measured {
        Ok(cost) => say(format_args!("  time     {cost}")),
        Err(why) => say(format_args!("  time     not measured: {why}")),
    }
}

/// What the solvers say of a scene that they have taken.
#[derive(Default)]
struct Begun {
    /// The continuum and the bodies, as they are ready; none if a side is not there or another program's.
    ready: [Option<Readiness>; 2],
    /// After the opening step, if there was one and both sides are ours.
    limits: Option<Sides>,
    /// What presses already, or that the run to begin with is not there.
    warning: Option<String>,
}

/// Lets the built-in solvers take the scene as a run begins: with the state of another run where `[start]` names one. What the
/// run changes in the scene is changed in it. Of more than `most` points only the number is looked at.
///
/// # Errors
/// Why no run would come to its first step.
fn begin(scene: &mut Scene, most: f64) -> Result<Begun, String> {
    let missing = scene.start.as_ref().filter(|start| !start.run.exists());
    let missing = missing.map(|start| start.run.display().to_string());
    let branch = match missing {
        Some(_) => None,
        None => Branch::find(scene).map_err(|errors| errors.to_string())?,
    };
    resources::check_memory(scene).map_err(|error| format!("error: {error}"))?;
    refuse_points_within_bodies(scene).map_err(|errors| errors.to_string())?;
    let mut begun = Begun::default();
    if scene.points_estimate() > most {
        begun.warning = Some(format!(
            "about {:.1e} points: the solvers were not asked; `tandem plan` does that",
            scene.points_estimate()
        ));
        return Ok(begun);
    }
    let (mut solvers, ready) = configured(scene)?;
    begun.ready = ready;
    if let Some(from) = missing {
        let missing = format!("`start.from` is not looked at: there is no {from} yet");
        begun.warning = Some(missing);
    } else if let Some(branch) = branch {
        restore(scene, &branch, &mut solvers)?;
    } else {
        let (limits, pressing) = opening_step(scene, solvers)
            .map_err(|fault| format!("error: at the start of a run {fault}"))?;
        let both_said = scene.solvers.mpm.is_none() && scene.solvers.dem.is_none();
        begun.limits = both_said.then_some(limits);
        begun.warning = pressing;
    }
    Ok(begun)
}

/// Lets the built-in solvers take the state with which the scene begins.
///
/// # Errors
/// Why no run would come to its first step.
fn restore(scene: &Scene, branch: &Branch, (mpm, dem): &mut Solvers) -> Result<(), String> {
    let refused = |who| move |refusal| refused(scene, who, &refusal).to_string();
    if let (Some(mpm), Some(saved)) = (mpm, branch.saved(Party::Mpm)) {
        mpm.restore(saved).map_err(refused(Party::Mpm))?;
    }
    if let (Some(dem), Some(saved)) = (dem, branch.saved(Party::Dem)) {
        dem.restore(saved).map_err(refused(Party::Dem))?;
    }
    Ok(())
}

/// The solvers of a scene; `None` for a side that it lacks or that another program computes.
type Solvers = (Option<Box<dyn MpmSolver>>, Option<Box<dyn DemSolver>>);

/// The built-in solvers that `scene` uses, which have taken it, and what they say of themselves.
///
/// # Errors
/// Why they do not take it.
fn configured(scene: &Scene) -> Result<(Solvers, [Option<Readiness>; 2]), String> {
    let refused = |who| move |refusal| refused(scene, who, &refusal).to_string();
    let ours = |config: MpmConfig| {
        let mut mpm = solvers::mpm();
        let ready = mpm.configure(&config).map_err(refused(Party::Mpm))?;
        Ok::<_, String>((mpm, ready))
    };
    let mpm = scene.continuum().filter(|_| scene.solvers.mpm.is_none());
    let (mpm, mpm_ready) = mpm.map(ours).transpose()?.unzip();
    let ours = |config: &DemConfig| {
        let mut dem = solvers::dem();
        let ready = dem.configure(config).map_err(refused(Party::Dem))?;
        Ok::<_, String>((dem, ready))
    };
    let dem = scene.dem.as_ref().filter(|_| scene.solvers.dem.is_none());
    let (dem, dem_ready) = dem.map(ours).transpose()?.unzip();
    Ok(((mpm, dem), [mpm_ready, dem_ready]))
}

/// The opening step of a run, in which nothing moves: so a check refuses what a run would, from the same code. Returned are
/// the limits after it, and what presses in it.
fn opening_step(scene: &Scene, (mpm, dem): Solvers) -> Result<(Sides, Option<String>), Fault> {
    let step = Step {
        index: 0,
        time: 0.0,
        dt_before: 0.0,
        dt: 0.0,
        measure: false,
    };
    let mut sides = Sides::default();
    let (mut set, mut states) = (Vec::new(), Vec::new());
    let (mut mpm, mut dem) = (mpm, dem);
    if let (Some(mpm), Some(dem)) = (&mut mpm, &mut dem) {
        set = mpm.select_imps(dem.envelopes()).to_vec();
        dem.imp_set(&set);
        states = mpm.imp_states().to_vec();
    }
    let mut forces = Forces::default();
    forces.clear(&states, []);
    let mut pressing = None;
    if let Some(dem) = &mut dem {
        let points = Points {
            set: &set,
            states: &states,
        };
        sides.dem = dem.contact(&step, &points, &mut forces)?.limits;
        pressing = self::pressing(scene, &dem.contacts(&step, &states), &set, &states);
    }
    if let Some(mpm) = &mut mpm {
        sides.mpm = mpm.step(&step, forces.on_points())?;
    }
    Ok((sides, pressing))
}

//! From a file to a scene: overrides, tables, defaults, the plan, and files that are none.

use std::path::{Path, PathBuf};
use std::time::Duration;

use coupler::record::check::Reference;
use coupler::run::estimate::Estimate;
use coupler::run::stability::Sides;
use coupler::scene::{Scene, solver_override};
use interface::config::{BodyInertia, ShapeFunction, Spacing, Transfer};
use interface::solver::Readiness;
use tempfile::TempDir;

const GOOD: &str = r#"
version = 1
name = "good"
[constants]
b = "2*a"
a = 3
[time]
end = 1.0
[mpm]
cell = 0.5
domain = [[0.0, 0.0], [5.0, 5.0]]
shape = "ugimp"
transfer = "flip"
[[mpm.material]]
name = "rubber"
density = 1000.0
model.linear_elastic = { bulk_modulus = 1e6, shear_modulus = 5e5 }
[[mpm.points]]
name = "block"
material = "rubber"
fill.rectangle = { lower = [1.0, 1.0], upper = [2.0, 2.0] }
spacing.per_cell = 4
[[dem.body]]
name = "floor"
shape = "disc"
sphero_radius = 0.5
position = [3.5, 3.5]
motion = "fixed"
[contact]
linear = { normal_stiffness = 1e5 }
[output]
every = 0.1
[[output.column]]
name = "y"
unit = "m"
value = "points.block.y"
[[check]]
name = "c"
value = "b*points.block.vy"
reference = "a*t"
tolerance = "a/3"
source = "made up"
[variant.quick]
"time.end" = 0.5
"mpm.points.0.spacing" = { distance = 0.1 }
[variant.other_law]
contact = { area = { area_stiffness = 1e7 } }
"#;

struct Files {
    directory: TempDir,
}

impl Files {
    fn new() -> Self {
        let directory = tempfile::tempdir().expect("temporary directory");
        Self { directory }
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.directory.path().join(name);
        std::fs::write(&path, content).expect("writable");
        path
    }

    fn load(&self, variant: Option<&str>, set: &[&str]) -> Scene {
        good(&self.write("scene.toml", GOOD), variant, set)
    }

    fn refusal(&self, variant: Option<&str>, set: &[&str]) -> String {
        load(&self.write("scene.toml", GOOD), variant, set).unwrap_err()
    }
}

fn load(path: &Path, variant: Option<&str>, set: &[&str]) -> Result<Scene, String> {
    let set: Vec<String> = set.iter().map(|&s| s.to_owned()).collect();
    Scene::load(path, variant, &set).map_err(|errors| errors.to_string())
}

#[track_caller]
fn good(path: &Path, variant: Option<&str>, set: &[&str]) -> Scene {
    load(path, variant, set).unwrap_or_else(|errors| panic!("{errors}"))
}

#[track_caller]
fn has(text: &str, words: &str) {
    assert!(text.contains(words), "no `{words}` in: {text}");
}

#[test]
fn defaults_are_as_documented() {
    let scene = Files::new().load(None, &[]);
    assert_eq!(scene.constants["b"], 6.0);
    assert_eq!(scene.time.safety, 0.8);
    assert_eq!(scene.time.shortest(), 1e-9);
    assert_eq!(scene.coupling.window, 64);
    assert_eq!(scene.coupling.deadline(), Duration::from_secs(30));
    let mpm = scene.mpm.expect("there is a continuum");
    // Half the point distance, which is half a cell; the skin is twice that.
    assert_eq!(mpm.groups[0].contact_radius, Some(0.125));
    assert_eq!(mpm.skin, 0.25);
    let dem = scene.dem.expect("there are bodies");
    assert_eq!(dem.bodies[0].inertia, BodyInertia::Density(1000.0));
    assert_eq!(dem.skin, 0.25);
}

/// Eq. 45 of Jiang 2020 is for a radius that a scene chooses: from the distance of points, 0.25 m, to the cell, 0.5 m.
#[test]
fn a_chosen_contact_radius_is_warned_of_out_of_range_and_the_default_is_not() {
    let warned = |set: &[&str]| {
        let warnings = Files::new().load(None, set).warnings;
        warnings.iter().any(|warning| warning.contains("eq. 45"))
    };
    assert!(!warned(&[]));
    for (radius, expected) in [(0.125, false), (0.24, true), (0.3, false), (0.6, true)] {
        let set = format!("mpm.points.0.contact_radius={radius}");
        assert_eq!(warned(&[&set]), expected, "{radius}");
    }
}

#[test]
fn set_wins_over_the_variant_and_the_variant_over_the_file() {
    let files = Files::new();
    assert_eq!(files.load(None, &[]).time.end, 1.0);
    let quick = files.load(Some("quick"), &[]);
    assert_eq!(quick.time.end, 0.5);
    let spacing = quick.mpm.expect("there is a continuum").groups[0].spacing;
    assert_eq!(
        spacing,
        Spacing::Distance(0.1),
        "an override replaces the whole value"
    );
    let both = files.load(Some("quick"), &["time.end=0.25", "time.end = 0.125"]);
    assert_eq!(both.time.end, 0.125, "the last one wins");
}

#[test]
fn a_variant_replaces_a_law_by_one_of_another_kind() {
    let files = Files::new();
    let law = |variant| {
        let dem = files.load(variant, &[]).dem.expect("there are bodies");
        dem.point_contact.name()
    };
    assert_eq!((law(None), law(Some("other_law"))), ("linear", "area"));
}

#[test]
fn set_takes_words_without_quotes_tables_and_new_keys() {
    let set = [
        "mpm.shape=quadratic_bspline",
        "mpm.transfer.blend.pic_fraction=0.1",
        "coupling.window=1",
        "mpm.points.0.velocity=[1.0, 0]",
    ];
    let scene = Files::new().load(None, &set);
    let mpm = scene.mpm.expect("there is a continuum");
    assert_eq!(mpm.shape, ShapeFunction::QuadraticBspline);
    assert_eq!(mpm.transfer, Transfer::Blend { pic_fraction: 0.1 });
    assert_eq!(mpm.groups[0].velocity, [1.0, 0.0]);
    assert_eq!(scene.coupling.window, 1);
}

#[test]
fn the_hash_is_that_of_the_resolved_scene_and_sees_every_override() {
    let files = Files::new();
    let plain = files.load(None, &[]);
    assert_eq!(plain.hash, files.load(None, &[]).hash);
    assert_ne!(plain.hash, files.load(None, &["time.end=0.25"]).hash);
    assert!(!plain.resolved_toml.contains("variant"));
    assert_eq!(*plain.variants, ["other_law", "quick"]);
}

#[test]
fn a_bad_override_names_the_command_line_or_the_variant() {
    let files = Files::new();
    let message = files.refusal(None, &["mpm.cel=0.1"]);
    has(&message, "unknown key `cel`");
    has(&message, "command line: --set mpm.cel=0.1  (mpm.cel)");
    has(&message, "did you mean `cell`?");
    for (set, phrase) in [
        ("mpm.cell=-1", "`mpm.cell` is -1, expected a length above 0"),
        ("mpm.cell", "`mpm.cell` sets nothing"),
        (
            "mpm.points.7.velocity=[0,0]",
            "`mpm.points` has no element 7",
        ),
        (
            "mpm.points.first.velocity=[0,0]",
            "`first` is not a number of an element",
        ),
        (
            "mpm.stage.first={from=0}",
            "`mpm.stage` is a table, expected a list",
        ),
        ("time={end=0.5}", "`time` would replace a whole section"),
    ] {
        has(&files.refusal(None, &[set]), phrase);
    }
    let scene = files.load(
        None,
        &["mpm.stage.0={from=0,damping=2}", "coupling={window=2}"],
    );
    assert!(scene.resolved_toml.contains("damping = 2"));
    assert_eq!(scene.coupling.window, 2, "a section that was not there");
    let message = files.refusal(Some("quik"), &[]);
    has(&message, "no variant `quik`");
    has(&message, "did you mean `quick`?");
    let path = files.write(
        "v.toml",
        GOOD.replace("\"time.end\" = 0.5", "\"time.end\" = -0.5"),
    );
    let message = load(&path, Some("quick"), &[]).expect_err("a negative time");
    has(&message, "set by variant `quick`");
    has(&message, "| \"time.end\" = -0.5");
}

#[test]
fn what_is_no_scene_file_is_refused_clearly() {
    let files = Files::new();
    let refusal = |path: &Path| load(path, None, &[]).expect_err("no scene");
    let message = refusal(&files.directory.path().join("missing.toml"));
    has(&message, "cannot read the scene file: No such file");
    has(&message, "missing.toml");
    let message = refusal(files.directory.path());
    has(&message, "it is a directory, not a regular file");
    let message = refusal(&files.write("empty.toml", "  \n"));
    has(&message, "the scene file is empty");
    let message = refusal(&files.write("latin.toml", b"name = \"\xe9\""));
    has(&message, "byte 8 is not UTF-8");
}

#[test]
fn a_csv_reference_is_read_beside_the_scene_and_written_into_the_resolved_one() {
    let files = Files::new();
    files.write(
        "curve.csv",
        "# from the paper\ntime , force\n0, 1.5\n0.5, 2.5\n",
    );
    let text = GOOD.replace(
        "reference = \"a*t\"",
        "reference = { csv = \"curve.csv\", t = \"time\", value = \"force\" }",
    );
    let path = files.write("scene.toml", &text);
    let scene = good(&path, None, &[]);
    let table = |scene: &Scene| match &scene.checks[0].expected.reference {
        Some(Reference::Table(rows)) => rows.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!(table(&scene), [[0.0, 1.5], [0.5, 2.5]]);
    let elsewhere = Files::new();
    let again = elsewhere.write("scene.toml", &scene.resolved_toml);
    let again = good(&again, None, &[]);
    assert_eq!(table(&again), table(&scene));
    assert_eq!(again.hash, scene.hash);

    for (content, expected) in [
        ("time,forse\n0,1\n", "did you mean `forse`?"),
        ("time,force\n0,1\n0,2\n", "times that grow"),
        (
            "time,force\n0,one\n",
            "curve.csv: \"one\" in row 1 of `force` is not a number",
        ),
        ("time,force\n", "at least one row"),
    ] {
        files.write("curve.csv", content);
        let message = load(&path, None, &[]).expect_err(content);
        has(&message, expected);
    }
}

#[test]
fn one_side_alone_is_a_scene() {
    let files = Files::new();
    let without = |from: &str, to: &str, text: &str| {
        let (start, end) = (text.find(from), text.find(to));
        let (start, end) = (start.expect("present"), end.expect("present"));
        format!("{}{}", &text[..start], &text[end..])
    };
    let points_only = without("[[dem.body]]", "[output]", GOOD);
    let scene = good(&files.write("p.toml", &points_only), None, &[]);
    assert!(scene.dem.is_none());
    let plan = scene.plan();
    has(&plan, "DEM process: the scene has no `[dem]`");

    let bodies_only = without("[mpm]", "[[dem.body]]", GOOD)
        .replace("points.block.y", "body.floor.y")
        .replace("points.block.vy", "body.floor.vy")
        .replace("\"mpm.points.0.spacing\" = { distance = 0.1 }", "");
    let scene = good(&files.write("b.toml", &bodies_only), None, &[]);
    assert!(scene.mpm.is_none());
    assert!(
        scene
            .warnings
            .iter()
            .any(|w| w.contains("`[contact]` has no effect"))
    );
    assert!(scene.dem.expect("there are bodies").skin > 0.0);
}

#[test]
fn bodies_that_cannot_touch_are_warned_about() {
    let second = "[[dem.body]]\nname = \"ball\"\nshape = \"disc\"\nsphero_radius = 0.1\nmass = 1\n\
                  position = [4.5, 4.5]\n[contact]";
    let files = Files::new();
    let path = files.write("scene.toml", GOOD.replace("[contact]", second));
    let scene = good(&path, None, &[]);
    assert!(
        scene
            .warnings
            .iter()
            .any(|w| w.contains("pass through one another"))
    );
    assert!(
        scene
            .plan()
            .contains("warning: there is no `[body_contact]`")
    );
    // Forces move no driven body, so such a contact would never be listed.
    let driven = ["dem.body.1.motion=driven", "check=[]"];
    let warnings = good(&path, None, &driven).warnings;
    let passes = |w: &String| w.contains("pass through one another");
    assert!(!warnings.iter().any(passes), "{warnings:?}");
}

#[test]
fn the_plan_names_what_runs_and_what_is_left_out() {
    let scene = Files::new().load(None, &[]);
    let text = scene.plan();
    // 2 x 2 cells of 4 points.
    has(&text, "about 16 points in groups: block");
    has(&text, ", 11 rows; ");
    has(&text, "bodies: 0 free, 0 driven, 1 fixed");
    let push = "dem.body.0.motion={ pushed = { force = [0, 1] } }";
    let pushed = Files::new().load(None, &["dem.body.0.mass=1", push]);
    has(&pushed.plan(), "bodies: 1 free, 0 driven, 0 fixed");
    let left_out = coupler::scene::plan::left_out(&scene);
    let left_out: Vec<&str> = left_out.iter().map(|l| l.what.as_str()).collect();
    for what in [
        "plastic state of points",
        "body force",
        "motion of 1 of 1 bodies",
        "tangential history of points on bodies",
        "search and contact among bodies",
    ] {
        assert!(left_out.contains(&what), "{what}: {left_out:?}");
    }
}

/// The solvers say their limits; the smallest of them and of the scene's own is named.
#[test]
fn the_estimate_names_what_binds_and_what_is_not_known() {
    let files = Files::new();
    let mpm = Readiness {
        items: 16,
        bytes: 3 << 10,
        mass_min: 62.5,
        ..Readiness::default()
    };
    let dem = Readiness {
        items: 1,
        stiffness_max: 1e5,
        ..Readiness::default()
    };
    let mut sides: Sides = Sides::default();
    sides.mpm.omega_sq = 1e4;
    let estimate = |set: &[&str], limits| {
        let scene = files.load(None, set);
        Estimate::new(&scene, [Some(mpm.clone()), Some(dem.clone())], limits)
    };
    let touching = estimate(&[], Some(&sides));
    let omega = (1e4 + 1e5 / 62.5f64).sqrt();
    let [binds, start, ..] = &touching.limits[..] else {
        panic!("{touching}");
    };
    assert!(binds.1.contains("stiffest contact"), "{touching}");
    assert!((binds.0 / (0.8 * 2.0 / omega) - 1.0).abs() < 1e-12);
    assert!((start.0 / (0.8 * 2.0 / 100.0) - 1.0).abs() < 1e-12);
    let text = touching.to_string();
    has(&text, "16, memory 3.0 KiB");
    has(&text, "1, memory not known");
    let capped = estimate(&["time.max_step=1e-6"], Some(&sides)).to_string();
    has(&capped, "(time.max_step)  <- binds");
    has(&capped, "about 1000000");
    let not_asked = estimate(&[], None).to_string();
    has(&not_asked, "not known before the run");
}

const BALLS: &str = r#"
version = 1
name = "balls"
time.end = 1.0
output.every = 0.1
[[dem.body]]
name = "ball"
shape = "disc"
sphero_radius = 0.1
mass = 4
[[dem.body]]
name = "floor"
shape = "disc"
sphero_radius = 0.1
position = [0.0, -0.3]
motion = "fixed"
[body_contact]
linear = { normal_stiffness = 1e6 }
"#;

#[test]
fn the_plan_says_what_impacts_cost_and_a_resolution_is_checked() {
    let files = Files::new();
    let dem = Readiness {
        mass_min: 4.0,
        ..Readiness::default()
    };
    let estimate = |scene: &Scene| Estimate::new(scene, [None, Some(dem.clone())], None);
    assert!(estimate(&files.load(None, &[])).impacts.is_none());
    let path = files.write("balls.toml", BALLS);
    let omega = (1e6_f64 / 4.0).sqrt();
    for (set, resolution) in [
        (&[][..], 0.04),
        (&["body_contact.linear.damping_ratio=0.1"], 0.2),
        (&["dem.contact_resolution=0.5"], 0.5),
    ] {
        let plan = estimate(&good(&path, None, set));
        let [longest, count] = plan.impacts.expect("bodies that meet");
        let step = 0.8 * resolution / omega;
        assert!((longest / step - 1.0).abs() < 1e-12, "{plan}");
        let steps = std::f64::consts::PI / (0.8 * resolution);
        assert_eq!(count, steps.ceil());
        let text = plan.to_string();
        has(&text, "while bodies come into contact or separate");
    }
    // With a longest step "about inf steps each" were announced.
    let hertz = "body_contact={ hertz_mindlin = { hertz_constant = 1e8, poisson_ratio = 0.3 } }";
    let unknown = estimate(&good(&path, None, &[hertz, "time.max_step=1e-5"]));
    assert_eq!(unknown.impacts, None);
}

/// The resolved scene, and so its hash, has the moduli.
#[test]
fn either_pair_of_elastic_constants_makes_the_same_scene() {
    let moduli = "linear_elastic = { bulk_modulus = 5e5, shear_modulus = 3.75e5 }";
    let pair = "linear_elastic = { young_modulus = 9e5, poisson_ratio = 0.2 }";
    let set = |model: &str| format!("mpm.material.0.model={{ {model} }}");
    let files = Files::new();
    let [one, other] = [moduli, pair].map(|model| files.load(None, &[&set(model)]));
    has(&other.resolved_toml, "shear_modulus = 375000.0");
    let [one, other] =
        [one, other].map(|scene| scene.mpm.expect("a continuum").materials[0].model.moduli());
    assert!(
        (one.0 - other.0).abs() < 1e-9 && (one.1 - other.1).abs() < 1e-9,
        "{one:?} {other:?}"
    );
}

/// Paths of solvers are from the scene's folder, quotation is a shell's, and the resolved scene names the same program
/// wherever it lies.
#[test]
fn solvers_are_commands_with_paths_from_the_scene() {
    let files = Files::new();
    let text = format!(
        "{GOOD}\n[solvers]\ndem = \"python3 '../a b/x.py' ./y -v z/../w\"\nmpm = \"built-in\"\n"
    );
    let path = files.write("scene.toml", text);
    let scene = good(&path, None, &[]);
    let folder = files.directory.path();
    let words = |scene: &Scene| -> Vec<PathBuf> {
        let words = scene.solvers.dem.iter().flatten();
        words.map(PathBuf::from).collect()
    };
    let from_here = |word: &str| folder.join(word).display().to_string();
    let expected = [
        "python3",
        &from_here("../a b/x.py"),
        &from_here("./y"),
        "-v",
        "z/../w",
    ];
    assert_eq!(words(&scene), expected.map(PathBuf::from));
    assert_eq!(scene.solvers.mpm, None);
    assert!(scene.plan().contains("DEM process `python3 "));

    let elsewhere = Files::new();
    let again = elsewhere.write("scene.toml", &scene.resolved_toml);
    let again = good(&again, None, &[]);
    assert_eq!(again.solvers, scene.solvers);
    assert_eq!(again.hash, scene.hash);

    // The command line's words are from the working directory, and win.
    let set = solver_override("dem", "./z --fast").unwrap();
    let scene = good(&path, None, &[&set]);
    let here = std::env::current_dir().unwrap().join("z");
    assert_eq!(words(&scene), [here, "--fast".into()]);
    let set = solver_override("dem", "built-in").unwrap();
    assert_eq!(good(&path, None, &[&set]).solvers.dem, None);
    assert!(solver_override("dem", "'").is_err());
    assert!(solver_override("dem", " ").is_err());
}

#[test]
fn a_solver_of_a_side_that_is_not_there_is_warned_of() {
    let files = Files::new();
    let scene = files.load(None, &["dem.body=[]", "check=[]", "solvers.dem=other"]);
    let warned = |w: &String| w.contains("`solvers.dem` has no effect");
    assert!(scene.warnings.iter().any(warned), "{:?}", scene.warnings);
}

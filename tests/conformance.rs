//! `tandem conformance`: the built-in solver passes, a mutant does not, and what the kit says can be read by programs.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Duration;

use conformance::clause::{self, Clause};
use conformance::report::summary;
use conformance::{Examination, Options, RandomCases, examine};
use coupler::scene::Scene;
use interface::config::capability::Capabilities;
use interface::config::needs::Need;
use interface::config::{DemConfig, MpmConfig};
use interface::hosted::Subject;
use interface::message::control::Party;
use serde_json::Value;

use crate::harness::{Place, at_once, catalogue, lives, quoted, root, until};
use crate::{deaths, mutants};

/// The command of a solver that is this program.
fn solver(subcommand: &str) -> String {
    format!("'{}' {subcommand}", env!("CARGO_BIN_EXE_tandem"))
}

/// The command of a mutant.
fn mutant(name: &str) -> String {
    let words = mutants::command(name);
    shlex::try_join(words.iter().map(String::as_str)).unwrap()
}

/// Runs the kit; returns its exit status and its verdicts, id by id.
fn verdicts(place: &Place, arguments: &str) -> (Option<i32>, Vec<(String, String)>) {
    // Each case starts a process; tests of the solvers run many more within one.
    let line = format!("conformance --cases 20 --json verdicts.json {arguments}");
    let status = place.tandem(&line).status.code();
    let text = fs::read_to_string(place.path("verdicts.json")).unwrap();
    let document: Value = serde_json::from_str(&text).unwrap();
    let word = |value: &Value| value.as_str().unwrap().to_string();
    let clauses = document["clauses"].as_array().unwrap().iter();
    let verdicts = clauses.map(|clause| (word(&clause["id"]), word(&clause["verdict"])));
    (status, verdicts.collect())
}

fn none_fails(verdicts: &[(String, String)]) {
    let failed: Vec<_> = verdicts
        .iter()
        .filter(|(_, verdict)| verdict != "pass" && verdict != "not_applicable")
        .collect();
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn the_bodies_side_passes_as_a_process() {
    let (status, verdicts) = verdicts(&Place::new(), "--dem built-in --strict");
    none_fails(&verdicts);
    assert_eq!(status, Some(0));
    assert!(
        verdicts.iter().all(|(_, verdict)| verdict == "pass"),
        "{verdicts:?}"
    );
    assert!(verdicts.len() >= 90);
}

#[test]
fn a_broken_clause_is_reported_as_text_json_and_junit() {
    let place = Place::new();
    let ended = place.tandem(&format!(
        "conformance --only S-2a,G-2a,X-1a --dem {} --junit junit.xml --trace traces",
        quoted(&mutant("G-2a"))
    ));
    assert_eq!(ended.status.code(), Some(1));
    let text = ended.stdout;
    assert!(text.contains("G-2a   MUST   FAIL"), "{text}");
    assert!(
        text.contains("X-1a   MUST   blocked") && text.contains("by G-2a"),
        "{text}"
    );
    assert!(
        !text.contains('\x1b'),
        "colours although nobody asked for them"
    );

    let xml = fs::read_to_string(place.path("junit.xml")).unwrap();
    let count = |element: &str| xml.matches(&format!("<{element}")).count();
    assert_eq!(["testcase", "failure", "skipped"].map(count), [3, 1, 1]);

    let trace = fs::read_to_string(place.path("traces/G-2a.jsonl")).unwrap();
    let lines: Vec<Value> = trace
        .lines()
        .map(|l| serde_json::from_str(l).unwrap())
        .collect();
    assert!(lines.iter().any(|line| line["kind"] == "Forces"), "{trace}");
}

/// What blocks what, and the order of the verdicts, does not depend on how many clauses are judged at once.
#[test]
fn verdicts_are_the_same_for_any_number_of_jobs() {
    let place = Place::new();
    let broken = mutant("G-2a");
    // Of every kind: sessions, saved states, random cases, and what is blocked.
    let only = "--only S-2a,G-2a,H-2a,X-1a,K-4a,J-1,F-7,T-1,R-6";
    let verdicts_of = |jobs: u32| {
        let arguments = format!("--dem {} {only} --jobs {jobs}", quoted(&broken));
        let (status, verdicts) = verdicts(&place, &arguments);
        assert_eq!(status, Some(1));
        verdicts
    };
    let one = verdicts_of(1);
    let verdict = |id: &str| {
        one.iter()
            .find(|(known, _)| known == id)
            .unwrap()
            .1
            .as_str()
    };
    assert_eq!((verdict("S-2a"), verdict("G-2a")), ("pass", "fail"));
    assert_eq!(verdict("X-1a"), "blocked");
    assert_eq!(verdicts_of(8), one);
}

#[test]
fn what_cannot_be_judged_has_its_own_status() {
    let place = Place::new();
    let code = |arguments: &str| {
        let ended = place.tandem(&format!("conformance {arguments}"));
        ended.status.code()
    };
    assert_eq!(code("--dem /no/such/solver"), Some(3));
    assert_eq!(code(""), Some(2));
    // Not the built-in solver in its place.
    assert_eq!(code("--dem false --in-process --only S-2a"), Some(2));
    // The seeds after it would be 0, 1 and so on.
    let last = format!("--dem --in-process --only J-1 --seed {}", u64::MAX);
    assert_eq!(code(&last), Some(2));
    let built_in = solver("dem");
    let unknown = format!("--dem {} --only Z-1", quoted(&built_in));
    assert_eq!(code(&unknown), Some(2));
    // A command that is no solver: nothing but the first clause can be judged.
    assert_eq!(code("--dem true --only S-2a,H-2a"), Some(1));
}

/// How long a solver takes to start is not judged; one that never speaks is not awaited for ever, nor in every clause.
#[test]
fn a_slow_start_is_no_fault_and_an_endless_one_is_found_soon() {
    let place = Place::new();
    let code = |command: &str, startup: &str| {
        let start = std::time::Instant::now();
        let ended = place.tandem(&format!(
            "conformance --dem {} --only S-2a,S-6a,S-9a,G-10a,H-2a --startup {startup}",
            quoted(command)
        ));
        (ended.status.code(), start.elapsed().as_secs_f64())
    };
    // Longer than the kit waits for an answer.
    let late = format!(
        "sh -c 'sleep 2.5; exec {} \"$@\"' late",
        solver("dem").replace('\'', "")
    );
    // The second: 3 s at first, 2 s for the first clause, which blocks the others.
    let silent = "sh -c 'sleep 600' silent";
    let both = [(late.as_str(), "20", 0), (silent, "3", 1)];
    at_once(both.len(), &both, |&(command, startup, expected)| {
        let (status, took) = code(command, startup);
        assert_eq!(status, Some(expected), "{command}");
        assert!(took < 300.0, "{took:.1} s");
    });
}

/// The kit looked for a state only after the report, when the four messages that a channel holds had long been there.
#[test]
fn a_state_may_come_in_many_pieces() {
    let place = Place::new();
    let dem = deaths::flawed(&place, "pieces");
    let only = "--only S-2a,S-6a,K-3a,K-4b,K-4a";
    let (status, verdicts) = verdicts(&place, &format!("{only} --dem {}", quoted(&dem)));
    let passes = verdicts.iter().all(|(_, verdict)| verdict == "pass");
    assert!(passes && status == Some(0), "{verdicts:?}");
}

/// A command that waits where it has nothing to join (X-2c) is ended with all that it has started.
#[test]
fn no_process_of_a_solver_outlives_the_kit() {
    let place = Place::new();
    let script = format!(
        "if [ $# = 2 ]; then exec {} \"$@\"; fi; sleep 600; true",
        solver("dem").replace('\'', "")
    );
    let waits = quoted(&format!("sh -c '{script}' waits")).into_owned();
    let ended = place.tandem(&format!(
        "conformance --dem {waits} --only X-2c --startup 2"
    ));
    assert_eq!(ended.status.code(), Some(1));
    let left = || place.processes().iter().all(|pid| !lives(*pid));
    let gone = until(Duration::from_mins(1), || left().then_some(()));
    assert!(gone.is_some(), "{:?}", place.processes());
}

/// Random cases judge several clauses at once: their time is counted once.
#[test]
fn the_times_of_clauses_add_up_to_the_time_of_all() {
    let subject = Subject::in_thread(|| mutant::built_in(Party::Dem));
    let options = Options {
        only: ["J-1", "F-8", "F-7"].map(str::to_owned).to_vec(),
        random: RandomCases {
            cases: 20,
            ..RandomCases::default()
        },
        ..Options::default()
    };
    let found = examine(&subject, &options, |_| ()).unwrap();
    let sum: Duration = found.judged.iter().map(|judged| judged.wall).sum();
    assert!(sum <= found.wall, "{sum:?} of {:?}", found.wall);
}

/// The clauses and their mutants: those of both sides, then of each.
fn manual() -> String {
    let parts: [(&str, Party, Vec<&Clause>); 3] = [
        ("both", Party::Dem, clause::common().collect()),
        ("bodies", Party::Dem, clause::own(Party::Dem).collect()),
        ("continuum", Party::Mpm, clause::own(Party::Mpm).collect()),
    ];
    let mut table = csv::Writer::from_writer(Vec::new());
    let head = ["side", "clause", "level", "what", "needs", "mutants"];
    table.write_record(head).unwrap();
    for (side, party, clauses) in parts {
        let all = mutant::of(party);
        for clause in clauses {
            let mutants = all.iter().filter(|mutant| mutant.clause.id == clause.id);
            let mutants: Vec<&str> = mutants.map(|mutant| mutant.what).collect();
            let [level, needs] = [clause.level.to_string(), clause.needs.join("; ")];
            let words = [clause.title, &needs, &mutants.join("; ")];
            let row = [side, clause.id, &level].into_iter().chain(words);
            table.write_record(row).unwrap();
        }
    }
    String::from_utf8(table.into_inner().unwrap()).unwrap()
}

/// docs/conformance.csv is made of the rows; UPDATE_CLAUSES=1 writes it.
#[test]
fn the_manual_is_made_of_the_rows() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/conformance.csv");
    let rows = manual();
    if std::env::var_os("UPDATE_CLAUSES").is_some() {
        fs::write(&path, &rows).unwrap();
    }
    let help = "the table is not that of the rows: UPDATE_CLAUSES=1 writes it";
    assert!(
        fs::read_to_string(&path).unwrap_or_default() == rows,
        "{help}"
    );
}

/// What the kit knows of the shipped scenes is what they need; UPDATE_SCENE_NEEDS=1 writes it.
#[test]
fn the_kit_knows_what_the_shipped_scenes_need() {
    let path = root().join("interface/conformance/src/report/scenes.csv");
    let mut rows = String::from("scene,side,needs\n");
    for file in catalogue() {
        let scene = Scene::load(&file, None, &[]).unwrap();
        let name = file.strip_prefix(root().join("scenes")).unwrap();
        let sides = [
            (Party::Dem, scene.dem.as_ref().map(DemConfig::needs)),
            (Party::Mpm, scene.mpm.as_ref().map(MpmConfig::needs)),
        ];
        let there = |(side, needs): (Party, Option<Vec<Need>>)| Some((side, needs?));
        for (side, needs) in sides.into_iter().filter_map(there) {
            let needs = needs.iter().map(|need| need.capability.as_str());
            let needs = needs.collect::<Vec<_>>().join(" ");
            let name = name.with_extension("");
            let (name, side) = (name.display(), side.name());
            writeln!(rows, "{name},{side},{needs}").unwrap();
        }
    }
    if std::env::var_os("UPDATE_SCENE_NEEDS").is_some() {
        fs::write(&path, &rows).unwrap();
    }
    let file = fs::read_to_string(&path).unwrap();
    assert!(file == rows, "UPDATE_SCENE_NEEDS=1 writes them");
}

/// The verdict names the scenes that need no more than what a solver takes and what has been judged of it.
#[test]
fn a_verdict_says_which_scenes_a_solver_is_good_for() {
    let good_after = |cases: u64, capabilities: &[&str]| {
        let examination = Examination {
            party: Party::Dem,
            identity: "x".into(),
            capabilities: Capabilities::of(capabilities),
            judged: Vec::new(),
            whole: true,
            cases,
            wall: Duration::ZERO,
        };
        let words = summary(&examination);
        let scenes = examination.scenes();
        let few = words.contains("ONLY 6 RANDOM CASES") && !words.contains("Good for");
        assert_eq!(few, cases == 6, "{words}");
        assert!(scenes.iter().all(|scene| words.contains(scene)), "{words}");
        scenes
    };
    let good = |capabilities: &[&str]| good_after(100, capabilities);
    let polygons = "shape:disc shape:rectangle shape:polygon law:linear motion:free motion:fixed feature:friction";
    let polygons: Vec<&str> = polygons.split(' ').collect();
    let discs = [&["shape:disc"], &polygons[3..]].concat();
    let own = [&polygons[..], &["feature:own_friction"]].concat();
    assert!(good(&polygons).contains(&"jiang2020/collision_hard"));
    assert!(good(&polygons).contains(&"verification/tumble"));
    assert!(!good(&discs).contains(&"verification/tumble"));
    assert!(!good(&discs).is_empty());
    assert!(good_after(6, &discs).is_empty());
    // The block of this scene has friction, that one none.
    assert!(!good(&own).contains(&"jiang2020/collision_hard"));
    assert!(good(&own).contains(&"verification/tumble"));
}

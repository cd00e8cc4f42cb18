//! Scenes that are long, or long in one place: reading one takes time in proportion to its length, and none takes the stack.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

use coupler::scene::diagnostic::SceneErrors;
use coupler::scene::{Scene, SceneFile};
use interface::session::cpu_time;

/// Longest CPU time that any of these may take: all but the deep ones took more than 20 s, or the stack.
const PATIENCE: Duration = Duration::from_secs(10);
/// Bytes of the longest scene.
const LONGEST: usize = 2 << 20;

/// A scene that is right.
const GOOD: &str = r#"
version = 1
name = "long"

[time]
end = 0.1

[dem]
[[dem.body]]
name = "bar"
shape = "disc"
sphero_radius = 0.01
density = 2000.0

[output]
every = 1e-3
"#;

/// Reads a scene in time; also the words of what is wrong.
#[track_caller]
fn read(text: &str) -> Result<Scene, String> {
    read_within(text, PATIENCE)
}

/// The same, in a CPU time.
#[track_caller]
fn read_within(text: &str, limit: Duration) -> Result<Scene, String> {
    let started = cpu_time();
    let file = SceneFile::of_text("long.toml", text, Path::new("."));
    let scene = file.and_then(|file| file.scene(None, &[]));
    let result = scene.map_err(|errors: SceneErrors| errors.to_string());
    let took = cpu_time().saturating_sub(started);
    assert!(took < limit, "{took:?} for {} bytes", text.len());
    if let Err(words) = &result {
        assert!(words.len() < 1 << 20, "{} bytes of messages", words.len());
        assert!(words.matches("error:").count() <= 100);
    }
    result
}

fn lines(count: usize, line: impl Fn(usize, &mut String)) -> String {
    let mut text = String::new();
    for i in 0..count {
        line(i, &mut text);
        text.push('\n');
    }
    text
}

/// In the order of their names each constant needs the next.
fn chain(last: &str) -> String {
    let chain = lines(20_000, |i, text| {
        write!(text, "c{i:05} = \"c{:05} + 1\"", i + 1).unwrap();
    });
    format!("[constants]\n{chain}c20000 = {last}")
}

/// D18: each round found one more constant, and read all the others again.
#[test]
fn twenty_thousand_constants_that_need_one_another() {
    let scene = read(&format!("{GOOD}{}\n", chain("0"))).unwrap();
    assert_eq!(scene.constants["c00000"], 20_000.0);
}

/// A million constants took a gigabyte and five seconds, and other long texts minutes.
#[test]
fn a_text_is_not_parsed_beyond_a_length() {
    let many = lines(1_000_000, |i, text| write!(text, "c{i}=1").unwrap());
    let inline = many.replace('\n', ", ");
    for many in [
        format!("{GOOD}[constants]\n{many}"),
        format!("constants = {{ {inline} z = 1 }}\n{GOOD}"),
        GOOD.repeat(600_000),
    ] {
        let message = read_within(&many, Duration::from_secs(1)).unwrap_err();
        assert!(
            message.contains("bytes, expected at most 2097152"),
            "{message}"
        );
    }
}

/// As many lines or elements of this form as a scene of `size` bytes has; `#` stands for their number.
fn filled(size: usize, before: &str, form: &str, after: &str) -> String {
    let mut text = before.to_owned();
    for i in 0.. {
        let next = form.replace('#', &i.to_string());
        if text.len() + next.len() + after.len() > size {
            break;
        }
        text += &next;
    }
    text + after
}

/// Scenes of `size` bytes, each of a form of which the longest took from four seconds to minutes, gigabytes, or wrote
/// 200 MB of messages.
fn forms(size: usize) -> [(&'static str, String); 13] {
    let constants = &format!("{GOOD}[constants]\n");
    let law = &format!("{GOOD}[body_contact]\nlinear = {{ normal_stiffness = 1e5 }}\n");
    let vertices = &format!("{GOOD}[[dem.body]]\nshape.polygon.vertices=[");
    let disc =
        "[[dem.body]]\nname=\"b#\"\nshape=\"disc\"\nsphero_radius=1\ndensity=1\nposition=[#,9]\n";
    let long = "a".repeat(size / 2);
    let (named, section) = (
        &format!("{constants}{long} = 1\n"),
        &format!("{GOOD}[{long}]\n"),
    );
    let list = &format!("{section}k=[");
    let halves = |before: &str, one, two, other, after| {
        filled(
            size,
            &(filled(size / 2, before, one, "") + two),
            other,
            after,
        )
    };
    let column = "[[output.column]]\nname=\"k#\"\nunit=\"m\"\nvalue=\"body.bar.x\"\n";
    let mpm = &format!(
        "{GOOD}[mpm]\ncell=0.01\nshape=\"ugimp\"\ntransfer=\"flip\"\ndomain=[[0,0],[1,1]]\n"
    );
    let material = "[[mpm.material]]\nname=\"m#\"\ndensity=1000\n\
        model.linear_elastic={bulk_modulus=1,shear_modulus=1}\n";
    let points = "[[mpm.points]]\nname=\"g#\"\nmaterial=\"zz#\"\nspacing.per_cell=4\n\
        fill.disc={center=[0.5,0.5],radius=0.1}\n";
    let missed = halves(GOOD, column, "[study]\nfiner=[", "\"zz#\",", "]\n");
    let misspelt = halves(mpm, material, "", points, "");
    let filled = |before, form, after| filled(size, before, form, after);
    [
        ("constants", filled(constants, "z#=1\n", "")),
        ("not there", filled(constants, "c#=\"zz#\"\n", "")),
        ("a long name", filled(named, "c#=\"x\"\n", "")),
        ("unknown keys", filled(GOOD, "cell#=1\n", "")),
        ("tables", filled(GOOD, "[a#]\n", "")),
        ("keys of a long section", filled(section, "k#=1\n", "")),
        ("its elements", filled(list, "0,", "0]\n")),
        ("wrong elements", filled(vertices, "0,", "0]\n")),
        ("before an error", filled("a=[", "\"x\",", "\nb==3\n")),
        ("light bodies", filled(law, disc, "")),
        ("names of no column", missed),
        ("names of no material", misspelt),
        ("variants", filled(GOOD, "[variant.v#]\ntime.end=1\n", "")),
    ]
}

/// A scene that is eight times as long takes eight times as long, with a factor of three for the machine; where the time grew
/// with the square of the length it took 64 times as long.
#[test]
fn the_longest_scenes_take_time_in_proportion_to_their_length() {
    for ((what, long), (_, short)) in forms(LONGEST).iter().zip(&forms(LONGEST / 8)) {
        let took = |text: &String| {
            let started = cpu_time();
            drop(read(text));
            cpu_time().saturating_sub(started)
        };
        assert!(long.len() > 7 * short.len(), "{what}");
        let [short, long] = [took(short), took(long)];
        println!("{what}: {short:?}, {long:?}");
        assert!(long < 24 * short, "{what}: {long:?}, an eighth {short:?}");
    }
}

/// A sum was as deep a tree as it has terms, which ended the process where the stack did.
fn sum(terms: usize) -> String {
    let sum = vec!["body.bar.x"; terms].join("+");
    format!("[[output.column]]\nname = \"sum\"\nunit = \"m\"\nvalue = \"{sum}\"")
}

/// What is wrong at great length is refused at once: every message of a line had the whole line in it, and counted the lines
/// before; a table that was a device without an end was read until the memory was.
#[test]
fn long_mistakes_are_told_soon() {
    let wrong = (0..50_000).map(|i| format!("k{i} = 1"));
    let wrong = wrong.collect::<Vec<_>>().join(", ");
    let nan = vec!["nan"; 100_000].join(", ");
    let long = "a".repeat(200_000);
    let body = "[[dem.body]]\nname=\"bar\"\nshape=\"disc\"\nsphero_radius=0.01\ndensity=1.0\n";
    let deep = |open: &str| open.repeat(100_000);
    let nested = format!("{}1{}", "(".repeat(50_000), ")".repeat(50_000));
    let check = "[[check]]\nname = \"c\"\nvalue = \"body.bar.x\"\nsource = \"s\"\ntolerance = 1.0\n\
                 reference = { csv = \"/dev/zero\" }";
    for (text, words) in [
        (
            chain("\"c00000\""),
            "may not depend on each other in a circle",
        ),
        (sum(100_000), "more than 2000 operators"),
        (
            format!("[mpm]\nmaterial = [{{{wrong}}}]"),
            "unknown key `k0`",
        ),
        (format!("[mpm]\ndomain = [[{nan}]]"), "mpm.domain"),
        ("= = =\n".repeat(50_000), "not TOML"),
        (
            format!("[constants]\n{long} = 1\nb = \"{long}b\""),
            "is not known here",
        ),
        (body.repeat(5000), "two of"),
        (deep("["), "not TOML"),
        (format!("x = {}", deep("[")), "not TOML"),
        (format!("x = {}", deep("{a = ")), "not TOML"),
        (format!("{}z = 1", deep("a.")), "not TOML"),
        (format!("[{}z]", deep("a.")), "not TOML"),
        (format!("[constants]\nc = \"{nested}\""), "nested deeper"),
        (check.to_owned(), "cannot read /dev/zero"),
    ] {
        let message = read(&format!("{GOOD}{text}\n")).unwrap_err();
        assert!(
            message.contains(words),
            "expected `{words}`: {message:.300}"
        );
    }
}

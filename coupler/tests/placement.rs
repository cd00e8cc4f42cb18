//! Where things are at the start: points within bodies, contacts that press.

use std::path::Path;

use coupler::scene::{Scene, SceneFile, pressing, refuse_points_within_bodies};
use interface::message::wire::ContactState;

/// A slab of points from 0.02 to 0.06 m and 0.02 to 0.04 m, and bodies.
fn scene(bodies: &str) -> Scene {
    let text = format!(
        "version = 1\nname = \"start\"\ncontact.linear = {{ normal_stiffness = 1e4 }}\n\
         body_contact.linear = {{ normal_stiffness = 1e4 }}\n\
         [time]\nend = 0.01\n[output]\nevery = 1e-3\n[mpm]\ncell = 0.005\nshape = \"ugimp\"\n\
         transfer = \"flip\"\ndomain = [[0.0, 0.0], [0.1, 0.1]]\n\
         [[mpm.material]]\nname = \"soft\"\ndensity = 1000.0\n\
         model.linear_elastic = {{ bulk_modulus = 1e5, shear_modulus = 5e4 }}\n\
         [[mpm.points]]\nname = \"slab\"\nmaterial = \"soft\"\nspacing.per_cell = 4\n\
         fill.rectangle = {{ lower = [0.02, 0.02], upper = [0.06, 0.04] }}\n{bodies}"
    );
    let file = SceneFile::of_text("a.toml", &text, Path::new(".")).unwrap();
    file.scene(None, &[]).unwrap()
}

fn floor(top: f64) -> Scene {
    scene(&format!(
        "[[dem.body]]\nname = \"floor\"\nmotion = \"fixed\"\nsphero_radius = 0.001\n\
         shape.rectangle = {{ width = 0.09, height = 0.018 }}\nposition = [0.05, {}]\n",
        top - 0.01
    ))
}

/// Sand inside of a floor fell out of the domain later, with the advice to add a floor.
#[test]
fn points_wholly_inside_a_body_are_refused_with_group_body_and_the_way_out() {
    assert_eq!(refuse_points_within_bodies(&floor(0.02)), Ok(()));
    // The lowest points, at 0.02125 m, reach 2.5 mm from 0.02 m on: not wholly inside.
    assert_eq!(refuse_points_within_bodies(&floor(0.0224)), Ok(()));
    let errors = refuse_points_within_bodies(&floor(0.031)).unwrap_err();
    let message = errors.to_string();
    for words in [
        "points of group `slab` are wholly inside body `floor`: 64",
        "the deepest, at (0.0213, 0.0213) m, is 9.750e-3 m below its surface",
        "a.toml:22:1  (mpm.points.0.fill)",
        "by at least 1.100e-2 m in the direction (0.00, 1.00)",
    ] {
        assert!(message.contains(words), "no `{words}` in {message}");
    }
}

#[test]
fn a_body_within_points_and_a_cluster_among_them_are_seen_and_a_notch_is_outside() {
    let disc = "[[dem.body]]\nname = \"disc\"\nshape = \"disc\"\nsphero_radius = 0.005\n\
                density = 1e3\nposition = [0.04, 0.03]\n";
    let cluster = "[[dem.body]]\nname = \"cluster\"\ndensity = 1e3\n\
                   position = [0.04, 0.03]\n\
                   shape.cluster = { centers = [[0, 0], [0.005, 0]], radii = [0.004, 0.005] }\n";
    for (body, count) in [(disc, 4), (cluster, 8)] {
        let message = refuse_points_within_bodies(&scene(body)).unwrap_err();
        let message = message.to_string();
        assert!(
            message.contains(&format!("`: {count}; the deepest")),
            "{message}"
        );
    }
    // A trough around the slab.
    let trough = "[[dem.body]]\nname = \"trough\"\nmotion = \"fixed\"\nposition = [0, 0]\n\
                  shape.polygon.vertices = [[0.01, 0.01], [0.07, 0.01], [0.07, 0.05], \
                  [0.061, 0.05], [0.061, 0.019], [0.019, 0.019], [0.019, 0.05], [0.01, 0.05]]\n";
    assert_eq!(refuse_points_within_bodies(&scene(trough)), Ok(()));
}

fn discs(x: f64) -> Scene {
    let disc = |name: &str, x: f64| {
        format!(
            "[[dem.body]]\nname = \"{name}\"\nshape = \"disc\"\nsphero_radius = 0.01\n\
             density = 2000.0\nposition = [{x}, 0.07]\n"
        )
    };
    scene(&format!("{}{}", disc("one", 0.03), disc("two", x)))
}

fn contact(force: f64) -> ContactState {
    ContactState {
        body: 0,
        other: 1,
        position: [0.04, 0.07],
        force: [force, 0.0],
        ..ContactState::default()
    }
}

/// 1e-12 N counted as a contact that presses; the line of a real one was not named.
#[test]
fn contacts_by_rounding_are_left_out_and_others_told_with_their_line_and_overlap() {
    let touching = discs(0.05 - 1e-17);
    assert_eq!(pressing(&touching, &[contact(1e-12)], &[], &[]), None);
    let message = pressing(&discs(0.047), &[contact(-30.0)], &[], &[]).unwrap();
    assert_eq!(
        message,
        "1 contact presses at t = 0, the largest force is 3.000e1 N/m: body `two` overlaps body `one` by 3.000e-3 m \
         (line 34, dem.body.1.position); move apart whatever should not touch at the start"
    );
}

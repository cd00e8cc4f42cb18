//! What a scene is warned of: values that look like slips of a unit.

use std::path::Path;

use coupler::scene::SceneFile;

/// The warnings of a scene in which these keys are set.
fn warnings(set: &[&str]) -> Vec<String> {
    let text = "version = 1\nname = \"slip\"\ncheck = []\ncontact.linear = { normal_stiffness = 1e4 }\n\
         [time]\nend = 0.01\n[output]\nevery = 1e-3\n[mpm]\ncell = 0.005\nshape = \"ugimp\"\n\
         transfer = \"flip\"\ndomain = [[0.0, 0.0], [0.1, 0.1]]\n\
         [[mpm.material]]\nname = \"sand\"\ndensity = 1600.0\n\
         model.mohr_coulomb = { bulk_modulus = 1e7, shear_modulus = 5e6, friction_angle = 34.0, \
         dilation_angle = 0.0, cohesion = 0.0, tensile_strength = 0.0 }\n\
         [[mpm.points]]\nname = \"slab\"\nmaterial = \"sand\"\nspacing.per_cell = 4\n\
         fill.rectangle = { lower = [0.02, 0.02], upper = [0.06, 0.04] }\n\
         [[dem.body]]\nname = \"ball\"\nshape = \"disc\"\nsphero_radius = 0.005\ndensity = 2000.0\n\
         position = [0.09, 0.09]\n";
    let file = SceneFile::of_text("a.toml", text, Path::new(".")).unwrap();
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let mut warnings = file.scene(None, &set).unwrap().warnings;
    warnings.retain(|warning| !warning.contains("no checks"));
    warnings
}

/// None of these was mentioned.
#[test]
fn slips_of_a_unit_are_told_with_their_key() {
    assert_eq!(warnings(&[]), Vec::<String>::new());
    let model = "mpm.material.0.model.mohr_coulomb";
    for (set, words) in [
        ("mpm.material.0.density=1.6", "1 g/cm^3 is 1000 kg/m^3"),
        (
            "dem.body.0.density=2.0",
            "body `ball` has a density of 2 kg/m^3",
        ),
        ("dem.body.0.angle=45.0", "45 degrees are 0.7854 rad"),
        (
            &format!("{model}.friction_angle=0.6"),
            "0.6 rad are 34.4 degrees",
        ),
        (
            &format!("{model}.bulk_modulus=1e16"),
            "more than in diamond",
        ),
        (
            "mpm.cell=0.02",
            "group `slab` is 1.0 cells of 0.02 m across",
        ),
        ("mpm.shape=linear", "\"usavg\" does not"),
    ] {
        let doubts = warnings(&[set]);
        let key = set.split('=').next().unwrap();
        let key = key.replace("mpm.cell", "mpm.points.0.fill");
        let key = key.split(".mohr_coulomb").next().unwrap();
        assert_eq!(doubts.len(), 1, "{set}: {doubts:?}");
        assert!(
            doubts[0].contains(words) && doubts[0].contains(key),
            "{set}: {doubts:?}"
        );
    }
}

//! Springs, friction and what laws remember, one contact at a time.

use dem_proc::law::dashpot::Drag;
use dem_proc::law::history::{All, Numbers, Part, Saved};
use dem_proc::law::normal::{Area, Normal};
use dem_proc::law::tangent::{Elongation, Sheared};

#[test]
fn the_area_of_a_half_sunk_disc_is_half_a_disc() {
    let law = Area { stiffness: 1.0 };
    let half = law.force(&0.5, 0.5);
    assert!((half - 0.5 * std::f64::consts::PI * 0.25).abs() < 1e-15);
    assert!((law.force(&0.5, 1.0) - std::f64::consts::PI * 0.25).abs() < 1e-15);
}

type Two = (Elongation, Drag);

#[test]
fn what_two_laws_both_remember_goes_over() {
    fn restored<H: Numbers>() -> Vec<H> {
        let histories: Vec<Two> = vec![Two::default(), (Part([3.0]), Part([4.0, 5.0]))];
        let saved = Saved::of(histories.iter().map(All::of));
        let bytes = interface::saved::pack("histories", &saved);
        let back: Saved = interface::saved::unpack("histories", &bytes).unwrap();
        back.histories()
    }
    assert_eq!(restored::<Two>()[1], (Part([3.0]), Part([4.0, 5.0])));
    assert_eq!(restored::<(Elongation, ())>()[1].0, Part([3.0]));
    assert_eq!(restored::<((), Drag)>()[1].1, Part([4.0, 5.0]));
    // A tangential spring with two numbers belongs to another law.
    let other = restored::<(Sheared, Drag)>();
    assert_eq!(other[1], (Part([0.0; 2]), Part([4.0, 5.0])));
    assert_eq!(restored::<()>().len(), 2);
}

//! The grid of the broad phase against every two boxes.

use dem_proc::lists::cells::Cells;
use interface::Vec2;
use mechanics::outline::Bounds;
use proptest::prelude::*;

fn check(boxes: &[Bounds]) -> Result<(), TestCaseError> {
    let cells = Cells::new(boxes);
    for (i, own) in boxes.iter().enumerate() {
        let mut found = vec![77];
        cells.above(i as u32, boxes, &mut found);
        let all = (i + 1..boxes.len()).filter(|&j| own.meets(&boxes[j]));
        let all: Vec<u32> = std::iter::once(77).chain(all.map(|j| j as u32)).collect();
        prop_assert_eq!(&found, &all, "box {}", i);
    }
    Ok(())
}

proptest! {
    #[test]
    fn every_two_boxes_that_meet_are_found(
        boxes in proptest::collection::vec(
            ((-1.0..1.0, -1.0..1.0_f64), (0.0..0.1, 0.0..0.1), 0..20),
            0..80,
        ),
        stretch in 0.0..50.0_f64,
    ) {
        let boxes: Vec<Bounds> = boxes
            .into_iter()
            .map(|((x, y), (w, h), kind)| {
                // One box in twenty is a wall, and some are points.
                let size = match kind { 0 => Vec2::new(2.0, 0.1), 1 => Vec2::zeros(), _ => Vec2::new(w, h) };
                let lower = Vec2::new(x * (1.0 + stretch), y);
                Bounds { lower, upper: lower + size }
            })
            .collect();
        check(&boxes)?;
    }
}

#[test]
fn boxes_in_one_place_and_none_at_all() {
    let one = Bounds::around([Vec2::new(1.0, 2.0)]);
    check(&[]).unwrap();
    check(&[one]).unwrap();
    check(&[one; 5]).unwrap();
}

//! IMP selection against looking at every point and every outline.

use interface::Vec2;
use interface::config::{Fill, Spacing};
use interface::outline::nearest;
use interface::solver::MpmSolver;
use interface::wire::EnvelopeVertex;

use super::{Random, Stepper, block, configured};

#[test]
fn the_selection_is_that_of_brute_force() {
    let mut random = Random::new(11);
    let mut config = block();
    config.groups[0].fill = Fill::Rectangle {
        lower: [-0.1, 0.2],
        upper: [0.7, 0.8],
    };
    config.groups[0].spacing = Spacing::Distance(0.011);
    config.groups[0].velocity = [1.0, 0.5];
    config.cell = 0.02;
    let mut mpm = configured(&config);
    let mut stepper = Stepper::new();
    let mut found = 0;
    for round in 0..30 {
        stepper.run(&mut mpm, 1e-4, 5);
        assert!(mpm.travel() > 0.0);
        // A disc, a segment, a triangle, a star with forty vertices.
        let mut envelopes = Vec::new();
        for (body, count) in [1, 2, 3, 40].into_iter().enumerate() {
            let centre = [random.between(-0.2, 0.8), random.between(0.1, 0.9)];
            let size = random.between(0.01, 0.5);
            let reach = random.between(0.0, 0.05);
            let turn = random.between(0.0, 6.0);
            for i in 0..count {
                let angle = turn + std::f64::consts::TAU * f64::from(i) / f64::from(count);
                let radius = size * if i % 2 == 0 { 1.0 } else { 0.6 };
                envelopes.push(EnvelopeVertex {
                    body: body as u64,
                    position: [
                        centre[0] + radius * angle.cos(),
                        centre[1] + radius * angle.sin(),
                    ],
                    reach,
                });
            }
        }
        let chosen: Vec<u64> = mpm.select_imps(&envelopes).iter().map(|i| i.id).collect();
        assert_eq!(mpm.travel(), 0.0);
        // Half of the stretched spacing: the rectangle is 73 x 55 boxes.
        let radius = 0.5 * (0.8_f64 / 73.0).min(0.6 / 55.0);
        let expected: Vec<u64> = mpm
            .points()
            .iter()
            .filter(|p| {
                envelopes.chunk_by(|a, b| a.body == b.body).any(|body| {
                    let outline: Vec<Vec2> = body.iter().map(|v| v.position.into()).collect();
                    nearest(&outline, p.position.into()).distance
                        <= body[0].reach + radius + config.skin
                })
            })
            .map(|p| p.id)
            .collect();
        assert_eq!(chosen, expected, "round {round}");
        found += chosen.len();
    }
    assert!(found > 1000);
    assert!(mpm.select_imps(&[]).is_empty());
    assert!(mpm.imp_states().is_empty());
}

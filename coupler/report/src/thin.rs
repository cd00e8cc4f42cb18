//! What is left of the frames and points of a run that has more of them than a page has room for.

/// Frames that a motion needs before it gives up more of them in favour of points.
const FEW_FRAMES: usize = 60;
/// Points that a picture needs before frames are given up.
const FEW_POINTS: usize = 500;

/// At most `most` of `count` places, evenly spread, the first and the last among them.
pub fn evenly(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    match most {
        0 => Vec::new(),
        1 => vec![0],
        _ => (0..most)
            .map(|k| (k * (count - 1) + (most - 1) / 2) / (most - 1))
            .collect(),
    }
}

/// What a run has, or what is kept of it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Amount {
    /// Frames.
    pub frames: usize,
    /// Points of a frame.
    pub points: usize,
}

/// How much of `all` is kept where there is room for `samples` points of frames: of frames and points the same share, but
/// that a motion keeps enough frames to be one. The bodies of a frame take the room of `fixed` points and are all kept.
pub fn shares(all: Amount, fixed: usize, samples: usize) -> Amount {
    let whole = all.frames.saturating_mul(all.points + fixed);
    if whole <= samples || all.frames == 0 {
        return all;
    }
    let share = (samples as f64 / whole as f64).sqrt();
    let frames = (all.frames as f64 * share).round() as usize;
    let frames = frames.max(FEW_FRAMES.min(all.frames));
    let few = FEW_POINTS.min(all.points);
    let room = samples / frames;
    if room >= fixed + few {
        let points = (room - fixed).min(all.points);
        return Amount { frames, points };
    }
    // The bodies alone are too much, so frames have to be left out.
    let frames = samples / (fixed + few).max(1);
    Amount {
        frames: frames.clamp(2.min(all.frames), all.frames),
        points: few,
    }
}

/// The order of places along a curve that visits near ones one after the other (Morton's), so that every n-th of them is
/// spread evenly over the plane, and neighbours in the order move alike.
pub fn along_a_curve(places: &[[u16; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by_key(|&k| (spread(places[k][0]) | spread(places[k][1]) << 1, k));
    order
}

/// The bits of a number with a gap after each.
fn spread(bits: u16) -> u32 {
    let mut x = u32::from(bits);
    x = (x | x << 8) & 0x00ff_00ff;
    x = (x | x << 4) & 0x0f0f_0f0f;
    x = (x | x << 2) & 0x3333_3333;
    (x | x << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evenly_keeps_both_ends_and_leaves_no_wide_gap() {
        for (count, most) in [(5, 10), (10, 10), (200, 60), (1000, 7), (3, 2), (2, 1)] {
            let kept = evenly(count, most);
            assert_eq!(kept.len(), count.min(most));
            assert_eq!(kept[0], 0);
            if most > 1 {
                assert_eq!(*kept.last().unwrap(), count - 1);
            }
            let widest = kept.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(1);
            let narrowest = kept.windows(2).map(|w| w[1] - w[0]).min().unwrap_or(1);
            assert!(narrowest >= 1 && widest - narrowest <= 1, "{count} {most}");
        }
    }

    #[test]
    fn what_fits_is_kept_and_what_does_not_fit_is_shared() {
        let all = |frames, points| Amount { frames, points };
        assert_eq!(shares(all(200, 5000), 0, 1_000_000), all(200, 5000));
        for (frames, points, fixed, samples) in [
            (200, 100_000, 0, 1_000_000),
            (2000, 900, 0, 500_000),
            (200, 50_000, 1000, 800_000),
        ] {
            let kept = shares(all(frames, points), fixed, samples);
            let room = kept.frames * (kept.points + fixed);
            assert!(room <= samples && room > samples / 2, "{kept:?}");
            assert!(kept.frames >= FEW_FRAMES && kept.points > points / 20);
        }
        // Nothing but bodies, and too many: fewer frames.
        let kept = shares(all(100, 0), 10_000, 200_000);
        assert_eq!(kept, all(20, 0));
        assert_eq!(shares(all(100, 0), 10_000, 10).frames, 2);
        assert_eq!(shares(all(0, 0), 0, 5), all(0, 0));
    }

    #[test]
    fn every_nth_point_along_the_curve_is_spread_over_the_plane() {
        let side = 64u16;
        let places: Vec<[u16; 2]> = (0..side)
            .flat_map(|x| (0..side).map(move |y| [x * 1024, y * 1024]))
            .collect();
        let order = along_a_curve(&places);
        let mut seen = order.clone();
        seen.sort_unstable();
        assert_eq!(seen, (0..places.len()).collect::<Vec<_>>());
        // A sixteenth of the points: one in nearly every square of four by four. By chance it would be in 162 of 256.
        let mut squares = std::collections::BTreeSet::new();
        for k in evenly(places.len(), places.len() / 16) {
            let [x, y] = places[order[k]];
            squares.insert((x / 4096, y / 4096));
        }
        assert!(squares.len() > 200, "{}", squares.len());
    }
}

//! Numbers in few bytes: quantised, as differences from a prediction, deflated.
//!
//! A browser unpacks what [`Packer::finish`] gives (RFC 1950) and adds up again what [`Packer::track`] has taken apart;
//! `templates/motion.js` has the other half of it.

use std::io::Write as _;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use flate2::Compression;
use flate2::write::ZlibEncoder;

/// Effort of deflating, of 9. What is left after differences is mostly noise, of which more effort makes little.
const EFFORT: u32 = 3;

/// A range of numbers in steps of equal size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// The number of step 0.
    pub low: f64,
    /// The number of the last step.
    pub high: f64,
}

impl Scale {
    /// The range of these numbers, those that are not finite left out.
    pub fn of(numbers: impl Iterator<Item = f64>) -> Self {
        let none = Self {
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        };
        let all = numbers.filter(|n| n.is_finite()).fold(none, |s, n| Self {
            low: s.low.min(n),
            high: s.high.max(n),
        });
        if all.low <= all.high {
            all
        } else {
            Self {
                low: 0.0,
                high: 0.0,
            }
        }
    }

    /// The step nearest to a number, of 0 to `last`; an end of the range for what lies beyond it.
    fn step(&self, number: f64, last: f64) -> f64 {
        let span = self.high - self.low;
        let share = if span > 0.0 {
            (number - self.low) / span
        } else {
            0.0
        };
        // Not a number becomes 0.
        (share * last).round().clamp(0.0, last)
    }

    /// In 16 bits.
    pub fn fine(&self, number: f64) -> u16 {
        self.step(number, f64::from(u16::MAX)) as u16
    }

    /// In 8 bits.
    pub fn coarse(&self, number: f64) -> u8 {
        self.step(number, f64::from(u8::MAX)) as u8
    }
}

/// The part of a whole turn that an angle (rad) is beyond whole turns, in 16 bits.
pub fn turn(angle: f64) -> u16 {
    let turns = angle / std::f64::consts::TAU;
    ((turns - turns.floor()) * 65536.0) as u32 as u16
}

/// Puts arrays one after the other and deflates them.
#[derive(Debug)]
pub struct Packer {
    encoder: ZlibEncoder<Vec<u8>>,
}

impl Default for Packer {
    fn default() -> Self {
        Self {
            encoder: ZlibEncoder::new(Vec::new(), Compression::new(EFFORT)),
        }
    }
}

impl Packer {
    /// Adds bytes as they are.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.encoder.write_all(bytes).expect("memory takes bytes");
    }

    /// Adds numbers in 16 bits as they are.
    pub fn words(&mut self, words: &[u16]) {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        self.bytes(&bytes);
    }

    /// Adds numbers in 32 bits as they are.
    pub fn reals(&mut self, reals: &[f32]) {
        let bytes: Vec<u8> = reals.iter().flat_map(|real| real.to_le_bytes()).collect();
        self.bytes(&bytes);
    }

    /// Packs `count` values for each of `frames` frames as residuals of linear extrapolation from the two frames before;
    /// in the first frame, as differences from the value before. Low bytes and high bytes of a frame stand apart.
    pub fn track(&mut self, frames: usize, count: usize, at: impl Fn(usize, usize) -> u16) {
        let mut low = vec![0; count];
        let mut high = vec![0; count];
        for frame in 0..frames {
            for k in 0..count {
                let expected = match (frame, k) {
                    (0, 0) => 0,
                    (0, _) => at(0, k - 1),
                    (1, _) => at(0, k),
                    _ => {
                        let (last, before) = (at(frame - 1, k), at(frame - 2, k));
                        last.wrapping_add(last.wrapping_sub(before))
                    }
                };
                let off = at(frame, k).wrapping_sub(expected).cast_signed();
                // Small numbers of either sign become small unsigned numbers.
                let folded = (off << 1) ^ (off >> 15);
                [low[k], high[k]] = folded.to_le_bytes();
            }
            self.bytes(&low);
            self.bytes(&high);
        }
    }

    /// The same of numbers in 8 bits, each as its difference from the frame before.
    pub fn shades(&mut self, frames: usize, count: usize, at: impl Fn(usize, usize) -> u8) {
        let mut row = vec![0; count];
        for frame in 0..frames {
            for (k, byte) in row.iter_mut().enumerate() {
                let expected = match (frame, k) {
                    (0, 0) => 0,
                    (0, _) => at(0, k - 1),
                    _ => at(frame - 1, k),
                };
                *byte = at(frame, k).wrapping_sub(expected);
            }
            self.bytes(&row);
        }
    }

    /// All of it as text.
    pub fn finish(self) -> String {
        BASE64.encode(self.encoder.finish().expect("memory takes bytes"))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use proptest::prelude::*;

    use super::*;

    fn unpacked(text: &str) -> Vec<u8> {
        let bytes = BASE64.decode(text).unwrap();
        let mut all = Vec::new();
        flate2::read::ZlibDecoder::new(&bytes[..])
            .read_to_end(&mut all)
            .unwrap();
        all
    }

    /// What `templates/motion.js` does.
    fn tracked(bytes: &[u8], frames: usize, count: usize) -> Vec<Vec<u16>> {
        let mut all: Vec<Vec<u16>> = Vec::new();
        for frame in 0..frames {
            let (low, high) = bytes[2 * frame * count..][..2 * count].split_at(count);
            let mut row: Vec<u16> = Vec::new();
            for k in 0..count {
                let folded = u16::from_le_bytes([low[k], high[k]]);
                let off = (folded >> 1) ^ (folded & 1).wrapping_neg();
                let expected = match (frame, k) {
                    (0, 0) => 0,
                    (0, _) => row[k - 1],
                    (1, _) => all[0][k],
                    _ => all[frame - 1][k]
                        .wrapping_mul(2)
                        .wrapping_sub(all[frame - 2][k]),
                };
                row.push(expected.wrapping_add(off));
            }
            all.push(row);
        }
        all
    }

    proptest! {
        #[test]
        fn a_track_reads_back(rows in prop::collection::vec(prop::collection::vec(any::<u16>(), 3), 0..6)) {
            let mut packer = Packer::default();
            packer.track(rows.len(), 3, |frame, k| rows[frame][k]);
            prop_assert_eq!(tracked(&unpacked(&packer.finish()), rows.len(), 3), rows);
        }

        #[test]
        fn a_quantised_number_is_near(low in -1e6..1e6f64, span in 1e-9..1e6f64, share in 0.0..=1.0f64) {
            let scale = Scale { low, high: low + span };
            let number = low + share * span;
            let back = |step: f64, last: f64| scale.low + step / last * (scale.high - scale.low);
            let fine = back(f64::from(scale.fine(number)), 65535.0);
            let coarse = back(f64::from(scale.coarse(number)), 255.0);
            let rounding = 1e-9 * (low.abs() + span);
            prop_assert!((fine - number).abs() <= 0.5 * span / 65535.0 + rounding);
            prop_assert!((coarse - number).abs() <= 0.5 * span / 255.0 + rounding);
        }
    }

    #[test]
    fn what_cannot_be_quantised_becomes_an_end() {
        let scale = Scale::of([2.0, f64::NAN, 4.0, f64::INFINITY].into_iter());
        assert_eq!((scale.low, scale.high), (2.0, 4.0));
        assert_eq!(
            [1.0, 2.0, 4.0, 9.0].map(|n| scale.coarse(n)),
            [0, 0, 255, 255]
        );
        assert_eq!(scale.fine(f64::NAN), 0);
        let one = Scale::of([3.0].into_iter());
        assert_eq!(one.fine(3.0), 0);
        assert_eq!(Scale::of(std::iter::empty()).high, 0.0);
    }

    #[test]
    fn angles_are_sent_within_one_revolution() {
        let quarter = std::f64::consts::FRAC_PI_2;
        assert_eq!([0.0, quarter, -quarter].map(turn), [0, 16384, 49152]);
        assert_eq!(turn(5.0 * quarter), 16384);
    }

    #[test]
    fn shades_are_differences_from_the_frame_before() {
        let rows = [[5u8, 7, 9], [5, 8, 9]];
        let mut packer = Packer::default();
        packer.shades(2, 3, |frame, k| rows[frame][k]);
        assert_eq!(unpacked(&packer.finish()), [5, 2, 2, 0, 1, 0]);
    }

    #[test]
    fn free_flight_packs_to_nearly_nothing() {
        let mut packer = Packer::default();
        packer.track(100, 1000, |frame, k| (k * 20 + frame * 37) as u16);
        assert!(packer.finish().len() < 8000, "of 200 kB");
    }
}

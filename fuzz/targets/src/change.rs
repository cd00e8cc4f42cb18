//! How inputs are changed, from a seed: bytes, numbers within bytes, lines of text.

/// Longest input that changes lead to.
const LONGEST: usize = 1 << 20;

/// Whole numbers at the edges of something.
const WHOLE: [u64; 12] = [
    0,
    1,
    2,
    3,
    255,
    1 << 16,
    u32::MAX as u64,
    1 << 32,
    1 << 53,
    i64::MAX as u64,
    u64::MAX - 1,
    u64::MAX,
];

/// Real numbers at the edges of something.
const REAL: [f64; 14] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    1e-9,
    1e9,
    1e300,
    -1e300,
    5e-324,
    f64::MAX,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

/// Numbers as a scene may have them, and words that are not numbers.
const WRITTEN: [&str; 26] = [
    "0",
    "1",
    "-1",
    "2",
    "3",
    "1e-300",
    "1e300",
    "-1e300",
    "1e16",
    "1e-9",
    "5e-324",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "4294967296",
    "1000000",
    "0.5",
    "true",
    "\"\"",
    "[]",
    "{}",
    "\"t\"",
    "1979-05-27T07:32:00Z",
];

/// A source of changes.
#[derive(Debug, Clone)]
pub struct Changer(pub fastrand::Rng);

impl Changer {
    /// The one of this seed.
    pub fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    /// A number below `end`; 0 where there is none.
    pub fn below(&mut self, end: usize) -> usize {
        if end == 0 { 0 } else { self.0.usize(..end) }
    }

    /// One of `these`.
    pub fn one<'a, T>(&mut self, these: &'a [T]) -> &'a T {
        &these[self.below(these.len())]
    }

    /// Changes bytes in a few places.
    pub fn bytes(&mut self, input: &mut Vec<u8>, seeds: &[Vec<u8>]) {
        for _ in 0..1 << self.below(4) {
            self.byte(input, seeds);
        }
        input.truncate(LONGEST);
    }

    fn byte(&mut self, input: &mut Vec<u8>, seeds: &[Vec<u8>]) {
        let at = self.below(input.len() + 1);
        let to = (at + 1 + self.below(64)).min(input.len());
        match self.below(9) {
            0 => {
                if let Some(byte) = input.get_mut(at) {
                    *byte ^= 1 << self.0.u8(..8);
                }
            }
            1 => {
                if let Some(byte) = input.get_mut(at) {
                    *byte = self.0.u8(..);
                }
            }
            2 => drop(input.drain(at.min(to)..to)),
            3 => {
                let again = input[at.min(to)..to].to_vec();
                input.splice(at..at, again);
            }
            4 => {
                let number = self.one(&WHOLE).to_le_bytes();
                let bytes = *self.one(&[1, 4, 8]);
                overwrite(input, at, &number[..bytes]);
            }
            5 => {
                let number = self.one(&REAL).to_le_bytes();
                overwrite(input, at & !7, &number);
            }
            6 if !seeds.is_empty() => {
                let other = self.one(seeds);
                let from = self.below(other.len());
                let piece = &other[from..(from + 1 + self.below(256)).min(other.len())];
                input.splice(at.min(to)..to, piece.iter().copied());
            }
            7 => input.truncate(at),
            _ => {
                let byte = self.0.u8(..);
                input.insert(at, byte);
            }
        }
    }

    /// Changes lines of a text, numbers and words in them, now and then bytes.
    pub fn text(&mut self, input: &mut Vec<u8>, seeds: &[Vec<u8>]) {
        if self.below(8) == 0 {
            return self.bytes(input, seeds);
        }
        let text = String::from_utf8_lossy(input).into_owned();
        let mut lines: Vec<String> = text.lines().map(String::from).collect();
        for _ in 0..1 << self.below(4) {
            self.line(&mut lines, seeds);
        }
        *input = lines.join("\n").into_bytes();
        input.truncate(LONGEST);
    }

    fn line(&mut self, lines: &mut Vec<String>, seeds: &[Vec<u8>]) {
        let at = self.below(lines.len());
        match self.below(8) {
            0 if at < lines.len() => drop(lines.remove(at)),
            1 if at < lines.len() => lines.insert(at, lines[at].clone()),
            2 => {
                let other = self.below(lines.len());
                if at < lines.len() {
                    lines.swap(at, other);
                }
            }
            3 => {
                let other = self.one(seeds).clone();
                let other = String::from_utf8_lossy(&other);
                let others: Vec<&str> = other.lines().collect();
                let from = self.below(others.len());
                let to = (from + 1 + self.below(12)).min(others.len());
                lines.splice(at..at, others[from..to].iter().map(|l| (*l).to_owned()));
            }
            _ => {
                if let Some(line) = lines.get_mut(at) {
                    self.token(line);
                }
            }
        }
    }

    /// Changes a number or a word of a line.
    fn token(&mut self, line: &mut String) {
        let of_word = |c: char| c.is_ascii_alphanumeric() || "._-+\"".contains(c);
        let mut spans = Vec::new();
        let mut begin = None;
        for (at, c) in line.char_indices().chain([(line.len(), ' ')]) {
            match (begin, of_word(c)) {
                (None, true) => begin = Some(at),
                (Some(from), false) => {
                    spans.push(from..at);
                    begin = None;
                }
                _ => {}
            }
        }
        if spans.is_empty() {
            return;
        }
        let span = self.one(&spans).clone();
        let new = match self.below(5) {
            0 => {
                let other = self.one(&spans).clone();
                line[other].to_owned()
            }
            1 => {
                let operator = *self.one(&["+", "-", "*", "/", "^", ", ", ".", "(", ")"]);
                format!("{}{operator}{}", &line[span.clone()], self.one(&WRITTEN))
            }
            2 => format!("{}", f64::from_bits(self.0.u64(..))),
            _ => (*self.one(&WRITTEN)).to_owned(),
        };
        line.replace_range(span, &new);
    }
}

fn overwrite(input: &mut [u8], at: usize, with: &[u8]) {
    for (byte, new) in input.iter_mut().skip(at).zip(with) {
        *byte = *new;
    }
}

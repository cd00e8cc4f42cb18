//! Text of others that is shown: of scenes, of solvers, of paths. A terminal obeys control characters, and a line break
//! makes a line that no process has written.

use std::borrow::Cow;
use std::fmt::Write as _;

/// Whether a character only stands for itself. Control characters do not, nor do those that turn the direction of what
/// follows.
pub fn is_plain(c: char) -> bool {
    !c.is_control() && !matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The text with every character that is not plain as its escape (`\n`, `\u{1b}`), but for those of `kept`.
pub fn escaped<'a>(text: &'a str, kept: &[char]) -> Cow<'a, str> {
    let passes = |c: char| is_plain(c) || kept.contains(&c);
    if text.chars().all(passes) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if passes(c) {
            escaped.push(c);
        } else {
            let _ = match c {
                '\n' | '\r' | '\t' => write!(escaped, "{}", c.escape_default()),
                _ => write!(escaped, "{}", c.escape_unicode()),
            };
        }
    }
    Cow::Owned(escaped)
}

/// A text of several lines, of which each is shown as one.
pub fn lines(text: &str) -> Cow<'_, str> {
    escaped(text, &['\n', '\t'])
}

/// A text that is shown as one line.
pub fn line(text: &str) -> Cow<'_, str> {
    escaped(text, &[])
}

/// A place in m to five digits: `(0.1, -17.506) m`.
pub fn place(at: [f64; 2]) -> String {
    let [x, y] = at.map(|x| format!("{x:.4e}").parse().unwrap_or(x));
    format!("({x}, {y}) m")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_has_the_digits_that_people_read() {
        assert_eq!(place([-0.006_220_881_565_8, 0.12]), "(-0.0062209, 0.12) m");
        assert_eq!(place([-17.506_185, f64::NAN]), "(-17.506, NaN) m");
    }

    #[test]
    fn nothing_that_a_terminal_obeys_is_left() {
        assert!(matches!(line("Drucker–Prager, 25 °"), Cow::Borrowed(_)));
        assert_eq!(line("a\u{1b}[2Jb\nc"), "a\\u{1b}[2Jb\\nc");
        assert_eq!(lines("a\tb\n\u{9b}c\u{202e}"), "a\tb\n\\u{9b}c\\u{202e}");
    }
}

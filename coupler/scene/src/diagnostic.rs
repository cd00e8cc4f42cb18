//! Messages about the faults of a scene, with which an engineer can correct it without a manual: the position, what was
//! written, what was expected, and what to write instead.

use std::borrow::Cow;
use std::fmt::{self, Write as _};
use std::ops::Range;

use interface::text::{is_plain, line, lines};

/// Longest value that a message repeats, in characters.
const VALUE_LIMIT: usize = 60;
/// Largest number of reported faults of a scene; the others appear when these are corrected.
pub(super) const FAULTS_LIMIT: usize = 100;
/// Longest part of a line that a message shows, in characters.
const LINE_LIMIT: usize = 240;
/// Longest word that may be a typing error of another one.
const WORD_LIMIT: usize = 60;
/// Largest number of candidates that a message lists, and of those that are compared with a word.
const CANDIDATES_LIMIT: usize = 100;
const COMPARED_LIMIT: usize = 1000;
/// Longest message or key that is shown, and longest help, in bytes.
const SHOWN_LIMIT: usize = 1000;
const HELP_LIMIT: usize = 10_000;

/// One thing that is wrong with a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// What is wrong, in one sentence without its full stop.
    pub message: String,
    /// Dotted key, such as `mpm.points.0.spacing`; empty for the file as a whole.
    pub key: String,
    /// Its position.
    pub place: Place,
    /// What to do about it.
    pub help: Option<String>,
}

/// Where a value of a scene comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    File {
        /// Path as given.
        file: String,
    },
    /// A part of one line of the file.
    Line {
        /// Path as given.
        file: String,
        /// From 1.
        line: usize,
        /// In characters, from 1.
        column: usize,
        /// Characters that the caret underlines, at least 1.
        width: usize,
        /// The line itself. Of a long line only the part to which the message refers.
        text: String,
        /// Characters of the line before that part.
        skipped: usize,
        /// The variant whose override this is.
        variant: Option<String>,
    },
    /// The command line.
    Set {
        /// `KEY=VALUE` as given.
        argument: String,
    },
}

impl Place {
    /// The place of a byte range of `text`; if it spans several lines, that on the first line.
    pub fn in_text(file: &str, text: &str, span: &Range<usize>) -> Self {
        let start = text.floor_char_boundary(span.start);
        let line_start = text[..start].rfind('\n').map_or(0, |at| at + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |at| start + at);
        let end = text.floor_char_boundary(span.end).clamp(start, line_end);
        let line = text[line_start..line_end].trim_end();
        let column = text[line_start..start].chars().count() + 1;
        let is_long = line.chars().count() > LINE_LIMIT;
        let skipped = if is_long {
            column.saturating_sub(LINE_LIMIT / 3)
        } else {
            0
        };
        let shown = line.chars().skip(skipped).take(LINE_LIMIT);
        let left = (skipped + LINE_LIMIT + 1).saturating_sub(column).max(1);
        Self::Line {
            file: file.to_owned(),
            line: text[..start].matches('\n').count() + 1,
            column,
            width: text[start..end].chars().count().clamp(1, left),
            text: shown.collect(),
            skipped,
            variant: None,
        }
    }

    /// The line of the file, where there is one.
    pub fn line(&self) -> Option<usize> {
        match self {
            Self::Line { line, .. } => Some(*line),
            Self::File { .. } | Self::Set { .. } => None,
        }
    }
}

/// A text without its middle, if it is longer than `most`.
fn cut(text: &str, most: usize) -> Cow<'_, str> {
    if text.len() <= most {
        return text.into();
    }
    let head = &text[..text.floor_char_boundary(most / 2)];
    let tail = &text[text.floor_char_boundary(text.len() - most / 2)..];
    format!("{head}...{tail}").into()
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "error: {}", line(&cut(&self.message, SHOWN_LIMIT)))?;
        let key = if self.key.is_empty() {
            String::new()
        } else {
            format!("  ({})", line(&cut(&self.key, SHOWN_LIMIT)))
        };
        match &self.place {
            Place::File { file } => writeln!(f, "  --> {}{key}", line(file))?,
            Place::Set { argument } => {
                let argument = cut(argument, SHOWN_LIMIT);
                let argument = line(&argument);
                writeln!(f, "  --> command line: --set {argument}{key}")?;
            }
            Place::Line {
                file,
                line: number,
                column,
                width,
                text,
                skipped,
                variant,
            } => {
                let of_variant = variant
                    .as_ref()
                    .map_or(String::new(), |name| format!("  set by variant `{name}`"));
                writeln!(f, "  --> {}:{number}:{column}{key}{of_variant}", line(file))?;
                let number = number.to_string();
                let gutter = " ".repeat(number.len());
                // Tabs before the caret are repeated, so that it stands under its value at any tab width.
                let indent: String = text
                    .chars()
                    .take(column - 1 - skipped)
                    .map(|c| if c == '\t' { '\t' } else { ' ' })
                    .collect();
                // Each is one character wide, so that the caret stays under its value.
                let shown = text.replace(|c| c != '\t' && !is_plain(c), "\u{fffd}");
                writeln!(f, "   {number} | {shown}")?;
                writeln!(f, "   {gutter} | {indent}{}", "^".repeat(*width))?;
            }
        }
        if let Some(help) = &self.help {
            writeln!(f, "   help: {}", lines(&cut(help, HELP_LIMIT)))?;
        }
        Ok(())
    }
}

/// Everything that is wrong with a scene; at least one thing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneErrors(pub Vec<Diagnostic>);

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.0.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{diagnostic}")?;
        }
        Ok(())
    }
}

impl std::error::Error for SceneErrors {}

/// `value` on one line and not longer than a message should be.
pub fn shorten(value: &str) -> String {
    let line: String = value.split_whitespace().collect::<Vec<_>>().join(" ");
    if line.chars().count() <= VALUE_LIMIT {
        return line;
    }
    let head: String = line.chars().take(VALUE_LIMIT).collect();
    format!("{head}...")
}

/// The candidate for which `word` is probably a typing error, if one is similar.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if word.len() > WORD_LIMIT {
        return None;
    }
    let word = word.to_lowercase();
    candidates
        .into_iter()
        .take(COMPARED_LIMIT)
        .filter(|candidate| candidate.len() <= 2 * WORD_LIMIT)
        .map(|candidate| {
            let distance = strsim::damerau_levenshtein(&word, &candidate.to_lowercase());
            (distance, candidate)
        })
        .min_by_key(|(distance, _)| *distance)
        // A word with up to a third of its letters wrong is a typing error; with more it is another word.
        .filter(|(distance, candidate)| *distance <= candidate.len().max(word.len()).div_ceil(3))
        .map(|(_, candidate)| candidate)
}

/// "did you mean `x`? `what`: a, b, c". The first half is left out if no candidate is similar.
pub fn suggestion<'a>(
    word: &str,
    what: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> String {
    let candidates: Vec<&str> = candidates.into_iter().collect();
    if candidates.is_empty() {
        return format!("{what}: none");
    }
    let listed = candidates.len().min(CANDIDATES_LIMIT);
    let mut all = candidates[..listed].join(", ");
    let more = candidates.len() - listed;
    if more > 0 {
        write!(all, " and {more} more").expect("a text takes all");
    }
    match nearest(word, candidates) {
        Some(candidate) => format!("did you mean `{candidate}`? {what}: {all}"),
        None => format!("{what}: {all}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_nothing_can_be_meant_the_list_says_so() {
        assert_eq!(
            suggestion("sand", "groups of points", []),
            "groups of points: none"
        );
    }

    #[test]
    fn a_place_is_the_line_column_and_width_of_a_span() {
        let text = "a = 1\nücell = 0.003\n";
        let start = text.find("0.003").unwrap();
        let place = Place::in_text("x.toml", text, &(start..start + 5));
        assert_eq!(
            place,
            Place::Line {
                file: "x.toml".into(),
                line: 2,
                column: 9,
                width: 5,
                text: "ücell = 0.003".into(),
                skipped: 0,
                variant: None
            }
        );
    }

    /// A scene may be one long line, and each message repeated all of it.
    #[test]
    fn of_a_long_line_the_part_that_is_meant_is_shown() {
        let text = format!("{}here{}", "ü".repeat(1000), " ".repeat(1000) + "x");
        let Place::Line {
            column,
            width,
            text,
            skipped,
            ..
        } = Place::in_text("x.toml", &text, &(2000..2004))
        else {
            unreachable!("a place in a text is a line");
        };
        assert_eq!((column, width), (1001, 4));
        assert_eq!(
            text.chars()
                .skip(column - 1 - skipped)
                .take(4)
                .collect::<String>(),
            "here"
        );
        assert!(text.chars().count() <= LINE_LIMIT);
    }

    /// Words of a megabyte were compared letter by letter.
    #[test]
    fn no_long_word_is_a_typing_error_and_not_every_candidate_is_listed() {
        let long = "a".repeat(1 << 20);
        assert_eq!(nearest(&long, [long.as_str(), "cell"]), None);
        assert_eq!(nearest("cel", [long.as_str(), "cell"]), Some("cell"));
        let names: Vec<String> = (0..5000).map(|i| format!("name_{i}")).collect();
        let suggested = suggestion("cell", "names", names.iter().map(String::as_str));
        assert!(suggested.ends_with("name_99 and 4900 more"), "{suggested}");
    }

    #[test]
    fn the_nearest_word_is_found_and_a_far_one_is_not_guessed() {
        assert_eq!(nearest("cel", ["domain", "cell"]), Some("cell"));
        assert_eq!(nearest("Ugmip", ["linear", "ugimp"]), Some("ugimp"));
        assert_eq!(nearest("temperature", ["cell", "shape"]), None);
    }
}

//! Finds the bracket that is still open where a parser stops in a text that is not TOML.

/// Position of the innermost bracket that is open at `end` and is not closed on that line, both in bytes from the start. Brackets
/// in strings and comments do not count.
pub(super) fn open_at(text: &str, end: usize) -> Option<usize> {
    let bytes = &text.as_bytes()[..line_end(text.as_bytes(), end.min(text.len()))];
    let mut open = Vec::new();
    let mut at = 0;
    while let Some(&byte) = bytes.get(at) {
        at = match byte {
            b'#' => line_end(bytes, at),
            b'"' | b'\'' => string_end(bytes, at),
            b'[' | b'{' => {
                open.push(at);
                at + 1
            }
            b']' | b'}' => {
                open.pop();
                at + 1
            }
            _ => at + 1,
        };
    }
    open.into_iter().rev().find(|at| *at < end)
}

fn line_end(bytes: &[u8], from: usize) -> usize {
    let end = bytes[from..].iter().position(|&byte| byte == b'\n');
    end.map_or(bytes.len(), |length| from + length)
}

/// Position after the string that begins here, or after its line if the string does not end.
fn string_end(bytes: &[u8], from: usize) -> usize {
    let quote = bytes[from];
    let long = [quote; 3];
    let is_long = bytes[from..].starts_with(&long);
    let length = if is_long { 3 } else { 1 };
    let mut at = from + length;
    while at < bytes.len() && (is_long || bytes[at] != b'\n') {
        if bytes[at..].starts_with(&long[..length]) {
            return at + length;
        }
        let escapes = bytes[at] == b'\\' && quote == b'"';
        let escaped = bytes
            .get(at + 1)
            .filter(|&&byte| escapes && (is_long || byte != b'\n'));
        at += 1 + usize::from(escaped.is_some());
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_innermost_open_bracket_is_found() {
        for (text, opened) in [
            ("a = [1, 2]\nb = 3", None),
            ("a = [[1, 2], [3, 4]\nb = 3", Some(4)),
            ("a = [[1, 2], [3, 4\nb = 3", Some(13)),
            ("a = { b = [1 }\nc = 3", Some(4)),
            ("[section\nb = 3", Some(0)),
            ("# [\na = \"[\\\"[\" # {\nb = '['\n", None),
            ("a = \"\"\"\n[ \"\" [\n\"\"\"\nb = [", Some(23)),
            ("a = '''[''\n''' [", Some(15)),
            ("a = \"no end [\nb = [", Some(18)),
            ("a = \"\\", None),
            ("a = \"\\\nb = [", Some(11)),
        ] {
            assert_eq!(open_at(text, text.len()), opened, "{text}");
        }
        // A header closes its own brackets, even if its key is wrong.
        assert_eq!(open_at("a = { b = 1 }\n[[a.c]]\n", 16), None);
        assert_eq!(open_at("a = [1, 2\nb = 3", 10), Some(4));
        assert_eq!(open_at("ä = [", 99), Some(5));
    }
}

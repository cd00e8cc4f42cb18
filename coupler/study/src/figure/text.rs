//! How wide words are, before anything draws them: what is laid out must not overlap wherever the figure is opened.

/// Advance widths of DejaVu Sans for the characters from space to tilde, in thousandths of the size. It is the widest of the
/// faces that `sans-serif` stands for, so that what has room with it has room with the others.
const WIDTHS: [u16; 95] = [
    318, 401, 460, 838, 636, 950, 780, 275, 390, 390, 500, 838, 318, 361, 318, 337, 636, 636, 636,
    636, 636, 636, 636, 636, 636, 636, 337, 337, 838, 838, 838, 531, 1000, 684, 686, 698, 770, 632,
    575, 775, 752, 295, 295, 656, 557, 863, 748, 787, 603, 787, 695, 635, 611, 732, 684, 989, 685,
    611, 685, 390, 337, 390, 838, 500, 500, 613, 635, 550, 635, 615, 352, 635, 634, 278, 278, 579,
    278, 974, 634, 612, 635, 635, 411, 521, 392, 634, 592, 818, 592, 592, 525, 636, 337, 636, 838,
];
/// Width of any other character.
const OTHER: u16 = 1000;

/// Width of a line of text of this size, in the unit of the size.
pub(super) fn width(words: &str, size: f64) -> f64 {
    let thousandths = |c: char| -> f64 {
        let place = (c as usize).checked_sub(' ' as usize);
        f64::from(place.and_then(|k| WIDTHS.get(k)).copied().unwrap_or(OTHER))
    };
    words.chars().map(thousandths).sum::<f64>() * 1e-3 * size
}

/// The words in lines of at most this width, none if there are no words. A word that is wider is cut.
pub(super) fn wrapped(words: &str, size: f64, most: f64) -> Vec<String> {
    if words.is_empty() {
        return Vec::new();
    }
    let mut lines = vec![String::new()];
    for word in words.split(' ') {
        let line = lines.last_mut().expect("there is a line");
        let longer = if line.is_empty() {
            word.to_owned()
        } else {
            format!("{line} {word}")
        };
        if width(&longer, size) <= most {
            *line = longer;
            continue;
        }
        if !line.is_empty() {
            lines.push(String::new());
        }
        for c in word.chars() {
            let line = lines.last_mut().expect("there is a line");
            if !line.is_empty() && width(line, size) + width(&c.to_string(), size) > most {
                lines.push(String::new());
            }
            lines.last_mut().expect("there is a line").push(c);
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_as_wide_as_their_letters() {
        assert!((width("i", 10.0) - 2.78).abs() < 1e-12);
        assert!((width("~ ~", 100.0) - (83.8 + 31.8 + 83.8)).abs() < 1e-9);
        assert_eq!(width("é", 10.0), 10.0);
        assert_eq!(width("", 10.0), 0.0);
    }

    #[test]
    fn lines_are_no_wider_than_they_may_be_and_lose_nothing() {
        let words = "error of \"largest error\", of the reference, averylongwordwithoutanyspace";
        for most in [60.0, 100.0, 1000.0] {
            let lines = wrapped(words, 14.0, most);
            assert!(
                lines.iter().all(|line| width(line, 14.0) <= most),
                "{lines:?}"
            );
            let letters = |text: &str| text.replace(' ', "");
            assert_eq!(letters(&lines.concat()), letters(words));
        }
        assert_eq!(wrapped(words, 14.0, 1000.0), [words]);
    }
}

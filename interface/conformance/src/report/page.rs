//! The result as a page for a browser, and as a badge for a README.

use core::fmt::Write as _;

use quick_xml::escape::escape;

use super::{count, shown, waiver};
use crate::Examination;
use crate::report::summary;
use crate::verdict::Verdict;
use crate::waiver::Waivers;

const STYLE: &str = "
:root { color-scheme: light dark; font: 16px/1.45 system-ui, sans-serif }
body { max-width: 70em; margin: 2em auto; padding: 0 1em }
table { border-collapse: collapse; width: 100% }
td, th { text-align: left; vertical-align: top; padding: .3em .6em; border-bottom: 1px solid #8884 }
pre { margin: .3em 0 0; white-space: pre-wrap; overflow-wrap: anywhere }
small { opacity: .75 }
.pass { color: #1a7f37 } .fail { color: #cf222e; font-weight: bold } .waived, .blocked { color: #9a6700 }
@media (prefers-color-scheme: dark) { .pass { color: #3fb950 } .fail { color: #ff7b72 } .waived, .blocked { color: #d29922 } }
";

/// The verdicts as one page of HTML without scripts or links. `kept` is the verdict of the whole, as the exit status tells it.
pub fn html(examination: &Examination, waivers: &Waivers, kept: bool) -> String {
    let title = format!(
        "Conformance of {} {}",
        examination.party, examination.identity
    );
    let (class, word) = if kept {
        ("pass", "kept")
    } else {
        ("fail", "not kept")
    };
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title><style>{STYLE}</style></head><body>\n\
         <h1>{0}</h1>\n<p>The protocol is <span class=\"{class}\">{word}</span>.</p>\n<pre>{1}</pre>\n\
         <table><thead><tr><th>clause<th>level<th>verdict<th>what it asks for, and what was seen</tr></thead><tbody>\n",
        escape(&title),
        escape(summary(examination, waivers)),
    );
    for judged in &examination.judged {
        let (word, said) = shown(judged, waivers);
        let clause = judged.clause;
        let _ = write!(
            text,
            "<tr><td>{}<td>{}<td class=\"{}\">{}<td>{}",
            clause.id,
            clause.level,
            word.to_lowercase().replace('/', "-"),
            word,
            escape(clause.title),
        );
        if !said.is_empty() {
            let _ = write!(text, "<br><small>{}</small>", escape(&said));
        }
        if let Verdict::Fail(evidence) = &judged.verdict {
            let mut lines = vec![evidence.to_string()];
            lines.extend(evidence.story.iter().cloned());
            lines.extend(waiver(judged, waivers).map(|reason| format!("waived: {reason}")));
            let _ = write!(text, "<pre>{}</pre>", escape(lines.join("\n")));
        }
        text.push_str("</tr>\n");
    }
    text + "</tbody></table>\n</body></html>\n"
}

/// The verdict of the whole as an SVG of 20 pixels' height: the profile and how many clauses pass, or how many are broken.
pub fn badge(examination: &Examination, waivers: &Waivers, kept: bool) -> String {
    let [failed, passed] = ["FAIL", "pass"].map(|word| count(examination, waivers, word));
    let all = examination.judged.len();
    let said = match examination.profile() {
        _ if failed > 0 => format!("{failed} of {all} clauses broken"),
        _ if !kept => "not all judged".to_owned(),
        Some(profile) if examination.whole => format!("{}, {passed} clauses", profile.name),
        _ => format!("{passed} clauses"),
    };
    let name = format!("tandem {}", examination.party);
    let colour = if kept { "#2da44e" } else { "#cf222e" };
    let (name, said) = (escape(&name), escape(&said));
    // Of a letter in 11 px; `textLength` makes it so in any font.
    let width = |text: &str| 6 * text.chars().count() + text.chars().count() / 2;
    let (left, right) = (width(&name), width(&said));
    let (middle, all) = (left + 12, left + right + 24);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{all}\" height=\"20\" role=\"img\" aria-label=\"{name}: {said}\">\
         <title>{name}: {said}</title>\
         <rect width=\"{all}\" height=\"20\" rx=\"3\" fill=\"#444c56\"/>\
         <path d=\"M{middle} 0h{}a3 3 0 0 1 3 3v14a3 3 0 0 1-3 3h-{}z\" fill=\"{colour}\"/>\
         <g fill=\"#fff\" font-family=\"Verdana,DejaVu Sans,sans-serif\" font-size=\"11\">\
         <text x=\"6\" y=\"14\" textLength=\"{left}\" lengthAdjust=\"spacingAndGlyphs\">{name}</text>\
         <text x=\"{}\" y=\"14\" textLength=\"{right}\" lengthAdjust=\"spacingAndGlyphs\">{said}</text></g></svg>\n",
        right + 9,
        right + 9,
        middle + 6,
    )
}

//! The result as JUnit XML, which build servers read.

use quick_xml::escape::escape;

use super::{count, shown};
use crate::verdict::Verdict;
use crate::{Examination, Judged};

/// The examination as a test suite: a clause is a test case, what is not applicable or blocked is skipped.
pub fn junit(examination: &Examination) -> String {
    let judged = &examination.judged;
    let cases: String = judged.iter().map(case).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"tandem conformance {}\" tests=\"{}\" \
         failures=\"{}\" skipped=\"{}\" time=\"{:.3}\">\n{cases}</testsuite>\n",
        examination.party,
        judged.len(),
        count(examination, "FAIL"),
        count(examination, "n/a") + count(examination, "blocked"),
        examination.wall.as_secs_f64(),
    )
}

fn case(judged: &Judged) -> String {
    let clause = judged.clause;
    let inner = match (&judged.verdict, shown(judged)) {
        (Verdict::Fail(evidence), _) => format!(
            "<failure type=\"{}\">{}</failure>",
            clause.id,
            escape(evidence.to_string())
        ),
        (Verdict::Pass { .. }, _) => String::new(),
        (_, (word, detail)) => {
            format!(
                "<skipped message=\"{}\"/>",
                escape(format!("{word} {detail}"))
            )
        }
    };
    format!(
        "  <testcase classname=\"{0}\" name=\"{0} {1}\" time=\"{2:.3}\">{inner}</testcase>\n",
        clause.id,
        escape(clause.title),
        judged.wall.as_secs_f64(),
    )
}

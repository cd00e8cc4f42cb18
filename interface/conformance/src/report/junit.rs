//! The result as JUnit XML, which build servers read.

use quick_xml::escape::escape;

use crate::verdict::Verdict;
use crate::{Examination, Judged};

/// The examination as a test suite: a clause is a test case, what is not applicable or blocked is skipped.
pub fn junit(examination: &Examination) -> String {
    let judged = &examination.judged;
    let skipped = |j: &&Judged| why_skipped(j).is_some();
    let failures = judged.iter().filter(|j| j.failed()).count();
    let cases: String = judged.iter().map(case).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"tandem conformance {}\" tests=\"{}\" \
         failures=\"{failures}\" skipped=\"{}\" time=\"{:.3}\">\n{cases}</testsuite>\n",
        examination.party,
        judged.len(),
        judged.iter().filter(skipped).count(),
        examination.wall.as_secs_f64(),
    )
}

fn case(judged: &Judged) -> String {
    let clause = judged.clause;
    let inner = match (why_skipped(judged), &judged.verdict) {
        (Some(reason), _) => format!("<skipped message=\"{}\"/>", escape(&reason)),
        (None, Verdict::Fail(evidence)) => {
            let said = evidence.to_string();
            format!(
                "<failure type=\"{}\">{}</failure>",
                clause.id,
                escape(&said)
            )
        }
        _ => String::new(),
    };
    format!(
        "  <testcase classname=\"{0}\" name=\"{0} {1}\" time=\"{2:.3}\">{inner}</testcase>\n",
        clause.id,
        escape(clause.title),
        judged.wall.as_secs_f64(),
    )
}

fn why_skipped(judged: &Judged) -> Option<String> {
    match &judged.verdict {
        Verdict::NotApplicable { reason, .. } => Some(reason.clone()),
        Verdict::Blocked { by } => Some(format!("blocked by {by}")),
        _ => None,
    }
}

//! The result as JUnit XML, which build servers read.

use std::io;

use quick_xml::Writer;
use quick_xml::events::BytesText;

use super::waiver;
use crate::verdict::Verdict;
use crate::waiver::Waivers;
use crate::{Examination, Judged};

/// The examination as a test suite: a clause is a test case, what is not applicable, blocked or waived is skipped.
pub fn junit(examination: &Examination, waivers: &Waivers) -> String {
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
    write(&mut writer, examination, waivers).expect("memory takes what is written");
    let body = String::from_utf8(writer.into_inner()).expect("it was text");
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{body}\n")
}

fn write(
    writer: &mut Writer<Vec<u8>>,
    examination: &Examination,
    waivers: &Waivers,
) -> io::Result<()> {
    let judged = &examination.judged;
    let skipped = |j: &&Judged| why_skipped(j, waivers).is_some();
    let failures = judged.iter().filter(|j| j.failed() && !skipped(j)).count();
    let wall = examination.wall.as_secs_f64();
    let suite = [
        ("name", format!("tandem conformance {}", examination.party)),
        ("tests", judged.len().to_string()),
        ("failures", failures.to_string()),
        ("skipped", judged.iter().filter(skipped).count().to_string()),
        ("time", format!("{wall:.3}")),
    ];
    let suite = suite.iter().map(|(key, value)| (*key, value.as_str()));
    let element = writer.create_element("testsuite").with_attributes(suite);
    element
        .write_inner_content(|writer| judged.iter().try_for_each(|j| case(writer, j, waivers)))?;
    Ok(())
}

fn case(writer: &mut Writer<Vec<u8>>, judged: &Judged, waivers: &Waivers) -> io::Result<()> {
    let name = format!("{} {}", judged.clause.id, judged.clause.title);
    let time = format!("{:.3}", judged.wall.as_secs_f64());
    let attributes = [
        ("classname", judged.clause.id),
        ("name", name.as_str()),
        ("time", time.as_str()),
    ];
    let element = writer
        .create_element("testcase")
        .with_attributes(attributes);
    if let Some(reason) = why_skipped(judged, waivers) {
        element.write_inner_content(|writer| {
            let skipped = writer.create_element("skipped");
            skipped
                .with_attribute(("message", reason.as_str()))
                .write_empty()?;
            Ok(())
        })?;
    } else if let Verdict::Fail(evidence) = &judged.verdict {
        element.write_inner_content(|writer| {
            let failure = writer.create_element("failure");
            let failure = failure.with_attribute(("type", judged.clause.id));
            failure.write_text_content(BytesText::new(&evidence.to_string()))?;
            Ok(())
        })?;
    } else {
        element.write_empty()?;
    }
    Ok(())
}

fn why_skipped(judged: &Judged, waivers: &Waivers) -> Option<String> {
    match &judged.verdict {
        Verdict::NotApplicable { reason, .. } => Some(reason.clone()),
        Verdict::Blocked { by } => Some(format!("blocked by {by}")),
        _ => waiver(judged, waivers).map(|reason| format!("waived: {reason}")),
    }
}

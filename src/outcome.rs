//! The results of a run on the terminal.

use console::{Term, style, truncate_str};
use coupler::record::summary::Summary;
use coupler::scene::Scene;
use report::verdict::{Row, rows_of};

use crate::terminal::say;

/// Widest column of names.
const NAMES: usize = 44;

/// Says how every check has come out, and what the run was.
pub fn show(summary: &Summary, scene: &Scene) {
    for warning in &summary.warnings {
        say(format_args!(
            "  {}  {warning}",
            style("WARNING").red().bold()
        ));
    }
    show_checks(&rows_of(scene, &summary.checks));
    if let Some(remark) = scene.expect.remark(summary.status) {
        say(format_args!("  {remark}"));
    }
    let bound: Vec<String> = summary
        .dt_bound_by
        .iter()
        .map(|(name, steps)| format!("{name} {steps}"))
        .collect();
    let gap = summary.energy.work_gap;
    let gap = gap.map(|gap| format!(", work not stored {}", relative(gap)));
    let transfer = summary.energy.transfer;
    let transfer = if transfer == 0.0 {
        String::new()
    } else {
        format!(", taken by the transfer {}", relative(transfer))
    };
    say(format_args!(
        "{}: {} steps to t = {:.6} s in {:.2} s; step limited by: {}; momentum error {}, angular {}, energy residual {}{transfer}{}",
        summary.scene,
        summary.steps,
        summary.time,
        summary.spent.wall_s,
        bound.join(", "),
        relative(summary.momentum_error),
        summary
            .angular_momentum_error
            .map_or("none".to_owned(), relative),
        relative(summary.energy.residual_max),
        gap.unwrap_or_default()
    ));
}

/// A share of the largest momentum or energy, whose rounding is some 1e-16.
fn relative(share: f64) -> String {
    if share.abs() < 1e-18 {
        "0".to_owned()
    } else {
        format!("{share:.1e}")
    }
}

fn show_checks(rows: &[Row]) {
    let names = rows.iter().map(|row| row.name.chars().count());
    let width = names.max().unwrap_or_default().min(NAMES);
    // What is read by a program is whole.
    let columns = Term::stdout().is_term().then(|| Term::stdout().size().1);
    for row in rows {
        let line = in_a_line(row, width);
        let line = match columns {
            Some(columns) => truncate_str(&line, columns.into(), "…"),
            None => line.into(),
        };
        say(line);
    }
}

/// `pass  name  value, expected this within that (source)`.
fn in_a_line(row: &Row, width: usize) -> String {
    let result = match row.result {
        "pass" => style("pass").green(),
        "fail" => style("FAIL").red().bold(),
        other => style(other),
    };
    let within = if row.allowed.is_empty() {
        String::new()
    } else {
        format!(" within {}", row.allowed)
    };
    let reason = if row.reason.is_empty() {
        String::new()
    } else {
        format!(": {}", row.reason)
    };
    let words = format!(
        "{:<width$}  {}, expected {}{within}{reason}",
        row.name, row.value, row.expected
    );
    // Numbers and units are kept together on a page; here lines do not break.
    let words = words.replace('\u{a0}', " ");
    format!("  {result}  {words}  ({})", row.source)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_is_printed_with_its_unit_and_its_bounds() {
        let row = Row {
            run: String::new(),
            result: "pass",
            name: "angle of repose".into(),
            when: "at the end",
            value: "25\u{a0}deg".into(),
            expected: "20\u{a0}deg to 27.5\u{a0}deg".into(),
            error: "within".into(),
            allowed: String::new(),
            source: "a paper".into(),
            reason: String::new(),
        };
        let line = in_a_line(&row, 20);
        assert_eq!(
            console::strip_ansi_codes(&line),
            "  pass  angle of repose       25 deg, expected 20 deg to 27.5 deg  (a paper)"
        );
        let row = Row {
            result: "fail",
            expected: "25\u{a0}deg".into(),
            allowed: "1\u{a0}%".into(),
            ..row
        };
        let line = in_a_line(&row, 0);
        assert_eq!(
            console::strip_ansi_codes(&line),
            "  FAIL  angle of repose  25 deg, expected 25 deg within 1 %  (a paper)"
        );
        let row = Row {
            value: "none".into(),
            reason: "the run has no samples around 7 s".into(),
            ..row
        };
        let line = in_a_line(&row, 0);
        assert_eq!(
            console::strip_ansi_codes(&line),
            "  FAIL  angle of repose  none, expected 25 deg within 1 %: the run has no samples around 7 s  (a paper)"
        );
    }
}

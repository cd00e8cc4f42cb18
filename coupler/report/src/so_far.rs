//! What the tables and the log say of a run that has no summary yet.

use crate::record::Record;

/// Simulated time in s.
pub fn time(record: &Record) -> Option<f64> {
    record.history.as_ref()?.last(|name| name == "time")
}

/// Steps.
pub fn steps(record: &Record) -> Option<u64> {
    let course = record.course.as_ref()?;
    let steps = course.last(|name| name.starts_with("steps by "))?;
    Some(steps as u64)
}

/// Points or bodies, as the solver reported in Ready.
pub fn items(record: &Record, party: &str) -> Option<u64> {
    let mut lines = record.log.iter();
    let ready = lines
        .find(|line| line.message() == "ready" && line.value("party").as_deref() == Some(party));
    ready?.value("items")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All of it was shown as a dash.
    #[test]
    fn what_is_known_of_a_run_that_goes_on_is_found() {
        let dir = tempfile::tempdir().unwrap();
        let empty = || std::fs::write(dir.path().join("history.csv"), "time [s],v [m/s]\n");
        empty().unwrap();
        let record = Record::read(dir.path()).unwrap();
        assert_eq!(
            (time(&record), steps(&record), items(&record, "mpm")),
            (None, None, None)
        );
        let files = [
            ("history.csv", "time [s],v [m/s]\n0,1\n0.5,2\n"),
            (
                "course.csv",
                "time [s],step [s],steps by elastic [1],steps by output [1]\n0,0,0,0\n0.5,1e-3,40,2\n",
            ),
            (
                "log.jsonl",
                "{\"level\":\"INFO\",\"fields\":{\"message\":\"ready\",\"party\":\"mpm\",\"items\":373}}\n",
            ),
        ];
        for (name, text) in files {
            std::fs::write(dir.path().join(name), text).unwrap();
        }
        let record = Record::read(dir.path()).unwrap();
        assert_eq!(time(&record), Some(0.5));
        assert_eq!(steps(&record), Some(42));
        assert_eq!(
            (items(&record, "mpm"), items(&record, "dem")),
            (Some(373), None)
        );
    }
}

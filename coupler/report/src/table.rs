//! Tables that a run has written, `history.csv` and `course.csv`, also where it was killed meanwhile.

/// A table of numbers, column by column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Its columns, all of one length.
    pub columns: Vec<Column>,
    /// What could not be read, for people; nothing where all of it could.
    pub faults: Vec<String>,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name, without the unit.
    pub name: String,
    /// Unit; `1` of a pure number, empty where the header has none.
    pub unit: String,
    /// A number for each row.
    pub values: Vec<f64>,
}

impl Table {
    /// Reads the text of a table. A row that is no row of numbers is left out, and [`Self::faults`] names it: the rest of
    /// the table is of use all the same.
    ///
    /// # Errors
    /// There is not even a header.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| e.to_string())?.clone();
        if header.iter().all(|name| name.trim().is_empty()) {
            return Err("it has no header".to_owned());
        }
        let mut columns: Vec<Column> = header.iter().map(Column::named).collect();
        let last_is_whole = text.ends_with('\n');
        let lines = text.lines().count() as u64;
        let mut bad: Vec<u64> = Vec::new();
        let mut torn = false;
        for record in reader.records() {
            let line = match &record {
                Ok(record) => record.position().map_or(0, csv::Position::line),
                Err(error) => error.position().map_or(0, csv::Position::line),
            };
            let row = record.ok().and_then(|record| numbers(&record));
            // The last number of an incomplete row may have lost digits and still be a number.
            if !last_is_whole && line == lines {
                torn = true;
                continue;
            }
            match row.filter(|row| row.len() == columns.len()) {
                Some(row) => {
                    for (column, value) in columns.iter_mut().zip(row) {
                        column.values.push(value);
                    }
                }
                None => bad.push(line),
            }
        }
        let mut faults = Vec::new();
        if torn {
            faults.push("it ends in the middle of a row, which is left out".to_owned());
        }
        if let Some(first) = bad.first() {
            let count = bad.len();
            faults.push(format!(
                "{count} of its lines, line {first} first, have not {} numbers and are left out",
                columns.len()
            ));
        }
        Ok(Self { columns, faults })
    }

    /// Rows that could be read.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// At most so many rows, evenly spread, the first and the last among them.
    #[must_use]
    pub fn thinned(&self, most: usize) -> Self {
        let kept = crate::thin::evenly(self.rows(), most);
        let column = |column: &Column| Column {
            values: kept.iter().map(|&row| column.values[row]).collect(),
            ..column.clone()
        };
        Self {
            columns: self.columns.iter().map(column).collect(),
            faults: self.faults.clone(),
        }
    }
}

impl Column {
    /// Of a header such as `v_disc [m/s]`.
    fn named(header: &str) -> Self {
        let parts = header.strip_suffix(']').and_then(|h| h.rsplit_once(" ["));
        let (name, unit) = parts.unwrap_or((header, ""));
        Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            values: Vec::new(),
        }
    }
}

fn numbers(record: &csv::StringRecord) -> Option<Vec<f64>> {
    record.iter().map(|n| n.trim().parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_table_has_no_faults() {
        let table = Table::parse("time [s],v [m/s],n\n0,1,2\n0.5,-1e-3,NaN\n").unwrap();
        assert_eq!(table.rows(), 2);
        assert_eq!(table.column("v").unwrap().values, [1.0, -1e-3]);
        assert_eq!(table.column("v").unwrap().unit, "m/s");
        assert_eq!(table.column("n").unwrap().unit, "");
        assert!(table.column("n").unwrap().values[1].is_nan());
        assert!(table.faults.is_empty());
    }

    #[test]
    fn a_torn_row_is_left_out_and_named_and_all_others_are_kept() {
        // 2.5 may have been 2.57: a number that lost digits does not count.
        for torn in ["0.2,2.5", "0.2", "0.2,", "0.2,x"] {
            let table = Table::parse(&format!("time [s],v [m/s]\n0,1\n0.1,2\n{torn}")).unwrap();
            assert_eq!(table.column("time").unwrap().values, [0.0, 0.1], "{torn}");
            assert_eq!(table.faults.len(), 1, "{torn}");
            assert!(table.faults[0].contains("middle of a row"), "{torn}");
        }
    }

    #[test]
    fn a_bad_row_in_the_middle_is_named_by_its_line() {
        let table = Table::parse("t,v\n0,1\n1,oops\n2\n3,4\n").unwrap();
        assert_eq!(table.column("v").unwrap().values, [1.0, 4.0]);
        assert_eq!(table.faults.len(), 1);
        assert!(table.faults[0].starts_with("2 of its lines, line 3 first"));
    }

    #[test]
    fn what_is_no_table_is_refused() {
        assert!(Table::parse("").is_err());
        assert_eq!(Table::parse("time [s]\n").unwrap().rows(), 0);
    }

    #[test]
    fn a_thinned_table_keeps_both_ends() {
        let rows: Vec<String> = (0..1000).map(|k| format!("{k},{k}")).collect();
        let rows = rows.join("\n");
        let thin = Table::parse(&format!("t,v\n{rows}\n"))
            .unwrap()
            .thinned(101);
        assert_eq!(thin.rows(), 101);
        let values = &thin.column("v").unwrap().values;
        assert_eq!((values[0], values[100]), (0.0, 999.0));
    }
}

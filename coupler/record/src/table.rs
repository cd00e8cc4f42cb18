//! Tables as CSV: `history.csv` and `course.csv` of a run, also of one that was killed meanwhile; `study.csv` of a study; data of
//! others.

use std::io;
use std::path::Path;

use interface::files::{self, TABLE};

/// A table with a header, column by column.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Its columns, all of one length.
    pub columns: Vec<Column>,
    /// Rows that could not be read, for people; nothing where all could.
    pub faults: Vec<String>,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name, without the unit.
    pub name: String,
    /// Unit, which stands in brackets after the name: `force [N/m]`. It is `1` of a pure number, empty where there is none.
    pub unit: String,
    /// The cells as they are written, row by row.
    pub cells: Vec<String>,
    /// Their numbers; NaN where a cell is none.
    pub values: Vec<f64>,
}

impl Table {
    /// Reads a file that the user names, of which every row counts; the last one may lack its line feed.
    ///
    /// # Errors
    /// It cannot be read, has no header, or its rows are not of one length.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = files::read_named_text(path, TABLE);
        Self::of_text(text.map(|text| text + "\n"))
    }

    /// The same of the file `name` of a run directory, without a row at its end that a run is writing, or that a killed one
    /// has not written whole.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn of_run(dir: &Path, name: &str) -> Result<Self, String> {
        let mut text = files::read_text(dir, name, TABLE);
        if let Ok(text) = &mut text {
            text.truncate(text.rfind('\n').map_or(0, |last| last + 1));
        }
        Self::of_text(text)
    }

    fn of_text(text: io::Result<String>) -> Result<Self, String> {
        let text = text.map_err(|error| error.to_string())?;
        let table = Self::parse(&text)?;
        match table.faults.first() {
            Some(fault) => Err(fault.clone()),
            None => Ok(table),
        }
    }

    /// Reads the text of a table. A row of another length than the header is left out, and [`Self::faults`] names it: the
    /// rest of the table is of use all the same.
    ///
    /// # Errors
    /// There is not even a header.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut reader = csv::ReaderBuilder::new()
            .flexible(true)
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
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
            let position = match &record {
                Ok(record) => record.position(),
                Err(error) => error.position(),
            };
            let line = position.map_or(0, csv::Position::line);
            let row = record.ok().filter(|row| row.len() == columns.len());
            match row {
                // The last cell of an incomplete row may have lost digits and still be a number.
                _ if !last_is_whole && line == lines => torn = true,
                Some(row) => {
                    for (column, cell) in columns.iter_mut().zip(&row) {
                        column.push(cell);
                    }
                }
                None => bad.push(line),
            }
        }
        let mut faults = Vec::new();
        if torn {
            faults.push("it ends in the middle of a row".to_owned());
        }
        if let Some(first) = bad.first() {
            let count = bad.len();
            faults.push(format!(
                "{count} of its lines, line {first} first, have not {} cells",
                columns.len()
            ));
        }
        Ok(Self { columns, faults })
    }

    /// Rows that could be read.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.cells.len())
    }

    /// These rows of it.
    #[must_use]
    pub fn rows_at(&self, rows: &[usize]) -> Self {
        let column = |column: &Column| Column {
            cells: rows.iter().map(|&row| column.cells[row].clone()).collect(),
            values: rows.iter().map(|&row| column.values[row]).collect(),
            ..column.clone()
        };
        Self {
            columns: self.columns.iter().map(column).collect(),
            faults: self.faults.clone(),
        }
    }

    /// Place of the column of this name.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    /// The column of this name.
    pub fn column(&self, name: &str) -> Option<&Column> {
        Some(&self.columns[self.index(name)?])
    }

    /// Names of the columns, with commas between them.
    pub fn names(&self) -> String {
        let names: Vec<&str> = self.columns.iter().map(|c| c.name.as_str()).collect();
        names.join(", ")
    }

    /// The sum of the last numbers of some columns, by their names; `None` without rows.
    pub fn last(&self, is_asked: impl Fn(&str) -> bool) -> Option<f64> {
        let asked = self.columns.iter().filter(|column| is_asked(&column.name));
        let values = asked.filter_map(|column| column.values.last().copied());
        values.reduce(|a, b| a + b)
    }

    /// The numbers of each row, in the order of the columns.
    pub fn numbers(&self) -> impl Iterator<Item = Vec<f64>> {
        let row = |k| self.columns.iter().map(move |column| column.values[k]);
        (0..self.rows()).map(move |k| row(k).collect())
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
            cells: Vec::new(),
            values: Vec::new(),
        }
    }

    fn push(&mut self, cell: &str) {
        self.cells.push(cell.to_owned());
        self.values.push(cell.trim().parse().unwrap_or(f64::NAN));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_found_without_its_unit() {
        let text = "time [s],force [N/m],status,n\n0,1.5,done,\n1,-2e0,failed,7\n";
        let table = Table::parse(text).unwrap();
        assert_eq!(table.names(), "time, force, status, n");
        let force = table.column("force").unwrap();
        assert_eq!(
            (force.unit.as_str(), &force.values[..]),
            ("N/m", &[1.5, -2.0][..])
        );
        assert_eq!(force.cells, ["1.5", "-2e0"]);
        let status = table.column("status").unwrap();
        assert_eq!(
            (status.unit.as_str(), &status.cells[..]),
            ("", &["done", "failed"].map(String::from)[..])
        );
        assert!(table.column("speed").is_none());
        let rows: Vec<Vec<f64>> = table.numbers().collect();
        assert_eq!(rows[0][..2], [0.0, 1.5]);
        assert!(rows[0][2].is_nan() && rows[0][3].is_nan());
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

    /// `plot` counted it with the digits that it had, or refused the table.
    #[test]
    fn a_row_that_is_not_whole_counts_in_a_file_of_the_user_only() {
        let dir = tempfile::tempdir().unwrap();
        let times = |table: Result<Table, String>| table.map(|t| t.columns[0].values.clone());
        for (rows, of_run, named) in [
            ("0,1\n", vec![0.0], Ok(vec![0.0])),
            ("0,1\n0.2,2.5", vec![0.0], Ok(vec![0.0, 0.2])),
            ("0,1\n0.2", vec![0.0], Err(())),
        ] {
            let path = dir.path().join("t.csv");
            std::fs::write(&path, format!("time [s],v [m/s]\n{rows}")).unwrap();
            assert_eq!(
                times(Table::of_run(dir.path(), "t.csv")),
                Ok(of_run),
                "{rows}"
            );
            assert_eq!(times(Table::read(&path)).map_err(|_| ()), named, "{rows}");
        }
    }

    #[test]
    fn a_row_of_another_length_is_named_by_its_line() {
        let table = Table::parse("t,v\n0,1\n1\n2,2,2\n3,4\n").unwrap();
        assert_eq!(table.column("v").unwrap().values, [1.0, 4.0]);
        assert_eq!(table.faults.len(), 1);
        assert!(table.faults[0].starts_with("2 of its lines, line 3 first"));
    }

    #[test]
    fn what_is_no_table_is_refused() {
        assert!(Table::parse("").is_err());
        assert_eq!(Table::parse("time [s]\n").unwrap().rows(), 0);
    }
}

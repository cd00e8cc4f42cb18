//! Tables that were written as CSV: `history.csv` of a run, `study.csv` of a study, data of others.

use std::path::Path;

/// A table with a header; a header's unit stands in brackets after the name, as in `force [N/m]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    names: Vec<String>,
    units: Vec<String>,
    rows: Vec<csv::StringRecord>,
}

impl Table {
    /// Reads a file.
    ///
    /// # Errors
    /// [`csv::Error`]: it cannot be read, or its rows are not of one length.
    pub fn read(path: &Path) -> Result<Self, csv::Error> {
        Self::of(csv::Reader::from_path(path)?)
    }

    fn of<R: std::io::Read>(mut reader: csv::Reader<R>) -> Result<Self, csv::Error> {
        let split = |header: &str| match header.rsplit_once(" [") {
            Some((name, unit)) => (name.to_owned(), unit.trim_end_matches(']').to_owned()),
            None => (header.to_owned(), String::new()),
        };
        let (names, units) = reader.headers()?.iter().map(split).unzip();
        let rows = reader.records().collect::<Result<_, _>>()?;
        Ok(Self { names, units, rows })
    }

    /// Names of the columns, without their units.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Place of a column.
    pub fn index(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    /// Unit of a column, empty where it has none.
    pub fn unit(&self, name: &str) -> Option<&str> {
        Some(&self.units[self.index(name)?])
    }

    /// The numbers of each row, in the order of the columns; NaN where a cell is none.
    pub fn numbers(&self) -> impl Iterator<Item = Vec<f64>> {
        self.rows.iter().map(|row| {
            let number = |cell: &str| cell.parse().unwrap_or(f64::NAN);
            row.iter().map(number).collect()
        })
    }

    /// The text of a column, row by row.
    pub fn text(&self, name: &str) -> Option<impl Iterator<Item = &str>> {
        let place = self.index(name)?;
        Some(self.rows.iter().map(move |row| &row[place]))
    }

    /// A column of numbers; `None` also where a cell is none.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        self.text(name)?.map(|cell| cell.parse().ok()).collect()
    }
}

#[cfg(test)]
impl From<&str> for Table {
    fn from(text: &str) -> Self {
        Self::of(csv::Reader::from_reader(text.as_bytes())).unwrap()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_found_without_its_unit() {
        let table = Table::from("time [s],force [N/m],status,n\n0,1.5,done,\n1,-2,failed,7\n");
        assert_eq!(table.names(), ["time", "force", "status", "n"]);
        assert_eq!(table.unit("force"), Some("N/m"));
        assert_eq!(table.unit("status"), Some(""));
        assert_eq!(table.column("force"), Some(vec![1.5, -2.0]));
        assert_eq!(table.column("n"), None);
        assert_eq!(table.column("speed"), None);
        let text: Vec<&str> = table.text("status").unwrap().collect();
        assert_eq!(text, ["done", "failed"]);
        let rows: Vec<Vec<f64>> = table.numbers().collect();
        assert_eq!(rows[0][..2], [0.0, 1.5]);
        assert!(rows[0][2].is_nan() && rows[0][3].is_nan());
    }
}

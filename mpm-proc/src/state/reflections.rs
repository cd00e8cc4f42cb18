//! Rows of numbers made orthogonal by reflections (Householder), each over the range of columns that it needs.
//!
//! Rows are to come in the order of their first columns. A reflection turns what is left of a row onto one column, its
//! pivot, and leaves the pivots of earlier rows. A row meets only the reflections whose ranges overlap its own, so the
//! cost is the number of rows times the square of the width of the band in which they lie.

use core::ops::Range;

/// Reflections of the rows taken so far.
#[derive(Debug, Default)]
pub struct Reflections {
    all: Vec<Reflection>,
    /// The vectors of the reflections, with the length sqrt(2), over their ranges.
    values: Vec<f64>,
    /// For each column, whether it is the pivot of a row.
    is_pivot: Vec<bool>,
    /// The reflections before this one end before the present row.
    from: usize,
    row: Vec<f64>,
}

#[derive(Debug)]
struct Reflection {
    columns: Range<usize>,
    first: usize,
}

impl Reflection {
    fn of<'a>(&self, values: &'a [f64]) -> &'a [f64] {
        &values[self.first..self.first + self.columns.len()]
    }

    /// `row -= u (u . row)`.
    fn act(&self, values: &[f64], row: &mut [f64]) {
        let (u, row) = (self.of(values), &mut row[self.columns.clone()]);
        let amount: f64 = u.iter().zip(&*row).map(|(u, r)| u * r).sum();
        for (r, u) in row.iter_mut().zip(u) {
            *r -= amount * u;
        }
    }
}

impl Reflections {
    /// Forgets all rows; there are `columns` columns.
    pub fn begin(&mut self, columns: usize) {
        self.all.clear();
        self.values.clear();
        self.is_pivot.clear();
        self.is_pivot.resize(columns, false);
        self.from = 0;
        self.row.clear();
        self.row.resize(columns, 0.0);
    }

    /// Takes a row of `(column, number)`, if more than the share `least` of it is independent of those taken before.
    /// Returns whether it did.
    pub fn take(&mut self, entries: impl Iterator<Item = (usize, f64)>, least: f64) -> bool {
        let (mut start, mut end) = (usize::MAX, 0);
        for (n, value) in entries {
            self.row[n] += value;
            (start, end) = (start.min(n), end.max(n + 1));
        }
        if start >= end {
            return false;
        }
        let mut columns = start..end;
        let square = self.row[columns.clone()].iter().map(|r| r * r).sum::<f64>();
        while self.from < self.all.len() && self.all[self.from].columns.end <= columns.start {
            self.from += 1;
        }
        for reflection in &self.all[self.from..] {
            let own = &reflection.columns;
            if own.start < columns.end && columns.start < own.end {
                reflection.act(&self.values, &mut self.row);
                columns = columns.start.min(own.start)..columns.end.max(own.end);
            }
        }
        let taken = self.reflect(columns.clone(), least * square.sqrt());
        self.row[columns].fill(0.0);
        taken
    }

    /// Adds the reflection of what is left of the row, unless it is at most `least`.
    fn reflect(&mut self, columns: Range<usize>, least: f64) -> bool {
        for n in columns.clone() {
            if self.is_pivot[n] {
                self.row[n] = 0.0;
            }
        }
        let Some(pivot) = columns.clone().find(|n| self.row[*n] != 0.0) else {
            return false;
        };
        let columns = pivot..columns.end;
        let left = &mut self.row[columns.clone()];
        let size = left.iter().map(|r| r * r).sum::<f64>().sqrt();
        if size <= least {
            return false;
        }
        // u = (r + sign(r_0) |r| e_0) / its length / sqrt(2)^-1: away from cancellation.
        left[0] += size.copysign(left[0]);
        let length = (size * left[0].abs()).sqrt();
        let first = self.values.len();
        self.values.extend(left.iter().map(|r| r / length));
        self.is_pivot[pivot] = true;
        self.all.push(Reflection { columns, first });
        true
    }

    /// Replaces a vector by minus its part in the space of the rows.
    pub fn remove_from(&self, vector: &mut [f64]) {
        for reflection in &self.all {
            reflection.act(&self.values, vector);
        }
        for (v, is_pivot) in vector.iter_mut().zip(&self.is_pivot) {
            *v = if *is_pivot { -*v } else { 0.0 };
        }
        for reflection in self.all.iter().rev() {
            reflection.act(&self.values, vector);
        }
    }
}

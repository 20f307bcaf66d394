//! A log as columns: read, cut, thinned and written without the readers of the tool.

use std::fmt::Write as _;
use std::path::Path;

/// A log: columns of numbers under their names, the time first.
#[derive(Debug, Clone)]
pub struct Table {
    pub names: Vec<String>,
    pub columns: Vec<Vec<f64>>,
}

impl Table {
    /// Reads a comma-separated log with a header line and keeps some of its columns.
    pub fn read(path: &Path, keep: &[String]) -> Option<Self> {
        let text = std::fs::read_to_string(path).ok()?;
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next()?.split(',').map(str::trim).collect();
        let place = |name: &String| header.iter().position(|known| *known == name);
        let places: Vec<usize> = keep.iter().map(place).collect::<Option<_>>()?;
        let mut columns = vec![Vec::new(); keep.len()];
        for line in lines {
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            for (column, place) in columns.iter_mut().zip(&places) {
                column.push(cells.get(*place)?.parse().ok()?);
            }
        }
        Some(Self {
            names: keep.to_vec(),
            columns,
        })
    }

    pub fn rows(&self) -> usize {
        self.columns[0].len()
    }

    pub fn column(&self, name: &str) -> &[f64] {
        let place = self.names.iter().position(|known| known == name);
        &self.columns[place.expect("a column of the machine")]
    }

    pub fn column_mut(&mut self, name: &str) -> &mut Vec<f64> {
        let place = self.names.iter().position(|known| known == name);
        &mut self.columns[place.expect("a column of the machine")]
    }

    /// The rows from one share of the log to another.
    pub fn span(mut self, from: f64, to: f64) -> Self {
        let rows = self.rows() as f64;
        let (from, to) = ((from * rows) as usize, (to * rows) as usize);
        for column in &mut self.columns {
            column.truncate(to);
            column.drain(..from);
        }
        self
    }

    /// The rows between two times.
    pub fn between(mut self, from: f64, to: f64) -> Self {
        let keep: Vec<bool> = self.columns[0]
            .iter()
            .map(|t| (from..to).contains(t))
            .collect();
        self.retain(|k| keep[k]);
        self
    }

    /// Of every `factor` rows (odd) the middle one, with the mean of the torques: what a slower
    /// recorder with a filter would have written.
    pub fn thinned(mut self, factor: usize, torques: &[String]) -> Self {
        let rows = self.rows() / factor;
        for (name, column) in self.names.iter().zip(&mut self.columns) {
            let mean = torques.contains(name);
            *column = (0..rows)
                .map(|k| match mean {
                    true => {
                        column[k * factor..(k + 1) * factor].iter().sum::<f64>() / factor as f64
                    }
                    false => column[k * factor + factor / 2],
                })
                .collect();
        }
        self
    }

    /// Keeps the rows for which `keep` is true.
    pub fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        for column in &mut self.columns {
            let mut row = 0..;
            column.retain(|_| keep(row.next().unwrap_or(0)));
        }
    }

    pub fn exchange(&mut self, a: &str, b: &str) {
        let place = |name: &str| self.names.iter().position(|known| known == name);
        let (a, b) = (place(a).expect("a column"), place(b).expect("a column"));
        self.columns.swap(a, b);
    }

    /// Writes it; times with `time`, which knows their unit.
    pub fn write(&self, path: &Path, time: impl Fn(f64) -> String) {
        let mut out = self.names.join(",");
        out.push('\n');
        for k in 0..self.rows() {
            out += &time(self.columns[0][k]);
            for column in &self.columns[1..] {
                let _ = write!(out, ",{}", column[k]);
            }
            out.push('\n');
        }
        std::fs::write(path, out).expect("a log is written");
    }
}

//! A run of consecutive log rows in SI units, the unit in which every reader hands out a log.

/// Consecutive rows of one log: times, positions, torques, velocities where the log has them.
///
/// Matrices are row-major, one row per sample. A reader reuses the block that it is given, so that
/// reading a log of any length allocates only once.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Block {
    /// Time of each row [s], strictly increasing within a log.
    pub t: Vec<f64>,
    /// Joint positions, k x n [m or rad]; actuator positions x_c1..x_c4 where the layout is raw.
    pub q: Vec<f64>,
    /// Joint torques, k x n [N or Nm]; volts u_1..u_4 where the layout is raw and not converted.
    pub tau: Vec<f64>,
    /// Logged joint velocities, k x n [m/s or rad/s], NaN where one was not measured; empty when the log has none.
    pub dq: Vec<f64>,
    /// Line (text logs) or message number of the first row, counted from 1.
    pub line0: u64,
}

impl Block {
    /// Rows that a reader puts into one block.
    pub const ROWS: usize = 4096;

    pub fn len(&self) -> usize {
        self.t.len()
    }

    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Number of position channels n; 0 in an empty block.
    pub fn joints(&self) -> usize {
        self.q.len().checked_div(self.t.len()).unwrap_or(0)
    }

    /// Empties the block and keeps its memory.
    pub fn clear(&mut self) {
        self.t.clear();
        self.q.clear();
        self.tau.clear();
        self.dq.clear();
        self.line0 = 0;
    }

    /// Keeps the rows of which `keep` says so by their times, asked in order.
    pub fn retain(&mut self, mut keep: impl FnMut(f64) -> bool) {
        let widths = self.widths();
        let mut kept = 0;
        for row in 0..self.len() {
            if !keep(self.t[row]) {
                continue;
            }
            if kept < row {
                self.t[kept] = self.t[row];
                let matrices = [&mut self.q, &mut self.tau, &mut self.dq];
                for (x, width) in matrices.into_iter().zip(widths) {
                    x.copy_within(row * width..(row + 1) * width, kept * width);
                }
            }
            kept += 1;
        }
        self.truncate(kept);
    }

    /// Keeps the first rows alone.
    pub fn truncate(&mut self, rows: usize) {
        let widths = self.widths();
        self.t.truncate(rows);
        self.q.truncate(rows * widths[0]);
        self.tau.truncate(rows * widths[1]);
        self.dq.truncate(rows * widths[2]);
    }

    /// Width of each matrix: positions, torques, velocities.
    fn widths(&self) -> [usize; 3] {
        [&self.q, &self.tau, &self.dq].map(|x| x.len().checked_div(self.len()).unwrap_or(0))
    }

    /// Whether torques and velocities of the last row are those of the row before it.
    pub fn repeats_beside_positions(&self) -> bool {
        let [_, tau, dq] = self.widths();
        let same = |x: &[f64], width: usize| {
            let Some(last) = x.len().checked_sub(width) else {
                return false;
            };
            // velocities that were not measured are NaN
            let alike = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
            last >= width && x[last - width..last].iter().zip(&x[last..]).all(alike)
        };
        self.len() > 1 && same(&self.tau, tau) && same(&self.dq, dq)
    }

    /// Removes `rows` rows right before the last one.
    pub fn remove_before_last(&mut self, rows: usize) {
        let end = self.len().saturating_sub(1);
        let from = end.saturating_sub(rows);
        let [q, tau, dq] = self.widths();
        self.t.drain(from..end);
        self.q.drain(from * q..end * q);
        self.tau.drain(from * tau..end * tau);
        self.dq.drain(from * dq..end * dq);
    }

    /// Takes the last `rows` rows of another block, into this one, which is empty.
    pub fn split_from(&mut self, other: &mut Self, rows: usize) {
        self.clear();
        let from = other.len().saturating_sub(rows);
        let [q, tau, dq] = other.widths();
        self.line0 = other.line0 + from as u64;
        self.t.extend(other.t.drain(from..));
        self.q.extend(other.q.drain(from * q..));
        self.tau.extend(other.tau.drain(from * tau..));
        self.dq.extend(other.dq.drain(from * dq..));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_are_kept_keep_their_own_numbers() {
        let mut block = Block {
            t: vec![0.0, 0.1, 0.2],
            q: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
            tau: vec![10.0, 20.0, 30.0, 40.0, 50.0, 60.0],
            ..Block::default()
        };
        block.retain(|t| t != 0.1);
        assert_eq!(block.t, [0.0, 0.2]);
        assert_eq!(block.q, [1.0, 2.0, 5.0, 6.0]);
        assert_eq!(block.tau, [10.0, 20.0, 50.0, 60.0]);
        assert!(block.dq.is_empty());
    }
}

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
    /// Logged joint velocities, k x n [m/s or rad/s]; empty when the log has none.
    pub dq: Vec<f64>,
    /// Line (text logs) or message number of the first row, counted from 1.
    pub line0: u64,
}

impl Block {
    /// Rows that a reader puts into one block.
    pub const ROWS: usize = 4096;

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether the block holds no row.
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
}

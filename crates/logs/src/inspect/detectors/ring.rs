//! The last numbers of a channel.

use std::ops::{Index, IndexMut};

const ROWS: usize = 64;

/// Numbers of the last 64 rows, by the numbers of the rows.
#[derive(Debug, Clone)]
pub(crate) struct RowRing([f64; ROWS]);

impl Default for RowRing {
    fn default() -> Self {
        Self([0.0; ROWS])
    }
}

impl Index<usize> for RowRing {
    type Output = f64;

    #[inline]
    fn index(&self, row: usize) -> &f64 {
        &self.0[row % ROWS]
    }
}

impl IndexMut<usize> for RowRing {
    #[inline]
    fn index_mut(&mut self, row: usize) -> &mut f64 {
        &mut self.0[row % ROWS]
    }
}

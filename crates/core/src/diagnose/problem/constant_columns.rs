//! Columns that no model changes, filtered once for all passes over the same rows.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use super::unknowns::Unknown;

/// Numbers that are kept at most, 128 MB: what comes later is made anew in each pass.
const MOST_NUMBERS: usize = 16 << 20;

/// Rows of the unknowns of a joint that no model changes.
pub type ConstantRows = Vec<(Unknown, Vec<f64>)>;

/// Filtered columns of inertial parameters and offsets, by window and joint.
#[derive(Debug, Default)]
pub struct ConstantColumns(Mutex<StoredColumns>);

/// Stretch, its rows, and the joint.
pub type WindowOfJoint = (usize, Range<usize>, usize);

#[derive(Debug, Default)]
struct StoredColumns {
    rows: HashMap<WindowOfJoint, Arc<ConstantRows>>,
    numbers: usize,
}

impl ConstantColumns {
    /// Those of a joint in a window, where all that are wanted are there.
    pub fn get(&self, window: &WindowOfJoint, wanted: &[Unknown]) -> Option<Arc<ConstantRows>> {
        let stored = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let rows = stored.rows.get(window)?;
        let there = |u: &Unknown| rows.iter().any(|(own, _)| own == u);
        wanted.iter().all(there).then(|| Arc::clone(rows))
    }

    /// Keeps those of a joint in a window, as long as there is room.
    pub fn put(&self, window: WindowOfJoint, rows: &Arc<ConstantRows>) {
        let mut stored = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let count = |rows: &Arc<ConstantRows>| rows.iter().map(|(_, x)| x.len()).sum::<usize>();
        let before = stored.rows.get(&window).map_or(0, count);
        let numbers = stored.numbers + count(rows) - before;
        if numbers <= MOST_NUMBERS {
            stored.numbers = numbers;
            stored.rows.insert(window, Arc::clone(rows));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_there_for_what_was_made_in_the_same_window_and_as_long_as_there_is_room() {
        let kept = ConstantColumns::default();
        let window = (0, 0..3, 1);
        let of = |unknown: Unknown, count: usize| (unknown, vec![1.0; count]);
        let rows = Arc::new(vec![of(Unknown::Theta(4), 3), of(Unknown::Offset(1), 3)]);
        kept.put(window.clone(), &rows);
        assert_eq!(kept.get(&window, &[Unknown::Theta(4)]), Some(rows.clone()));
        assert_eq!(kept.get(&window, &[Unknown::Theta(5)]), None);
        assert_eq!(kept.get(&(0, 0..4, 1), &[]), None);
        let large = Arc::new(vec![of(Unknown::Theta(4), MOST_NUMBERS)]);
        kept.put((1, 0..3, 1), &large);
        assert_eq!(kept.get(&(1, 0..3, 1), &[]), None);
        // what takes the place of others counts instead of them
        kept.put(window.clone(), &large);
        assert_eq!(kept.get(&window, &[]), Some(large));
    }
}

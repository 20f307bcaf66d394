//! What every log is made of, whatever the format of its files: rows, one after the other.

use super::time::RowTime;
use super::{Block, LogError};

/// A sentence that begins with a number, where that is not 0.
pub(super) fn counted(count: u64, text: &str) -> Option<String> {
    (count > 0).then(|| format!("{count} {text}"))
}

/// What becomes of a row, a field or a channel that cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RowStrictness {
    /// The log is refused, with the line.
    Refuse,
    /// It is recorded as a fault of the log, and reading goes on.
    Record,
}

pub(super) trait LogRows: Send {
    /// Names of the columns; none of rows that are read strictly and have times in seconds.
    fn names(&self) -> &[String] {
        &[]
    }

    /// What a column is called by the names in the messages, where its own name is a path.
    fn label(&self, _column: usize) -> Option<&str> {
        None
    }

    /// Goes on to the next row; its time, or `None` at the end.
    fn next(&mut self) -> Result<Option<RowTime>, LogError>;

    /// The number in a column of the current row as logged, NaN where there is none; `None` for words.
    fn logged(&self, _column: usize) -> Option<f64> {
        None
    }

    /// Refuses a field that is no number because it has a decimal comma.
    fn refuse_comma(&self, _column: usize) -> Result<(), LogError> {
        Ok(())
    }

    /// Appends the channels of the current row to the block, in SI units.
    fn append(&self, _: &mut Block) -> Result<(), LogError> {
        Ok(())
    }

    fn has_velocities(&self) -> bool {
        false
    }

    /// The time from which spans in seconds count, where that is not the first row's [s].
    fn begins(&self) -> Option<f64> {
        None
    }

    /// Says which column is the time, and how many seconds its unit has, where rows carry none.
    fn set_time(&mut self, _column: usize, _seconds: f64) {}

    /// Whether rows carry their own times, as those of recordings do.
    fn is_recording(&self) -> bool {
        true
    }

    /// Whether it takes the delay of the torques off itself.
    fn takes_delay(&self) -> bool {
        false
    }

    /// Whether the current row equals the one before it in all that the log holds of it.
    fn repeats(&self) -> bool {
        false
    }

    /// Line or message number of the current row, from 1.
    fn number(&self) -> u64 {
        0
    }

    /// Where the current row stands, for a message.
    fn place(&self) -> String {
        String::new()
    }

    /// What to do about a row that is not later than the one before, where nobody can mend it by hand.
    fn clock_remedy(&self) -> Option<String> {
        None
    }

    /// Rows that were passed over because they have more or fewer fields than the header.
    fn malformed(&self) -> u64 {
        0
    }

    /// What was left out or chosen on the way, once the last row is read.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// Times at which runs begin that one table holds, but for the first, once the last row is read.
    fn seams(&self) -> Vec<RowTime> {
        Vec::new()
    }

    /// SHA-256 of what holds the rows, where that is no file.
    fn sha256(&self) -> Option<&str> {
        None
    }

    /// Messages that contradict the others of their topic and are left out, with how many they are.
    fn contradictions(&self) -> Vec<(u64, String)> {
        Vec::new()
    }

    /// Arrays of messages that cannot be given to joints, once the last row is read.
    fn uneven(&self) -> Vec<(u64, String)> {
        Vec::new()
    }

    /// Where files break off, once the last row is read.
    fn breaks(&self) -> Vec<String> {
        Vec::new()
    }
}

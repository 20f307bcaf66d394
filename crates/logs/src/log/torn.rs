//! Rows of a stream that lost some of their bytes on the way: they are passed over and counted.

use super::rows::{LogRows, counted};
use super::time::RowTime;
use super::{Block, LogError};

/// Lines in a row that are passed over at most. Half: a row that an end of line cuts in two ends the stream; twice: a
/// stream of another form is refused later.
const MOST_LINES: u64 = 2;

/// The rows of a stream without those that are torn.
pub(super) struct WholeRows<R> {
    rows: R,
    /// Whether a whole row was read: the first one tells the form of the stream.
    begun: bool,
    torn: u64,
    /// Where the first one stood.
    first: Option<String>,
    scratch: Block,
}

impl<R: LogRows> WholeRows<R> {
    pub fn new(rows: R) -> Self {
        Self {
            rows,
            begun: false,
            torn: 0,
            first: None,
            scratch: Block::default(),
        }
    }

    /// The next line, if it is whole.
    fn line(&mut self) -> Result<Option<RowTime>, LogError> {
        let t = self.rows.next()?;
        if t.is_some() {
            self.scratch.clear();
            self.rows.append(&mut self.scratch)?;
        }
        Ok(t)
    }
}

impl<R: LogRows> LogRows for WholeRows<R> {
    fn names(&self) -> &[String] {
        self.rows.names()
    }

    fn label(&self, column: usize) -> Option<&str> {
        self.rows.label(column)
    }

    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        for _ in 0..MOST_LINES {
            match self.line() {
                Err(error) if self.begun && error.is_of_a_torn_row() => {
                    self.first.get_or_insert_with(|| error.to_string());
                    self.torn += 1;
                }
                line => {
                    self.begun = true;
                    return line;
                }
            }
        }
        self.line()
    }

    fn append(&self, block: &mut Block) -> Result<(), LogError> {
        self.rows.append(block)
    }

    fn logged(&self, column: usize) -> Option<f64> {
        self.rows.logged(column)
    }

    fn refuse_comma(&self, column: usize) -> Result<(), LogError> {
        self.rows.refuse_comma(column)
    }

    fn has_velocities(&self) -> bool {
        self.rows.has_velocities()
    }

    fn set_time(&mut self, column: usize, seconds: f64) {
        self.rows.set_time(column, seconds);
    }

    fn is_recording(&self) -> bool {
        self.rows.is_recording()
    }

    fn repeats(&self) -> bool {
        self.rows.repeats()
    }

    fn number(&self) -> u64 {
        self.rows.number()
    }

    fn place(&self) -> String {
        self.rows.place()
    }

    fn malformed(&self) -> u64 {
        self.rows.malformed()
    }

    fn warnings(&self) -> Vec<String> {
        let torn = counted(self.torn, "rows are torn and are passed over, the first at");
        let first = self.first.as_deref().unwrap_or_default();
        let torn = torn.map(|torn| format!("{torn} {first}"));
        self.rows.warnings().into_iter().chain(torn).collect()
    }

    fn seams(&self) -> Vec<RowTime> {
        self.rows.seams()
    }
}

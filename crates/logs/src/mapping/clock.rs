//! Which column of a log is the time: by its name, else by its numbers or dates, which run as those of a clock.

use super::content;
use super::error::MappingError;
use crate::inspect::is_time;
use crate::log::{LogError, RawBlock, RawReader, list};

/// Rows at the beginning by which a clock is recognised.
const SAMPLE: usize = 20_480;

/// The column of times of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockColumn {
    pub place: usize,
    /// Seconds per unit of it.
    pub seconds: f64,
    /// Anything but its name told that it is the time.
    pub guessed: bool,
}

impl ClockColumn {
    /// Finds the time of a log, which is read by it from now on.
    ///
    /// # Errors
    /// [`MappingError::NoTime`], or a file that can no longer be read.
    pub fn find(log: &mut RawReader) -> Result<Self, MappingError> {
        let named = position_of_time(log.names()).or(log.split_clock());
        let found = match named {
            Some(place) => Some(place),
            None => running(log)?,
        };
        let Some(place) = found else {
            return Err(MappingError::NoTime {
                log: log.log_name(),
                columns: list(log.names().iter().map(String::as_str)),
            });
        };
        let seconds = match log.stated_seconds(place) {
            Some(seconds) => seconds,
            None => log.set_time_by_numbers(place)?,
        };
        log.set_time(place, seconds);
        Ok(Self {
            place,
            seconds,
            guessed: named.is_none(),
        })
    }
}

/// Place of the first name that is one of times, behind what all names begin with: `log.t` beside `log.q`.
fn position_of_time(names: &[String]) -> Option<usize> {
    let place = names.iter().position(|name| is_time(name));
    let head = || {
        let (first, rest) = names.split_first().filter(|(_, rest)| !rest.is_empty())?;
        let same = |name: &String| {
            first
                .bytes()
                .zip(name.bytes())
                .take_while(|(a, b)| a == b)
                .count()
        };
        let same = rest.iter().map(same).min()?;
        let head = first.get(..same)?;
        // a word of its own: `tau_1` and `temperature` begin with no common one
        Some(head.rfind(['.', '/', '_', ':', ' '])? + 1)
    };
    place.or_else(|| {
        let head = head()?;
        names.iter().position(|name| is_time(&name[head..]))
    })
}

/// Place of the first column whose numbers run as times do, else of the first whose dates do.
fn running(log: &RawReader) -> Result<Option<usize>, LogError> {
    let names = log.names();
    let sample = sample(&mut log.again()?)?;
    // the index of a table: the one column that has no name
    let is_index = |place: usize| {
        let bare = |name: &String| name.starts_with('#') || name.starts_with("__index_level_");
        bare(&names[place]) && names.iter().filter(|name| bare(name)).count() == 1
    };
    let runs = |place: &usize| {
        let numbers = &sample.columns[*place];
        let index = is_index(*place) && content::rises(numbers) && !content::counts(numbers);
        content::is_clock(numbers) || index
    };
    if let Some(place) = (0..sample.columns.len()).find(runs) {
        return Ok(Some(place));
    }
    let empty = |place: &usize| sample.columns[*place].iter().all(|x| x.is_nan());
    for place in (0..sample.columns.len()).filter(empty) {
        let mut dated = log.again()?;
        dated.set_time(place, 1.0);
        let mut block = RawBlock::default();
        dated.read(&mut block)?;
        if content::rises(&block.t) {
            return Ok(Some(place));
        }
    }
    Ok(None)
}

/// The first rows of all columns.
pub(super) fn sample(log: &mut RawReader) -> Result<RawBlock, LogError> {
    let most = SAMPLE.min((1 << 22) / log.names().len().max(1));
    let mut out = RawBlock::default();
    out.columns.resize_with(log.names().len(), Vec::new);
    let mut block = RawBlock::default();
    while out.rows() < most && log.read(&mut block)? {
        block.drop_unusable();
        out.t.extend(&block.t);
        for (to, from) in out.columns.iter_mut().zip(&block.columns) {
            to.extend(from);
        }
    }
    Ok(out)
}

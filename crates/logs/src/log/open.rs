//! Opens a log by its format, and finds its channels.

use std::path::PathBuf;

use super::LogError;
use super::columns::choose;
use super::content::FileContent;
use super::delayed::DelayedRows;
use super::layout::Layout;
use super::messages::{
    JoinedTopics, JointStates, MessageRows, format_of, has_none, of_joints, of_topics,
};
use super::rows::{LogRows, RowStrictness};
use super::stream::HashedReader;
use super::table;
use super::text::TextRows;

/// The rows of a log that was opened, and what became known of it.
pub(super) struct OpenedRows {
    pub(super) rows: Box<dyn LogRows>,
    /// The layout that it turns out to have.
    pub(super) layout: Layout,
    /// What keeps a strict reader from it.
    pub(super) refused: Option<LogError>,
    /// The bytes of a text log.
    pub(super) bytes: Option<HashedReader>,
}

/// Opens files as one log of whatever format they have.
pub(super) fn open(
    files: &[PathBuf],
    layout: &Layout,
    strictness: RowStrictness,
) -> Result<OpenedRows, LogError> {
    let mut opened = opened(files, layout, strictness)?;
    let torques = !opened.layout.joints.is_empty() && !opened.layout.torques.is_empty();
    if let Some(delay_s) = layout.section.torque_delay_s
        && strictness == RowStrictness::Refuse
        && torques
        && !opened.rows.takes_delay()
    {
        let hold = opened.layout.zero_order_hold;
        opened.rows = Box::new(DelayedRows::new(opened.rows, delay_s, hold));
    }
    Ok(opened)
}

fn opened(
    files: &[PathBuf],
    layout: &Layout,
    strictness: RowStrictness,
) -> Result<OpenedRows, LogError> {
    if let [path, more @ ..] = files
        && (more.is_empty() || table::begins(path))
    {
        let content = FileContent::open_with(path, more)?;
        if format_of(content.head()).is_none() {
            let bytes = content.raw.clone();
            let (rows, layout, refused) = TextRows::open(path, content, layout, strictness)?;
            return Ok(OpenedRows {
                rows: Box::new(rows),
                layout,
                refused,
                bytes,
            });
        }
    }
    let recorded = |rows, layout, refused| OpenedRows {
        rows,
        layout,
        refused,
        bytes: None,
    };
    let mut refused = None;
    // Without a robot there are no channels to look for.
    if of_topics(layout) {
        let rows = JoinedTopics::of_robot(files, layout, false)?;
        return Ok(recorded(Box::new(rows), layout.clone(), None));
    }
    if !layout.joints.is_empty() {
        let error = match MessageRows::open(files, layout) {
            Ok((rows, layout)) => return Ok(recorded(Box::new(rows), layout, None)),
            Err(error) => error,
        };
        if let Ok(Some((rows, layout))) = of_joints(files, layout) {
            return Ok(recorded(Box::new(rows), layout, None));
        }
        match strictness {
            RowStrictness::Refuse => return Err(error),
            RowStrictness::Record => refused = Some(error),
        }
    }
    match JointStates::open(files, layout.section.topic.as_deref()) {
        Ok(states) => {
            let layout = choose(states.names(), layout);
            Ok(recorded(Box::new(states), layout, refused))
        }
        // any other messages are read by the paths of their numbers
        Err(error) if layout.joints.is_empty() => {
            let topic = layout.section.topic.as_deref();
            if topic.is_none() && !has_none(&error) {
                return Err(error);
            }
            match JoinedTopics::of_all(files, topic) {
                Ok(rows) => Ok(recorded(Box::new(rows), layout.clone(), None)),
                Err(other) => Err(if has_none(&error) { other } else { error }),
            }
        }
        Err(error) => Err(refused.unwrap_or(error)),
    }
}

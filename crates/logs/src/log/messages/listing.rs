//! What is in a recording: its topics, who publishes on them, how often, and the numbers in their messages.

use std::collections::BTreeSet;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::encoding::reader_of;
use super::message::FieldLeaf;
use super::parts::MessageFiles;
use crate::log::{LogError, escape};

/// Topics that are listed at most.
const TOPICS: usize = 1000;

/// A topic of a recording.
#[derive(Debug, Clone, Default, PartialEq, Serialize, JsonSchema)]
pub struct TopicFacts {
    /// Its name.
    pub name: String,
    /// Type of its messages.
    #[serde(rename = "type")]
    pub kind: String,
    /// Publishers that the recorder distinguished; 1 where it keeps no account of them.
    pub publishers: usize,
    /// Messages.
    pub messages: u64,
    /// Messages a second, by their times of recording \[Hz\]; null for fewer than two.
    pub rate_hz: Option<f64>,
    /// Paths of the numbers in its first message, as `position` and `torque` in `[log.joint]` take them.
    pub fields: Vec<String>,
    /// Why its messages cannot be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unreadable: Option<String>,
    #[serde(skip)]
    channels: BTreeSet<u16>,
    #[serde(skip)]
    times_ns: Option<(u64, u64)>,
}

/// The topics of a recording, those that are declared and have no message too.
pub(in crate::log) fn listing(paths: &[PathBuf]) -> Result<Vec<TopicFacts>, LogError> {
    let mut recording = MessageFiles::open(paths, Vec::new())?;
    let mut found: Vec<TopicFacts> = Vec::new();
    while let Some(message) = recording.next()? {
        let (topic, head) = (message.topic, message.head);
        let known = found.iter().position(|facts| facts.name == topic.name);
        let at = match known {
            Some(at) => at,
            None if found.len() >= TOPICS => continue,
            None => {
                let mut facts = TopicFacts::new(&topic.name, &topic.schema.name);
                match reader_of(&topic.schema, &[]) {
                    Ok(reader) => {
                        let leaves = reader.leaves(message.data);
                        facts.fields = leaves
                            .into_iter()
                            .map(|leaf: FieldLeaf| leaf.path)
                            .collect();
                    }
                    Err(reason) => facts.unreadable = Some(escape(&reason)),
                }
                found.push(facts);
                found.len() - 1
            }
        };
        let facts = &mut found[at];
        facts.messages += 1;
        facts.channels.insert(head.channel);
        let (first, _) = facts.times_ns.unwrap_or((head.log_ns, head.log_ns));
        facts.times_ns = Some((first, head.log_ns));
    }
    for facts in &mut found {
        facts.publishers = facts.channels.len().max(1);
        let duration = (facts.times_ns).map(|(first, last)| last.saturating_sub(first));
        let duration = duration.filter(|ns| *ns > 0 && facts.messages > 1);
        facts.rate_hz = duration.map(|ns| (facts.messages - 1) as f64 / (ns as f64 * 1e-9));
    }
    for topic in &recording.seen {
        if found.len() < TOPICS && !found.iter().any(|facts| facts.name == topic.name) {
            found.push(TopicFacts::new(&topic.name, &topic.schema.name));
        }
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(found)
}

impl TopicFacts {
    fn new(name: &str, kind: &str) -> Self {
        Self {
            name: name.to_owned(),
            kind: kind.to_owned(),
            publishers: 1,
            ..Self::default()
        }
    }
}

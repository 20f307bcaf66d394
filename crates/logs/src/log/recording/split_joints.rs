//! Joint states whose joints come in messages of their own: parts of one topic, each by its own clock, or a topic for
//! each joint.

use std::path::PathBuf;

use super::joined::JoinedTopics;
use super::state_topics::{ARRAYS, FoundTopic, survey};
use crate::log::LogError;
use crate::log::layout::Layout;

/// The rows of a robot each of whose joints is found on one topic alone; `None` where one is not.
pub(in crate::log) fn of_joints(
    paths: &[PathBuf],
    layout: &Layout,
) -> Result<Option<(JoinedTopics, Layout)>, LogError> {
    let found = survey(paths)?.found;
    let needed = [!layout.positions.is_empty(), !layout.torques.is_empty()];
    let topic_of = |joint: usize| -> Option<&FoundTopic> {
        let name = layout.name_in_messages(joint)?;
        let holds = |one: &&FoundTopic| {
            let mut filled = needed.iter().zip(one.arrays);
            one.topic.starts_with('/')
                && one.names.iter().any(|own| own == name)
                && filled.all(|(needed, filled)| filled || !needed)
        };
        let mut all = found.iter().filter(holds);
        all.next().filter(|_| all.next().is_none())
    };
    let topics: Option<Vec<&FoundTopic>> = (0..layout.joints.len()).map(topic_of).collect();
    // one message of one topic that holds them all is refused for another reason
    let several = |topics: &Vec<&FoundTopic>| {
        let [first, others @ ..] = &topics[..] else {
            return false;
        };
        first.most < first.names.len() || others.iter().any(|one| one.topic != first.topic)
    };
    let Some(topics) = topics.filter(several) else {
        return Ok(None);
    };
    let mut split = layout.clone();
    let kinds = [
        &mut split.positions,
        &mut split.torques,
        &mut split.velocities,
    ];
    for (channels, (array, _)) in kinds.into_iter().zip(ARRAYS) {
        for (joint, (channel, one)) in channels.iter_mut().zip(&topics).enumerate() {
            let name = layout.name_in_messages(joint).unwrap_or_default();
            channel.column = format!("{}:{array}[name={name}]", one.topic);
        }
    }
    if !topics.iter().all(|one| one.arrays[2]) {
        split.velocities.clear();
    }
    let rows = JoinedTopics::of_robot(paths, &split, true)?;
    Ok(Some((rows, split)))
}

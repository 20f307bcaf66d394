//! Which columns of a log become which topic of a recording.
//!
//! | columns | topic | array |
//! |---|---|---|
//! | `q_<joint>`, `dq_<joint>`, `tau_<joint>` | `/joint_states` | position, velocity, effort |
//! | `<kind>_<joint>` of every joint, e.g. `tau_hat_q1` | `/<kind>` | effort for torques, else position |
//! | all others | `/columns`, the names of columns for those of joints | position |

/// The arrays of a message with the states of joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StateArray {
    Position,
    Velocity,
    Effort,
}

/// A topic: names, and for each array the columns that it is filled from; none where it is empty.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TopicColumns {
    pub(super) name: String,
    pub(super) names: Vec<String>,
    pub(super) arrays: Vec<(StateArray, Vec<usize>)>,
}

pub(super) const JOINTS: &str = "/joint_states";
/// Topic of the columns that belong to no joint.
pub(super) const COLUMNS: &str = "/columns";

/// The topics of a log with these columns, of which the first is the time.
pub(super) fn topics(columns: &[String]) -> Vec<TopicColumns> {
    let joints = joints(columns);
    let mut left: Vec<usize> = (1..columns.len()).collect();
    let mut out = Vec::new();
    let mut kinds: Vec<&str> = Vec::new();
    for column in columns {
        for joint in &joints {
            if let Some(kind) = kind_of(column, joint)
                && !kinds.contains(&kind)
            {
                kinds.push(kind);
            }
        }
    }
    let mut take = |kind: &str| -> Option<Vec<usize>> {
        let find = |joint: &String| {
            let name = format!("{kind}_{joint}");
            left.iter().copied().find(|index| columns[*index] == name)
        };
        let found: Option<Vec<usize>> = joints.iter().map(find).collect();
        let found = found.filter(|found| !found.is_empty())?;
        left.retain(|index| !found.contains(index));
        Some(found)
    };
    let main = [
        ("q", StateArray::Position),
        ("dq", StateArray::Velocity),
        ("tau", StateArray::Effort),
    ];
    let arrays = main.map(|(kind, array)| Some((array, take(kind)?)));
    let arrays: Vec<_> = arrays.into_iter().flatten().collect();
    if !arrays.is_empty() {
        out.push(TopicColumns {
            name: JOINTS.to_owned(),
            names: joints.clone(),
            arrays,
        });
    }
    for kind in kinds {
        if matches!(kind, "q" | "dq" | "tau" | "columns" | "joint_states" | "t") {
            continue;
        }
        let Some(found) = take(kind) else { continue };
        let torques = ["tau", "residual", "band"];
        let array = match torques.iter().any(|begins| kind.starts_with(begins)) {
            true => StateArray::Effort,
            false => StateArray::Position,
        };
        out.push(TopicColumns {
            name: format!("/{kind}"),
            names: joints.clone(),
            arrays: vec![(array, found)],
        });
    }
    if !left.is_empty() {
        out.push(TopicColumns {
            name: COLUMNS.to_owned(),
            names: left.iter().map(|index| columns[*index].clone()).collect(),
            arrays: vec![(StateArray::Position, left)],
        });
    }
    out
}

/// What stands before `_<joint>` in a column's name, where that may be the name of a topic.
fn kind_of<'c>(column: &'c str, joint: &str) -> Option<&'c str> {
    let kind = column.strip_suffix(joint)?.strip_suffix('_')?;
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let begins = kind.starts_with(|c: char| c.is_ascii_alphabetic());
    (begins && kind.chars().all(plain)).then_some(kind)
}

/// The joints: those that have a position, else those that have a torque.
fn joints(columns: &[String]) -> Vec<String> {
    let with = |prefix: &str| -> Vec<String> {
        let names = columns.iter().skip(1);
        let names = names.filter_map(|column| column.strip_prefix(prefix));
        let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
        // `tau_hat_q1` is no torque of a joint `hat_q1` where there is a joint `q1`.
        let of_another = |name: &str| {
            let ends = |other: &&&str| name.strip_suffix(**other).is_some_and(|x| x.ends_with('_'));
            names.iter().any(|other| ends(&other))
        };
        let mut out: Vec<String> = Vec::new();
        for name in names.iter().filter(|name| !of_another(name)) {
            if !out.iter().any(|known| known == name) {
                out.push((*name).to_owned());
            }
        }
        out
    };
    match with("q_") {
        none if none.is_empty() => with("tau_"),
        joints => joints,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(columns: &str) -> Vec<TopicColumns> {
        let columns: Vec<String> = columns.split(',').map(str::to_owned).collect();
        topics(&columns)
    }

    #[test]
    fn joints_kinds_and_what_is_left_have_topics_of_their_own() {
        use StateArray::*;
        let topic = |name: &str, names: &[&str], arrays: &[(StateArray, &[usize])]| TopicColumns {
            name: name.to_owned(),
            names: names.iter().map(|n| (*n).to_owned()).collect(),
            arrays: arrays
                .iter()
                .map(|(array, k)| (*array, k.to_vec()))
                .collect(),
        };
        let found = of("t,q_a,q_b_c,tau_a,tau_b_c,dq_a,u_1,ddq_b_c,ddq_a,q_ref_a");
        let both: &[&str] = &["a", "b_c"];
        let states: [(StateArray, &[usize]); 2] = [(Position, &[1, 2]), (Effort, &[3, 4])];
        let left = ["dq_a", "u_1", "q_ref_a"];
        let expected = [
            topic("/joint_states", both, &states),
            topic("/ddq", both, &[(Position, &[8, 7])]),
            topic("/columns", &left, &[(Position, &[5, 6, 9])]),
        ];
        assert_eq!(found, expected);
        let residual = of(
            "t,tau_q1,tau_q2,tau_hat_q1,tau_hat_q2,residual_q1,residual_q2,band_lower_q1,band_lower_q2",
        );
        let topics = ["/joint_states", "/tau_hat", "/residual", "/band_lower"];
        assert_eq!(residual.len(), topics.len());
        for (found, name) in residual.iter().zip(topics) {
            assert_eq!((&*found.name, found.arrays[0].0), (name, Effort));
            assert_eq!(found.names, ["q1", "q2"]);
        }
        let other = of("time,Position,Iq");
        assert_eq!((other.len(), &*other[0].name), (1, "/columns"));
    }
}

//! Finds the channels of a layout among the columns of a header.

use super::LogError;
use super::layout::{Channel, Layout, column_number};
use super::names::{escape, list, nearest};
use super::section::TimeUnit;
use super::unit::{self, POSITIONS, TORQUES, UnitKind};
use cft_ident_core::number::significant;

/// Where a channel stands and how its numbers become SI.
#[derive(Debug, Clone, Copy)]
pub(super) struct ScaledColumn {
    pub(super) index: usize,
    pub(super) factor: f64,
    pub(super) offset: f64,
}

#[derive(Debug, Clone, Default)]
pub(super) struct ScaledColumns {
    pub(super) time: Option<ScaledColumn>,
    pub(super) positions: Vec<ScaledColumn>,
    pub(super) torques: Vec<ScaledColumn>,
    /// Empty where the log lacks a velocity.
    pub(super) velocities: Vec<ScaledColumn>,
}

pub(super) struct Header<'a> {
    pub(super) at: String,
    pub(super) names: &'a [String],
}

impl Header<'_> {
    pub(super) fn columns(&self, layout: &Layout) -> Result<ScaledColumns, LogError> {
        let each = |channels: &[Channel], what: &str, of: &[UnitKind]| {
            let found = channels.iter().enumerate().map(|(place, channel)| {
                let joint = layout.joints.get(layout.joint_of(place));
                let joint = joint.map_or("", String::as_str);
                let found = self.find(channel, &format!("{what} of {joint}"))?;
                Ok((channel, joint, found))
            });
            let found = found.collect::<Result<Vec<_>, LogError>>()?;
            // what stands in brackets and differs from joint to joint names them
            let stated: Vec<_> = (found.iter())
                .map(|(.., at)| name_and_unit(&self.names[at.index]).1)
                .collect();
            let alike = stated.len() < 2 || stated.windows(2).any(|pair| pair[0] == pair[1]);
            for (channel, joint, at) in &found {
                self.check_unit(channel, (joint, what), &self.names[at.index], (of, alike))?;
            }
            Ok::<_, LogError>(found.into_iter().map(|(.., at)| at).collect::<Vec<_>>())
        };
        let time = match layout.section.rate_hz {
            Some(_) => None,
            None => {
                let found = self.find(&of_one_column(self.names, &layout.time), "time")?;
                self.check_time(&layout.time, &self.names[found.index])?;
                Some(found)
            }
        };
        let of_positions = if layout.temperatures {
            &[][..]
        } else {
            &POSITIONS
        };
        let positions = each(&layout.positions, layout.what(), of_positions)?;
        let torques = each(&layout.torques, "torque", &TORQUES)?;
        // A velocity is optional unless the robot file names its column.
        let wanted = |c: &Channel| c.key.is_some() || position_of(self.names, c).is_some();
        let velocities = match layout.velocities.iter().all(wanted) {
            true => each(&layout.velocities, "velocity", of_positions),
            false => Ok(Vec::new()),
        };
        // nothing is fitted to velocities: those in another unit are none
        let velocities = match velocities {
            Err(LogError::Unit { .. } | LogError::UnknownUnit { .. }) => Vec::new(),
            found => found?,
        };
        Ok(ScaledColumns {
            time,
            positions,
            torques,
            velocities,
        })
    }

    fn find(&self, channel: &Channel, purpose: &str) -> Result<ScaledColumn, LogError> {
        let mut indices = positions_of(self.names, channel);
        let Some(index) = indices.next() else {
            return Err(self.missing(channel, purpose));
        };
        let more = indices.count();
        if more > 0 {
            return Err(LogError::RepeatedColumn {
                at: self.at.clone(),
                column: escape(&channel.column),
                count: more + 1,
            });
        }
        Ok(ScaledColumn {
            index,
            factor: channel.factor,
            offset: channel.offset,
        })
    }

    fn missing(&self, channel: &Channel, purpose: &str) -> LogError {
        let near = nearest(&channel.column, self.names.iter().map(String::as_str));
        let near = near.map(|name| format!("the nearest is `{}`\n", escape(name)));
        let key = match &channel.key {
            None => "the [log] section of the robot file".to_owned(),
            Some(key) => format!("`{key}` of the robot file"),
        };
        LogError::MissingColumn {
            at: self.at.clone(),
            column: escape(&channel.column),
            purpose: purpose.to_owned(),
            remedy: format!(
                "{}name the right column in {key}\nthe header has {}",
                near.unwrap_or_default(),
                list(self.names.iter().map(String::as_str))
            ),
        }
    }

    /// Refuses a header that states another unit than the one that the number is read in, or one that nobody knows.
    fn check_unit(
        &self,
        channel: &Channel,
        (joint, what): (&str, &str),
        name: &str,
        (of, alike): (&[UnitKind], bool),
    ) -> Result<(), LogError> {
        let Some(text) = unit_of(name).filter(|_| !of.is_empty()) else {
            return Ok(());
        };
        let place = format!("[log.joint.{}] of the robot file", escape(joint));
        let velocity = what == "velocity";
        let what = if velocity { "position" } else { what };
        let declared = unit::stated(&channel.unit, of);
        let Some(stated) = unit::stated(text, of) else {
            let label = !alike || is_label(text, joint) || !is_bracketed(name);
            if label || channel.unit_is_said || declared.is_none() {
                return Ok(());
            }
            return Err(LogError::UnknownUnit {
                at: self.at.clone(),
                column: escape(name),
                unit: escape(text),
                remedy: format!(
                    "write what one of it is in {place}: `{what}_scale = ..`, {} per {}; or the unit that it is, `{what}_unit = \"..\"`, of {}",
                    channel.unit,
                    escape(text),
                    list(unit::labels(of))
                ),
            });
        };
        let Some(declared) = declared else {
            return Ok(());
        };
        let same = stated.unit.label == declared.unit.label;
        // the scale of the robot file may be that of the units
        let ratio = stated.times * stated.unit.size / declared.unit.size;
        let scaled = (channel.scale / ratio - 1.0).abs() < 1e-3;
        let drives = matches!(stated.unit.of, UnitKind::Current | UnitKind::Share);
        let fits = match stated.times == 1.0 && same {
            true => velocity || !stated.rate,
            false if drives && stated.unit.of == declared.unit.of => {
                channel.scale != 1.0 && !scaled
            }
            false => stated.unit.of == declared.unit.of && scaled && channel.scale != 1.0,
        };
        if fits {
            return Ok(());
        }
        let lines = match stated.times {
            1.0 => format!("`{what}_unit = \"{}\"`", stated.unit.label),
            times => format!(
                "`{what}_unit = \"{}\"` and `{what}_scale = {}`",
                stated.unit.label,
                significant(times, 9)
            ),
        };
        Err(LogError::Unit {
            at: self.at.clone(),
            column: escape(name),
            found: stated.shown(),
            declared: declared.unit.label.to_owned(),
            remedy: format!("set {lines} in {place}, or correct the header"),
        })
    }

    /// The same of the time.
    fn check_time(&self, channel: &Channel, name: &str) -> Result<(), LogError> {
        let stated = |unit: &str| Some(TimeUnit::stated(unit)?.in_seconds().0);
        let units = unit_of(name).and_then(stated).zip(stated(&channel.unit));
        let Some((found, declared)) = units.filter(|(found, declared)| found != declared) else {
            return Ok(());
        };
        Err(LogError::Unit {
            at: self.at.clone(),
            column: escape(name),
            found: found.to_owned(),
            declared: declared.to_owned(),
            remedy: format!(
                "set `time_unit = \"{found}\"` in [log] of the robot file, or correct the header"
            ),
        })
    }
}

/// Words that say how something was measured, and no unit.
const DESCRIBING: &str = "\
    raw filtered filt filter measured meas act actual est estimated motor mot joint jnt link axis drive encoder enc \
    left right load side abs rel ist state value signal data in out sensor feedback fbk robot arm smooth";

/// Whether a text in brackets names a joint or says how something was measured: `[A1]`, `(filtered)`, `[elbow]`.
pub(crate) fn is_label(text: &str, joint: &str) -> bool {
    let parts = |text: &str| -> Vec<String> {
        let words = text.split(|c: char| !c.is_alphanumeric());
        words
            .filter(|w| !w.is_empty())
            .map(str::to_lowercase)
            .collect()
    };
    let (words, joint) = (parts(text), parts(joint));
    let numbered = |word: &str| word.ends_with(|c: char| c.is_ascii_digit());
    text.contains('=')
        || words.is_empty()
        || words.iter().any(|word| {
            let described = DESCRIBING.split_whitespace().any(|known| known == word);
            described || numbered(word) || joint.contains(word)
        })
}

fn is_bracketed(name: &str) -> bool {
    name_and_unit(name).1.is_some()
}

/// A clock of two columns, `sec+nanosec`, by the first of them; its name finds the other.
fn of_one_column(names: &[String], time: &Channel) -> Channel {
    let mut first = time.clone();
    if position_of(names, time).is_none()
        && let Some((seconds, _)) = time.column.split_once('+')
    {
        first.column = seconds.to_owned();
    }
    first
}

/// The place of a channel; of a clock of two columns that of the first.
pub(super) fn time_of(names: &[String], time: &Channel) -> Option<usize> {
    position_of(names, &of_one_column(names, time))
}

fn positions_of<'n>(names: &'n [String], channel: &'n Channel) -> impl Iterator<Item = usize> + 'n {
    let number = column_number(&channel.column);
    let is = move |(index, name): &(usize, &String)| match number {
        Some(number) => *index == number,
        None => **name == channel.column || name_and_unit(name).0 == channel.column,
    };
    names.iter().enumerate().filter(is).map(|(index, _)| index)
}

pub(super) fn position_of(names: &[String], channel: &Channel) -> Option<usize> {
    positions_of(names, channel).next()
}

/// The layout to use: the other one where the columns have channels of that alone.
pub(super) fn choose(names: &[String], layout: &Layout) -> Layout {
    let has_any = |layout: &Layout| {
        let mut channels = layout.positions.iter().chain(&layout.torques);
        channels.any(|channel| position_of(names, channel).is_some())
    };
    match &layout.otherwise {
        Some(other) if !has_any(layout) && has_any(other) => (**other).clone(),
        _ => layout.clone(),
    }
}

/// `q1 [deg]` and `q1 (deg)` are q1 in deg; `effort[2]` and `position[name=q1]` are places in messages.
pub(super) fn name_and_unit(name: &str) -> (&str, Option<&str>) {
    for (open, close) in [('[', ']'), ('(', ')')] {
        let head = name.strip_suffix(close);
        if let Some((base, unit)) = head.and_then(|head| head.rsplit_once(open)) {
            let digits = !unit.is_empty() && unit.bytes().all(|b| b.is_ascii_digit());
            let of_path = digits && !base.ends_with(' ');
            if of_path || unit.contains('=') {
                break;
            }
            return (base.trim_end(), Some(unit.trim()));
        }
    }
    (name, None)
}

/// The unit that a name states in brackets or as its ending.
pub fn unit_of(name: &str) -> Option<&str> {
    name_and_unit(name).1.or_else(|| suffix_unit(name))
}

/// `q1_deg` says that it is in deg.
fn suffix_unit(name: &str) -> Option<&str> {
    let unit = name.rsplit_once('_')?.1;
    ["deg", "degrees", "mm"].contains(&unit).then_some(unit)
}

/// Units of quantities that no channel is of.
const OTHERS: [&str; 13] = [
    "c", "°c", "degc", "k", "rpm", "hz", "w", "j", "bar", "pa", "date", "m/s^2", "utc",
];

pub(super) fn is_unit(text: &str) -> bool {
    let lower = text.to_lowercase();
    let any = || unit::stated(text, &POSITIONS).or_else(|| unit::stated(text, &TORQUES));
    TimeUnit::stated(text).is_some() || OTHERS.contains(&&*lower) || any().is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(header: &str, layout: &Layout) -> Result<ScaledColumns, LogError> {
        let names: Vec<String> = header.split(',').map(str::to_owned).collect();
        let header = Header {
            at: "a.csv:1".to_owned(),
            names: &names,
        };
        header.columns(layout)
    }

    #[test]
    fn columns_are_found_by_name_in_any_order_with_or_without_a_unit() {
        let layout = Layout::joint_columns(&["q1"]);
        let found = found("tau_q1 [Nm],extra,q_q1 (rad),t [s]", &layout).unwrap();
        let places = [found.time.unwrap(), found.positions[0], found.torques[0]];
        assert_eq!(places.map(|column| column.index), [3, 2, 0]);
        assert!(found.velocities.is_empty());
    }

    #[test]
    fn a_header_in_degrees_is_refused_where_radians_are_declared_and_taken_where_degrees_are() {
        let header = "t,q_q1 [deg],tau_q1";
        let mut layout = Layout::joint_columns(&["q1"]);
        layout.positions[0].unit = "rad".to_owned();
        let message = found(header, &layout).unwrap_err().to_string();
        for part in ["a.csv:1", "in deg", "\"deg\""] {
            assert!(message.contains(part), "{message}");
        }
        layout.positions[0].unit = "deg".to_owned();
        assert!(found(header, &layout).is_ok());
    }

    #[test]
    fn velocities_are_read_only_where_all_of_them_are_there() {
        let layout = Layout::joint_columns(&["a", "b"]);
        for (header, count) in [
            ("t,q_a,q_b,tau_a,tau_b,dq_a", 0),
            ("t,q_a,q_b,tau_a,tau_b,dq_a,dq_b", 2),
        ] {
            let found = found(header, &layout).unwrap();
            assert_eq!(found.velocities.len(), count, "{header}");
        }
    }
}

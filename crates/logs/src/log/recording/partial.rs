//! Messages of one instant and one topic that each hold some of the robot's joints, joined.

use super::fields::RobotFields;
use super::message::MessageHead;
use super::value::Value;

/// Fields of the last message that lacked some.
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    /// Its instant \[ns\]; none where nothing waits.
    instant: Option<i128>,
    values: Vec<Value>,
    waiting: u64,
}

impl Parts {
    /// Fills in what messages of the same instant held; how many of those this one makes whole.
    pub(super) fn join(
        &mut self,
        fields: &RobotFields,
        head: &MessageHead,
        values: &mut [Value],
    ) -> u64 {
        let channels = fields.channels();
        let absent = |values: &[Value]| values[channels.clone()].contains(&Value::Absent);
        if !absent(values) {
            self.instant = None;
            return 0;
        }
        let stamped = fields.header_ns(values).filter(|ns| *ns != 0);
        let instant = stamped.unwrap_or(i128::from(head.log_ns));
        if self.instant != Some(instant) {
            self.waiting = 0;
        } else {
            for (value, known) in values[channels.clone()].iter_mut().zip(&self.values) {
                if *value == Value::Absent {
                    *value = *known;
                }
            }
        }
        self.instant = Some(instant);
        self.values.clear();
        self.values.extend(&values[channels.clone()]);
        self.waiting += 1;
        match absent(values) {
            true => 0,
            false => std::mem::take(&mut self.waiting) - 1,
        }
    }
}

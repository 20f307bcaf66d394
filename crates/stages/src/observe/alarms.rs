//! Alarms: external torques beyond a threshold.

use schemars::JsonSchema;
use serde::Serialize;

use super::ExternalTorques;
use super::excesses::hold_s;
use cft_ident_files::config::held_out::HeldOut;

/// One joint of an alarm.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointOfAlarm {
    pub joint: String,
    /// External torque where it was greatest \[N or Nm\].
    pub external: f64,
    /// Its deviation where nothing touches the robot \[N or Nm\].
    pub std: f64,
}

/// External torques beyond the threshold, from the first to the last sample.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Alarm")]
pub struct TorqueAlarm {
    /// Time of the first sample beyond \[s\].
    pub from_s: f64,
    /// Time of the last \[s\].
    pub to_s: f64,
    /// Joints that were beyond.
    pub joints: Vec<JointOfAlarm>,
}

/// Finds alarms in external torques.
pub struct AlarmDetector<'a> {
    held: &'a [HeldOut],
    threshold: f64,
    hold_s: f64,
    std: Vec<f64>,
    open: Option<TorqueAlarm>,
    /// Samples so far, and those in which an alarm was on.
    samples: u64,
    beyond: u64,
}

impl<'a> AlarmDetector<'a> {
    /// Alarms beyond `threshold` times the 99 % torques of each joint.
    pub fn new(held: &'a [HeldOut], threshold: f64, cutoff_hz: f64) -> Self {
        Self {
            held,
            threshold,
            hold_s: hold_s(cutoff_hz),
            std: vec![0.0; held.len()],
            open: None,
            samples: 0,
            beyond: 0,
        }
    }

    /// Takes a sample; the alarm that it shows to be over.
    pub fn take(&mut self, o: &ExternalTorques) -> Option<TorqueAlarm> {
        let mut over = match &self.open {
            Some(open) if o.begins || o.t - open.to_s > self.hold_s => self.open.take(),
            _ => None,
        };
        self.samples += 1;
        let mut any = false;
        for (j, held) in self.held.iter().enumerate() {
            let (std, x) = (held.external_std(o.speed[j], o.variance[j]), o.external[j]);
            self.std[j] = std;
            if x.abs() <= self.threshold * std * held.external_99 {
                continue;
            }
            any = true;
            let open = self.open.get_or_insert_with(|| TorqueAlarm {
                from_s: o.t,
                to_s: o.t,
                joints: Vec::with_capacity(self.held.len()),
            });
            open.to_s = o.t;
            match open.joints.iter_mut().find(|of| of.joint == held.joint) {
                Some(of) if x.abs() / std <= of.external.abs() / of.std => {}
                Some(of) => (of.external, of.std) = (x, std),
                None => open.joints.push(JointOfAlarm {
                    joint: held.joint.clone(),
                    external: x,
                    std,
                }),
            }
        }
        self.beyond += u64::from(any);
        over.take()
    }

    /// Deviation of each joint's external torque at the last sample \[N or Nm\].
    pub fn std(&self) -> &[f64] {
        &self.std
    }

    /// The alarm that is on.
    pub fn open(&self) -> Option<&TorqueAlarm> {
        self.open.as_ref()
    }

    /// The alarm that the end of the input ends.
    pub fn end(&mut self) -> Option<TorqueAlarm> {
        self.open.take()
    }

    /// Samples so far, and those beyond the threshold.
    pub fn samples(&self) -> [u64; 2] {
        [self.samples, self.beyond]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_has_its_joints_size_begin_and_end_and_short_pauses_do_not_end_it() {
        let held = ["a", "b"].map(|joint| HeldOut {
            joint: joint.to_owned(),
            external_std: vec![0.5],
            external_99: 2.0,
            ..HeldOut::default()
        });
        let mut alarms = AlarmDetector::new(&held, 1.5, 10.0);
        let mut over = Vec::new();
        for k in 0..2000 {
            let t = f64::from(k) * 1e-3;
            // beyond 1.5 x 2 x 0.5 = 1.5: joint b from 0.5 to 0.6 s and from 0.7 to 0.8 s, a at 1.5 s
            let b = if (500..600).contains(&k) { 1.6 } else { 0.0 };
            let b = if (700..800).contains(&k) { -1.8 } else { b };
            let a = if k == 1500 { 1.51 } else { 1.4 };
            let zero = [0.0; 2];
            over.extend(alarms.take(&ExternalTorques {
                t,
                external: &[a, b],
                variance: &zero,
                speed: &zero,
                q: &zero,
                v: &zero,
                a: &zero,
                begins: k == 0,
            }));
        }
        over.extend(alarms.end());
        assert_eq!(over.len(), 2);
        assert_eq!((over[0].from_s, over[0].to_s), (0.5, 0.799));
        assert_eq!(over[0].joints.len(), 1);
        assert_eq!(over[0].joints[0].external, -1.8);
        assert_eq!(over[1].joints[0].joint, "a");
        assert_eq!(alarms.samples(), [2000, 201]);
        assert_eq!(alarms.std(), [0.5, 0.5]);
    }
}

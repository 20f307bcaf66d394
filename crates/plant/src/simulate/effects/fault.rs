//! Faults of the data: what is done to the log of a plant that knows nothing of it.

/// The joint channels of a log, row by row.
#[derive(Debug)]
pub struct LoggedChannels<'a> {
    /// Times of the rows \[s\].
    pub t: &'a [f64],
    /// Positions by the encoders, m or rad.
    pub q: &'a mut [f64],
    /// Torques, N or N m.
    pub torque: &'a mut [f64],
    /// Channels of a row.
    pub joints: usize,
}

/// A fault of the log.
pub struct Fault {
    /// Spoils the channels.
    pub(super) apply: Box<dyn Fn(&mut LoggedChannels) + Send>,
    /// Whether it lies between the motor and the noise of the torque, and not behind both.
    pub(super) before_noise: bool,
}

impl LoggedChannels<'_> {
    /// Torques of one joint.
    pub(super) fn torques(&mut self, joint: usize) -> impl Iterator<Item = &mut f64> {
        self.channel(joint, true).map(|(_, torque)| torque)
    }

    /// Times, and torques of one joint, or its positions.
    pub(super) fn channel(
        &mut self,
        joint: usize,
        torque: bool,
    ) -> impl Iterator<Item = (f64, &mut f64)> {
        let values = if torque {
            &mut *self.torque
        } else {
            &mut *self.q
        };
        let values = values.iter_mut().skip(joint).step_by(self.joints.max(1));
        self.t.iter().copied().zip(values)
    }
}

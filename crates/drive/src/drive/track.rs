//! What a log of a drive holds, as plain numbers: commanded and measured positions, joint by joint.

/// A log of one machine: one joint on a rig, or all joints of an arm or a leg.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveLog {
    /// File name, for people.
    pub name: String,
    /// Its place among the logs of its use, by which joints that are identified one by one are joined again.
    pub number: usize,
    /// What was moved: the trajectory's name. Logs of one motion and one set of gains are one block of the jackknife.
    pub motion: String,
    /// The gains and what else a held-out rule may ask for, by name: `kp`, `kd`, `mass`, `length`, `vin`.
    pub facts: Vec<(String, f64)>,
    /// Times of the samples [s], strictly increasing.
    pub t: Vec<f64>,
    /// How the command runs between samples.
    pub command_is: CommandIs,
    pub joints: Vec<JointTrack>,
    pub load: DriveLoad,
    /// What the file says wrongly, or does not say.
    pub findings: Vec<String>,
}

/// The command between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommandIs {
    /// Each value stands until the next: a log as it was sent.
    Held,
    /// Straight lines between the values: a file that was interpolated.
    Linear,
}

/// One joint along a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointTrack {
    pub joint: String,
    /// Commanded position [rad].
    pub command: Vec<f64>,
    /// Measured position [rad].
    pub position: Vec<f64>,
    /// Supply [V] by the rows; empty where it is not logged.
    pub supply: Vec<f64>,
    /// Whether the drive is on; empty where it always is.
    pub on: Vec<bool>,
    /// Proportional gain: counts of the firmware (volts drive) or N m/rad (torque drive).
    pub kp: f64,
    /// Gain of the speed: likewise, N m s/rad.
    pub kd: f64,
    /// Command or joint stands still all along: the log says nothing of it.
    pub rests: bool,
}

/// What the drive moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveLoad {
    /// A mass at the end of a rod, 0 is down.
    PendulumRig(PendulumRig),
    /// Nothing that is known: every torque is a ratio to the inertia.
    Unknown,
    /// The links of the robot that the log is read for.
    Robot,
}

/// A pendulum rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PendulumRig {
    /// Mass at the end [kg].
    pub mass: f64,
    /// Mass of the rod [kg].
    pub arm_mass: f64,
    /// Distance from the axis [m].
    pub length: f64,
}

/// Standard gravity [m/s^2].
const GRAVITY: f64 = 9.80665;

impl PendulumRig {
    /// Inertia about the axis [kg m^2]: point mass and slender rod.
    pub fn inertia(&self) -> f64 {
        (self.mass + self.arm_mass / 3.0) * self.length * self.length
    }

    /// Greatest torque of gravity [N m].
    pub fn gravity(&self) -> f64 {
        (self.mass + self.arm_mass / 2.0) * GRAVITY * self.length
    }
}

impl DriveLog {
    /// The block that the log belongs to: motion and gains.
    pub fn block(&self) -> (String, Vec<u64>) {
        let gains = self.joints.iter().flat_map(|j| [j.kp, j.kd]);
        (self.motion.clone(), gains.map(f64::to_bits).collect())
    }

    /// A fact by name.
    pub fn fact(&self, name: &str) -> Option<f64> {
        let found = self.facts.iter().find(|(known, _)| known == name);
        found.map(|(_, value)| *value)
    }

    pub fn duration(&self) -> f64 {
        self.t.last().unwrap_or(&0.0) - self.t.first().unwrap_or(&0.0)
    }
}

/// The middle of numbers.
pub fn median(mut x: Vec<f64>) -> f64 {
    if x.is_empty() {
        return 0.0;
    }
    let mid = x.len() / 2;
    *x.select_nth_unstable_by(mid, f64::total_cmp).1
}

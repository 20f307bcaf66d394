//! The law of a drive.
//!
//! ```text
//! volts drive:   tau_m = K V/V0 clip(kp (s - q') - kd v, +-d)       K = k kt V0/R
//! torque drive:  tau_m = clip(kp (s - q') - kd v, +-tau_max)
//! friction:      D v + (Fc + mu |tau_m| + Fs exp(-(v/vs)^2)) sgn(v)   D = kt^2/R + Fv while a volts drive is on, Fv else
//! command:       s follows q_cmd(t - Td), |ds/dt| <= 1/slowness;  q' = q - b
//! ```

/// How the firmware makes torque of an error of position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveLawKind {
    /// A voltage behind a resistance.
    Volts(ServoFirmware),
    /// A torque in N m: the log's gains are N m/rad and N m s/rad.
    Torque,
}

impl DriveLawKind {
    /// Whether the largest torque follows from what is declared.
    pub fn limit_is_declared(self) -> bool {
        match self {
            DriveLawKind::Volts(firmware) => firmware.gain.is_some() && firmware.duty_max.is_some(),
            DriveLawKind::Torque => false,
        }
    }
}

/// What is declared of the firmware of a volts drive.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ServoFirmware {
    /// Duty per radian and unit of kp.
    pub gain: Option<f64>,
    /// Largest duty.
    pub duty_max: Option<f64>,
}

/// The numbers of one joint.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JointLaw {
    /// Torque per radian and unit of kp at the reference supply [N m/rad]; 1 for a torque drive.
    pub stiffness: f64,
    /// D while the drive is on [N m s/rad].
    pub damping: f64,
    /// D while it is off [N m s/rad].
    pub viscous: f64,
    /// Fc [N m].
    pub coulomb: f64,
    /// Ja [kg m^2].
    pub armature: f64,
    /// 1/v_max of the set point [s/rad].
    pub slowness: f64,
    /// Largest torque of the drive [N m]; infinite without a limit.
    pub torque_max: f64,
    /// mu.
    pub load_friction: f64,
    /// Fs [N m] and vs [rad/s].
    pub stribeck: f64,
    pub stribeck_speed: f64,
    /// b [rad].
    pub bias: f64,
    /// c [N m].
    pub offset: f64,
}

/// The law of a whole machine.
#[derive(Debug, Clone, PartialEq)]
pub struct MachineLaw {
    pub joints: Vec<JointLaw>,
    /// The command comes so late [s].
    pub command_delay: f64,
    /// The controller acts on a state, and a command, that is so old [s].
    pub loop_delay: f64,
    /// Supply at which `stiffness` and `torque_max` hold [V]; none for a torque drive.
    pub supply: Option<f64>,
}

impl JointLaw {
    /// Largest friction that jumps at rest [N m], at a speed and a torque of the drive.
    #[inline]
    pub fn dry(&self, v: f64, tau: f64) -> f64 {
        let mut limit = self.coulomb + self.load_friction * tau.abs();
        if self.stribeck != 0.0 {
            let x = v / self.stribeck_speed;
            limit += self.stribeck * (-x * x).exp();
        }
        limit.max(0.0)
    }
}

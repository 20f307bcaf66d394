//! All that the observer in generated code is written from.

use cft_ident_core::robot::standard::STANDARD;

/// A cascade of second-order sections.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FilterCascade {
    /// b0, b1, b2, a1, a2 of each.
    pub sections: Vec<[f64; 5]>,
    /// Their states after a long constant input of 1.
    pub steady: Vec<[f64; 2]>,
    /// Samples after which it has forgotten its start.
    pub settle: usize,
}

/// Torques of the last samples, where the model's come late or early.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayRecipe {
    /// Samples by which the torque of each joint is late.
    pub by: Vec<f64>,
    /// Samples that are waited for.
    pub lead: usize,
    /// Samples that are kept.
    pub size: usize,
}

/// External torques of a joint that nothing touches.
#[derive(Debug, Clone, PartialEq)]
pub struct UntouchedTorques {
    /// Edges of ranges of speed [m/s or rad/s].
    pub speed_edges: Vec<f64>,
    /// Deviation in each range, that by the parameters aside \[N or Nm\].
    pub std: Vec<f64>,
    /// What 99 % stay within, in deviations.
    pub band: f64,
    /// The threshold of alarms, in deviations.
    pub limit: f64,
    /// Deviation of its friction at a standstill, where it is any torque up to its Coulomb level [N or Nm]; 0 of a law
    /// that does not jump there.
    pub standstill: f64,
}

/// Parameters whose torque is one deviation of the model's.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterDeviation {
    /// Standard parameters of each link.
    pub bodies: Vec<[f64; STANDARD]>,
    /// Drive inertia of each joint [kg or kg m^2].
    pub drives: Vec<f64>,
    /// Inertia, viscous and Coulomb part of each coupled gear train.
    pub couplings: Vec<[f64; 3]>,
    /// Parameters of every joint's friction, one joint after the other.
    pub friction: Vec<f64>,
    /// Constant torque of each joint [N or Nm].
    pub offset: Vec<f64>,
}

/// All that an observer is written from.
#[derive(Debug, Clone, PartialEq)]
pub struct ObserverRecipe {
    /// From row to row \[s\].
    pub step_s: f64,
    /// Time by which external torques are late \[s\].
    pub delay_s: f64,
    /// False alarms an hour.
    pub per_hour: f64,
    /// Of positions and torques; `settle` counts the rows before the first sample.
    pub position: FilterCascade,
    /// Of external torques, speeds and doubts of friction.
    pub smooth: FilterCascade,
    pub late: Option<DelayRecipe>,
    pub joints: Vec<UntouchedTorques>,
    /// Response of the position filter, within which the speed near a standstill is not known \[s\].
    pub reach_s: f64,
    /// Deviations of the model's torque by its parameters.
    pub uncertain: Vec<ParameterDeviation>,
}

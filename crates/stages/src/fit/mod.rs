//! Numbers by logs: friction, inertial parameters, torque per ampere, a load.

pub(crate) mod by_motion;
pub(crate) mod carried;
pub(crate) mod computed_torque;
pub(crate) mod consistent;
pub(crate) mod contact;
pub(crate) mod dynamics;
pub(crate) mod estimate;
pub(crate) mod friction;
pub(crate) mod gains;
pub(crate) mod geometry;
pub(crate) mod instrumental;
pub(crate) mod judged_estimate;
pub(crate) mod known_friction;
pub(crate) mod lsq;
pub(crate) mod lsq_notes;
pub(crate) mod lsq_problem;
pub(crate) mod motion_fit;
pub(crate) mod own_fit;
pub(crate) mod payload;
pub(crate) mod payload_result;
pub(crate) mod payload_rows;
pub(crate) mod prior;
pub(crate) mod replayed_torque;
mod touched;
pub(crate) mod weakest;
pub(crate) mod without_load;

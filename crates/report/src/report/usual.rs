//! Errors of published models, by which a reader judges an error.

use cft_ident_core::number;
use cft_ident_logs::log::TorqueIs;

/// How the torques of a published figure were measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TorqueMeasurement {
    /// Sensors at the joints.
    Sensors,
    /// Currents of the motors, or commands to them.
    Currents,
}

/// The torques over which an error is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorScope {
    /// Norm of the error of all joints over the norm of their torques.
    All,
    /// Root mean square of the errors of the joints.
    Joints,
}

/// A published relative error of torques.
#[derive(Debug, Clone, Copy)]
pub struct PublishedError {
    pub machine: &'static str,
    pub measured: TorqueMeasurement,
    pub over: ErrorScope,
    /// Error of the data that were fitted, as a fraction.
    pub fitted: Option<f64>,
    /// Error of other data, as a fraction.
    pub unseen: Option<f64>,
    pub source: &'static str,
}

/// The figures, one machine a row.
pub const PUBLISHED: [PublishedError; 6] = [
    PublishedError {
        machine: "Franka Emika Panda, seven joints",
        measured: TorqueMeasurement::Sensors,
        over: ErrorScope::All,
        fitted: Some(0.0141),
        unseen: None,
        source: "Gaz, Cognetti, Oliva, Robuffo Giordano and De Luca 2019, supplement",
    },
    PublishedError {
        machine: "Rokae xMate7p, seven joints",
        measured: TorqueMeasurement::Sensors,
        over: ErrorScope::All,
        fitted: Some(0.0250),
        unseen: Some(0.0319),
        source: "github.com/NKU-ZiXuan/xMate7p_dyn_ident, commit 7d8c9246, at 1 kHz",
    },
    PublishedError {
        machine: "EMPS, one axis",
        measured: TorqueMeasurement::Currents,
        over: ErrorScope::All,
        fitted: Some(0.040834),
        unseen: Some(0.059824),
        source: "Janot, Gautier and Brunot 2019, published with the logs",
    },
    PublishedError {
        machine: "Universal Robots UR10e, six joints",
        measured: TorqueMeasurement::Currents,
        over: ErrorScope::All,
        fitted: Some(0.0400),
        unseen: Some(0.0308),
        source: "github.com/shamilmamedov/dynamic_calibration, commit 11af40e7",
    },
    PublishedError {
        machine: "Staubli TX40, six joints",
        measured: TorqueMeasurement::Currents,
        over: ErrorScope::All,
        fitted: Some(0.073),
        unseen: None,
        source: "github.com/thanhndv212/figaroh-examples, commit c0b5c7f0",
    },
    PublishedError {
        machine: "Universal Robots UR10, six joints",
        measured: TorqueMeasurement::Currents,
        over: ErrorScope::Joints,
        fitted: None,
        unseen: Some(0.129),
        source: "weighted least squares on the log of github.com/unisa-acg/inverse-dynamics-solver: \
                 17, 6.8, 6.0, 12.6, 13.8 and 16.5 % by joint",
    },
];

/// Least and largest published error.
pub(super) fn range(measured: TorqueMeasurement) -> [f64; 2] {
    let rows = PUBLISHED.iter().filter(|row| row.measured == measured);
    let errors = rows.flat_map(|row| row.fitted.into_iter().chain(row.unseen));
    errors.fold([f64::INFINITY, 0.0], |[least, most], error| {
        [least.min(error), most.max(error)]
    })
}

/// Whether torques come from the motors; a log may not say it.
fn of_motors(torque_is: Option<TorqueIs>) -> bool {
    use TorqueIs::{Commanded, Current, Joint, Motor};
    match torque_is {
        Some(Motor | Current | Commanded) => true,
        Some(Joint) | None => false,
    }
}

/// Least and largest error that is usual where torques are these; of both kinds where they may be sensors'.
pub(super) fn band(torque_is: Option<TorqueIs>) -> [f64; 2] {
    let (currents, sensors) = (
        range(TorqueMeasurement::Currents),
        range(TorqueMeasurement::Sensors),
    );
    match of_motors(torque_is) {
        true => currents,
        false => [sensors[0].min(currents[0]), sensors[1].max(currents[1])],
    }
}

/// Errors that are usual, as a picture has them.
pub(crate) struct UsualErrors {
    /// Least and largest.
    pub band: [f64; 2],
    pub words: String,
}

fn percent(measured: TorqueMeasurement) -> String {
    let [least, most] = range(measured).map(|error| number::significant(100.0 * error, 2));
    format!("{least} to {most} %")
}

/// The band of a picture, with its kinds.
pub(super) fn drawn(torque_is: Option<TorqueIs>) -> UsualErrors {
    let [sensors, currents] =
        [TorqueMeasurement::Sensors, TorqueMeasurement::Currents].map(percent);
    UsualErrors {
        band: band(torque_is),
        words: match of_motors(torque_is) {
            true => format!("usual for motor currents: {currents}"),
            false => format!("usual: {sensors} (joint sensors), {currents} (motor currents)"),
        },
    }
}

/// How large errors usually are, as a figure: of both kinds where they may be sensors'.
pub(super) fn figure(torque_is: Option<TorqueIs>) -> String {
    let [least, most] = band(torque_is).map(|error| number::significant(100.0 * error, 2));
    format!("{least} to {most} %")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_figure_has_the_range_of_the_table() {
        assert_eq!(figure(Some(TorqueIs::Current)), "3.1 to 13 %");
        assert_eq!(figure(None), "1.4 to 13 %");
    }

    #[test]
    fn every_figure_has_a_source_and_is_a_fraction() {
        for row in &PUBLISHED {
            let known: Vec<f64> = row.fitted.into_iter().chain(row.unseen).collect();
            let fractions = known.iter().all(|error| (0.001..1.0).contains(error));
            let sound = fractions && !known.is_empty() && !row.source.is_empty();
            assert!(sound, "{}", row.machine);
        }
    }
}

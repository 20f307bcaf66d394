//! What `lsq` says of its estimators: on the command line, in its document, and to a person.

use clap::ValueEnum;
use clap::builder::PossibleValue;
use serde_json::{Value, json};

use crate::config::campaign::EstimatorKind;
use crate::identify::{Account, LoggedRobot};
use crate::inertia::instruments::ReferenceSource;
use crate::math::descent::Ending;
use crate::number;

impl ValueEnum for EstimatorKind {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Wls, Self::Ols, Self::Irls, Self::Iv, Self::Oe]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let help = match self {
            Self::Wls => "Rows weighted by each joint's noise, in two steps",
            Self::Ols => "All rows alike",
            Self::Irls => {
                "Rows with large residuals count less: Huber's loss, then Tukey's bisquare"
            }
            Self::Iv => {
                "Instrumental variables: the regressor along simulated positions, blind to their noise"
            }
            Self::Oe => "All parameters at once, the slopes of the friction law among them",
        };
        Some(PossibleValue::new(self.name()).help(help))
    }
}

/// The field `estimator` of the document.
pub fn json(account: &Account, machine: &LoggedRobot) -> Value {
    let names = machine.robot.joint_names();
    let mut out = json!({
        "name": account.estimator.name(),
        "law_refined": account.law_refined,
        "status": account.status,
        "iterations": account.iterations,
    });
    if let Some(down) = &account.down_weighted {
        let of = |(joint, (scale, share)): (&String, &(f64, f64))| json!({ "joint": joint, "scale": scale, "down_weighted": share });
        out["joints"] = names.iter().zip(down).map(of).collect();
    }
    if let Some(simulated) = &account.simulated {
        out["reference"] = match simulated.reference {
            ReferenceSource::Logged => json!("logged"),
            ReferenceSource::Smoothed => json!("smoothed"),
        };
        out["loop_frequency"] = json!(simulated.gains.frequency);
        out["failed_steps_share"] = json!(simulated.indefinite);
        let gains = simulated
            .gains
            .proportional
            .iter()
            .zip(&simulated.gains.derivative);
        let of = |(joint, (k, d)): (&String, (&f64, &f64))| json!({ "joint": joint, "proportional": k, "derivative": d });
        out["joints"] = names.iter().zip(gains).map(of).collect();
    }
    if let Some(before) = &account.before {
        let of = |(joint, error): (&String, &f64)| json!({ "joint": joint, "relative_error_before": error });
        out["joints"] = names.iter().zip(before).map(of).collect();
    }
    out
}

/// The same for a person; nothing for least squares.
pub fn text(account: &Account, machine: &LoggedRobot) -> String {
    let names = machine.robot.joint_names();
    let ended = match account.status {
        Ending::Converged => "converged",
        Ending::IterationLimit => "stopped at the limit of iterations",
        Ending::Diverged => "diverged",
    };
    let mut out = String::new();
    if account.iterations > 1 {
        out += &format!(
            "{}: {ended} after {} passes over the logs\n",
            account.estimator.name(),
            account.iterations
        );
    }
    if let Some(down) = &account.down_weighted {
        let each: Vec<String> = names
            .iter()
            .zip(down)
            .map(|(joint, (_, share))| format!("{joint} {}", number::percent(*share)))
            .collect();
        out += &format!("rows of less than half weight: {}\n", each.join(", "));
    }
    if let Some(simulated) = &account.simulated {
        let each: Vec<String> = names
            .iter()
            .enumerate()
            .filter_map(|(j, joint)| {
                let k = simulated.gains.proportional.get(j)?;
                let d = simulated.gains.derivative.get(j)?;
                Some(format!(
                    "{joint} {} and {}",
                    number::significant(*k, 3),
                    number::significant(*d, 3)
                ))
            })
            .collect();
        out += &format!(
            "simulated in closed loop at {} rad/s, gains on position and velocity: {}\n",
            number::significant(simulated.gains.frequency, 3),
            each.join(", ")
        );
    }
    if let Some(before) = &account.before {
        let each: Vec<String> = names
            .iter()
            .zip(before)
            .map(|(joint, error)| format!("{joint} {}", number::percent(*error)))
            .collect();
        out += &format!("residual before the refinement: {}\n", each.join(", "));
    }
    out
}

//! The result in sentences.

use super::result::{ToolNumber, ToolResult, ToolStep, ToolVerdict};
use super::touch::ToolTouch;
use cft_ident_core::number;

/// `1.174 (1.169 .. 1.179)`: digits as far as the interval goes; absent where nothing is known.
pub fn number_95(x: &ToolNumber, scale: f64) -> String {
    match (x.value, x.interval_95) {
        (Some(value), Some(ends)) => {
            let [low, high] = ends.map(|end| scale * end);
            let value = scale * value;
            // two digits of the half width
            let half = (high - low) / 2.0;
            let [value, low, high] = [value, low, high].map(|x| number::value_and_std(x, half).0);
            format!("{value} ({low} .. {high})")
        }
        _ => number::ABSENT.to_owned(),
    }
}

fn newton(x: f64) -> String {
    format!("{} N", number::significant(x, 3))
}

/// What an effect is, with its size.
pub fn step_in_words(step: &ToolStep, has_clock: bool) -> String {
    let size = step.size;
    let degrees = || format!("{} degrees", number::significant(size.to_degrees(), 2));
    let over = if has_clock {
        "time"
    } else {
        "the order of the poses"
    };
    match step.effect.as_str() {
        "bias-drift" => format!(
            "the bias drifts by {} along a polynomial of {over}, degree {}",
            newton(size),
            step.degree.unwrap_or_default()
        ),
        "taring" => format!(
            "the bias changes at once by {}{}: the sensor was tared, or struck",
            newton(size),
            match (step.begins, has_clock) {
                (Some(t), true) => format!(" at {} s", number::significant(t, 5)),
                (Some(row), false) => format!(" from row {} on", row + 1.0),
                (None, _) => String::new(),
            }
        ),
        "leaning-base" => format!("the base leans by {}", degrees()),
        "turned-sensor" => format!(
            "the sensor stands turned by {} against the frame whose orientation is logged",
            degrees()
        ),
        "gains" => format!(
            "gains and cross-talk of the force channels differ by up to {}",
            number::percent(size)
        ),
        _ => format!(
            "a force grows with the place of the sensor by {} N/m, as a cable's does",
            number::significant(size, 2)
        ),
    }
}

/// When something pushed the tool, and how much.
pub fn touch_in_words(touch: &ToolTouch, has_clock: bool) -> String {
    let [from, to] = touch.span;
    let when = match has_clock {
        true => format!(
            "from {} to {} s",
            number::significant(from, 4),
            number::significant(to, 4)
        ),
        false => format!("from row {} to {}", from + 1.0, to + 1.0),
    };
    let moment = match touch.at_origin {
        true => "the moment is as in other rows, so that it acts at the sensor's origin".to_owned(),
        false => format!("the moment by {} Nm", number::significant(touch.moment, 2)),
    };
    format!(
        "{when} the force is off by {}, {moment}: a touch? These {} rows are left out",
        newton(touch.force),
        touch.rows
    )
}

pub(super) fn verdict(of: &ToolResult) -> ToolVerdict {
    let mass = of.parameters.iter().find(|p| p.name == "mass");
    let errors = [of.before, of.after].map(|e| newton(e.holdout.force_error));
    let stands = of.steps.iter().any(|step| step.status == "confirmed");
    let error = match stands {
        true => format!(
            "Force error on poses left out {} by bias and weight alone, {} with what else was found.",
            errors[0], errors[1]
        ),
        false => format!("Force error on poses left out {}.", errors[0]),
    };
    match mass.filter(|p| p.value.is_some()) {
        None => ToolVerdict {
            kind: "bias-only",
            text: format!(
                "These poses are all alike: mass and centre are not determined, the course of the bias is. {error}"
            ),
        },
        Some(mass) => {
            let kind = match of.undetermined.is_empty() {
                true => "determined",
                false => "partly-determined",
            };
            let kilograms = number_95(mass, 1.0);
            let weight = number_95(&of.weight, 1.0);
            ToolVerdict {
                kind,
                text: format!("{kilograms} kg hangs on the sensor, {weight} N. {error}"),
            }
        }
    }
}

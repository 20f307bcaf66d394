//! What `diagnose` tells a person: the effects, their numbers, what is left, and the errors before and after.

use super::diagnose::in_words;
use super::typed;
use crate::diagnose::{Candidate, Diagnosis, Errors, SplitErrors};
use crate::effect::Added;
use crate::identify::{Diagnosed, LoggedRobot};
use crate::number;
use crate::report::table::{Align, Table, hanging};

/// Margin of what is said of an effect.
const MARGIN: &str = "     ";

/// The tables for a person.
pub fn text(machine: &LoggedRobot, found: &Diagnosed, name: &str) -> String {
    let d = &found.diagnosis;
    let robot = &machine.robot;
    let mut out = match found.verdict() {
        "effects-found" => format!("{name} lacks:\n"),
        "nothing-missing" => format!("{}\n", nothing_missing(d, &format!(" in {name}"))),
        _ if d.steps.is_empty() => {
            format!("{name} leaves a residual above the noise that no known effect explains.\n")
        }
        _ => hanging(
            "",
            &format!(
                "{name} leaves a residual above the noise that no known effect explains. What \
                 comes near to it was added, and lowers the error:"
            ),
            0,
        ),
    };
    for (i, step) in d.steps.iter().enumerate() {
        let effect: &Added = &d.model.effects[step.effect];
        let found = format!(
            "{} ({}): {}",
            effect.title(robot),
            effect.family().name(),
            in_words(machine, found, step.effect)
        );
        out += &hanging(&format!("{:>3}. ", i + 1), &found, 7);
        if let Some(s) = &step.candidate.score {
            let told = format!(
                "removes {} of the cross-validated squared error; BIC {:+.0} with {:.0} effective rows",
                number::percent(s.cv_gain),
                s.delta_bic,
                s.effective_rows
            );
            out += &hanging(MARGIN, &told, 7);
        }
        if let Some([before, after]) = step.holdout {
            let worse = if after > before {
                ": it worsens them"
            } else {
                ""
            };
            out += &format!(
                "{MARGIN}data that decided nothing: {} before, {} after{worse}\n",
                number::percent(before),
                number::percent(after)
            );
        }
        if !step.alternatives.is_empty() {
            let names: Vec<String> = step
                .alternatives
                .iter()
                .map(|c| c.effect.title(robot))
                .collect();
            let told = format!(
                "these data do not separate it from {}; {} would",
                names.join(", "),
                effect.law.entry.separate_by
            );
            out += &hanging(MARGIN, &told, 7);
            if let Some(command) = super::separate::command(effect, robot) {
                out += &format!("{MARGIN}such a motion:\n{}", typed::folded(&command, 7));
            }
        }
    }
    for told in doubts(machine, found) {
        out += &hanging("  ", &told, 4);
    }
    for e in &d.disturbances {
        let told = format!(
            "cut out: {:.2}..{:.2} s of {}, a disturbance on {} ({:.0} times the usual squared \
             residual)",
            e.from_s,
            e.to_s,
            found.logs[e.log],
            robot.joint_names()[e.joint],
            e.over
        );
        out += &hanging("  ", &told, 4);
    }
    let mut table = Table::new(&[
        ("joint", Align::Left),
        ("fitted", Align::Decimal),
        ("after", Align::Decimal),
        ("unseen", Align::Decimal),
        ("after", Align::Decimal),
        ("its 95 %", Align::Right),
        ("above noise", Align::Decimal),
    ])
    .caption("relative torque error [%] on fitted and on unseen data, before and after");
    let hundred = number::hundredths;
    let known = |e: Option<f64>| e.map_or(number::ABSENT.to_owned(), hundred);
    for (j, joint) in robot.joint_names().iter().enumerate() {
        let of = |errors: &Errors| errors.joints[j].relative_error;
        let unseen = |p: &SplitErrors| p.holdout.as_ref().map(of);
        let interval = d.after.holdout.as_ref().map(|e| {
            let [low, high] = e.joints[j].interval_95;
            format!("{}..{}", hundred(low), hundred(high))
        });
        table.row([
            joint.as_str(),
            &hundred(of(&d.before.train)),
            &hundred(of(&d.after.train)),
            &known(unseen(&d.before)),
            &known(unseen(&d.after)),
            interval.as_deref().unwrap_or(number::ABSENT),
            &hundred(d.unexplained[j].share),
        ]);
    }
    out += &format!("{table}");
    out
}

/// Nothing is missing, or nothing that matters: in the model called so.
pub fn nothing_missing(d: &Diagnosis, model: &str) -> String {
    match d.remainder().next() {
        None => format!("Nothing is missing{model}: what is left of the torque is noise."),
        Some(_) => format!("Nothing that matters is missing{model}."),
    }
}

/// Most candidates of a remainder that are named.
const NAMED: usize = 3;

/// Why what was found may stand in for something else, and what else is no chance; nothing where only noise
/// is left.
pub fn doubts(machine: &LoggedRobot, found: &Diagnosed) -> Vec<String> {
    let d = &found.diagnosis;
    let robot = &machine.robot;
    let open: Vec<String> = d
        .structured_joints()
        .map(|j| match d.unexplained[j].over_floor {
            Some(over) => format!("{} ({over:.1} times the noise)", robot.joint_names()[j]),
            None => robot.joint_names()[j].clone(),
        })
        .collect();
    let mut out = Vec::new();
    if !open.is_empty() && !d.steps.is_empty() {
        out.push(format!(
            "structure is left on {}: what was found lowers the error, and may stand in for what no \
             known effect explains",
            open.join(", ")
        ));
    }
    let mut remainder: Vec<&Candidate> = d.remainder().collect();
    let gain = |c: &Candidate| c.score.as_ref().map_or(0.0, |s| s.cv_gain);
    remainder.sort_by(|a, b| gain(b).total_cmp(&gain(a)));
    let mut names: Vec<String> = remainder
        .iter()
        .take(NAMED)
        .map(|c| c.effect.title(robot))
        .collect();
    if remainder.len() > NAMED {
        names.push(format!("and {} more", remainder.len() - NAMED));
    }
    if !names.is_empty() {
        let doubt = match d.steps.is_empty() {
            true => "",
            false => "; what was found may not be quite what is there",
        };
        out.push(format!(
            "not added, and still no chance: {}{doubt}",
            names.join(", ")
        ));
    }
    out
}

//! One card per effect that was added: the residual without it over the signal on which it depends,
//! the torque that it adds, and what it is worth.

use super::look::Look;
use crate::effect::{Added, AugmentedModel, Family};
use crate::motion::{MotionError, Stretch};
use crate::number;
use crate::report::Writer;
use crate::report::figure::EffectFigure;

/// The rows of one effect at one joint.
struct Card {
    joint: usize,
    /// Signal, residual without the effect, torque of the effect.
    rows: Vec<[f64; 3]>,
}

/// The cards of the effects of `model`, in the order `shown`, over the logs of `logs`, which are called `data`.
///
/// # Errors
/// Stretches that are too short for the filter.
pub fn cards(
    page: &mut Writer,
    look: &Look,
    model: &AugmentedModel,
    shown: impl Iterator<Item = (usize, String)>,
    (logs, data): (&[usize], &str),
) -> Result<(), MotionError> {
    for (at, said) in shown {
        let effect = &model.effects[at];
        let card = card(look, model, at, logs)?;
        let robot = &look.machine.robot;
        let title = effect.title(robot);
        let joint = &robot.joint_names()[card.joint];
        let unit = look.machine.file.torque_unit(card.joint);
        let rms = |of: fn(&[f64; 3]) -> f64| {
            let squares = card.rows.iter().map(|row| of(row).powi(2));
            let sum: f64 = squares.filter(|x| x.is_finite()).sum();
            let mean = (sum / card.rows.len().max(1) as f64).sqrt();
            format!("{} {unit}", number::significant(mean, 3))
        };
        let told = format!(
            "{title}: the residual of {joint} on {data} is {} rms without it and {} with it.",
            rms(|row| row[1]),
            rms(|row| row[1] - row[2])
        );
        let figure = EffectFigure {
            title,
            told: told.clone(),
            over: signal(look, effect, card.joint).0,
            unit: unit.to_owned(),
            rows: card.rows,
        };
        page.paragraph(&told);
        page.figure(&figure.svg());
        if !said.is_empty() {
            page.paragraph(&said);
        }
    }
    Ok(())
}

/// The rows of an effect: at its joint, or where it adds the most.
fn card(
    look: &Look,
    model: &AugmentedModel,
    at: usize,
    logs: &[usize],
) -> Result<Card, MotionError> {
    let effect = &model.effects[at];
    let mut without = model.clone();
    without.effects.remove(at);
    let joints = look.machine.robot.joint_names().len();
    let mut all: Vec<Vec<[f64; 3]>> = vec![Vec::new(); joints];
    let wanted = |stretch: &&Stretch| logs.contains(&stretch.log);
    for stretch in look.stretches.iter().filter(wanted) {
        let parallel = look.filters.of(stretch);
        let (full, bare) = (model.reconstruct(stretch), without.reconstruct(stretch));
        for (j, rows) in all.iter_mut().enumerate() {
            if !effect.place.touches(j) {
                continue;
            }
            let less = |x: &[f64], y: &[f64]| -> Vec<f64> {
                x.iter().zip(y).map(|(x, y)| x - y).collect()
            };
            let residual = less(&stretch.tau[j], &bare[j]);
            let shape = less(&full[j], &bare[j]);
            let filtered = parallel.run(&[&residual, &shape])?;
            let (_, values) = signal(look, effect, j);
            rows.extend((0..filtered[0].len()).map(|i| {
                let x = values(stretch, parallel.sample_of(i));
                [x, filtered[0][i], filtered[1][i]]
            }));
        }
    }
    let size = |rows: &Vec<[f64; 3]>| rows.iter().map(|row| row[2] * row[2]).sum::<f64>();
    let most = (0..joints).max_by(|a, b| size(&all[*a]).total_cmp(&size(&all[*b])));
    let joint = effect.place.joint().or(most).unwrap_or(0);
    Ok(Card {
        joint,
        rows: std::mem::take(&mut all[joint]),
    })
}

type Signal = Box<dyn Fn(&Stretch, usize) -> f64>;

/// The signal on which an effect depends, by its family: name, unit, and its value at a sample.
fn signal(look: &Look, effect: &Added, joint: usize) -> ((String, String), Signal) {
    let robot = &look.machine.robot;
    let name = |what: &str, j: usize| format!("{what} of {}", robot.joint_names()[j]);
    let unit = |j: usize| robot.joint_kind(j).position_unit();
    let other = effect.place.from().unwrap_or(joint);
    match effect.family() {
        Family::Position | Family::Memory => {
            let of: Signal = Box::new(move |s, k| s.q[joint][k]);
            ((name("position", joint), unit(joint).to_owned()), of)
        }
        Family::Velocity => {
            let of: Signal = Box::new(move |s, k| s.v[joint][k]);
            ((name("velocity", joint), format!("{}/s", unit(joint))), of)
        }
        Family::Cross => {
            let of: Signal = Box::new(move |s, k| s.v[other][k]);
            ((name("velocity", other), format!("{}/s", unit(other))), of)
        }
        Family::Load => {
            let of: Signal = Box::new(move |s, k| s.tau[joint][k]);
            let torque = look.machine.file.torque_unit(joint).to_owned();
            ((name("measured torque", joint), torque), of)
        }
        Family::Timing | Family::Inertia => {
            let of: Signal = Box::new(move |s, k| s.a[joint][k]);
            let unit = format!("{}/s\u{b2}", unit(joint));
            ((name("acceleration", joint), unit), of)
        }
        Family::Offset | Family::Slow | Family::Event | Family::Data | Family::Own => {
            let of: Signal = Box::new(|s, k| s.t[k]);
            (("time".to_owned(), "s".to_owned()), of)
        }
    }
}

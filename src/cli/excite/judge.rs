//! The judgement of a motion before the robot moves: as numbers, as tables, as a picture.

use serde_json::{Value, json};

use super::Bench;
use crate::cli::error::CliError;
use crate::excite::foresee::{Expected, Foresight, foresee, information};
use crate::excite::limits::{Channel, Quantity};
use crate::excite::motion::{spectrum, torque_band};
use crate::excite::usage::Use;
use crate::excite::{Given, Motion};
use crate::number;
use crate::report::figure::{MotionFigure, MotionPanel};
use crate::report::table::{Align, Table, hanging, unbroken};

/// Share of the torque's power that its band holds.
const BAND: f64 = 0.99;
/// Parts of the weakest direction that are told.
const PARTS: usize = 4;
/// Correlation of expected errors from which on two parameters count as confounded.
const ALIKE: f64 = 0.95;

/// What there is to say about a motion.
pub(super) struct Judged {
    pub foresight: Foresight,
    /// With what is given besides.
    pub together: Option<Foresight>,
    pub uses: Vec<Use>,
    /// Amplitudes of the speed per coordinate and harmonic; of a series alone.
    pub spectrum: Option<Vec<Vec<f64>>>,
    /// Frequency below which the torque's power lies, per joint \[Hz\]; of a series alone.
    pub band: Option<Vec<f64>>,
    seconds: f64,
    periods: Option<u32>,
    /// Of a one-joint move: what it tells about the joint's friction.
    pub friction: Option<Friction>,
    pub evaluations: Option<u64>,
    pub warnings: Vec<String>,
}

/// Expected deviations of a friction law.
pub(super) struct Friction {
    pub joint: String,
    pub expected: Vec<Expected>,
    /// Relative deviations from the usual ladder.
    pub usual: Option<Vec<Option<f64>>>,
}

/// Judges a motion by the channels given.
pub(super) fn judge(
    bench: &Bench,
    motion: &Motion,
    channels: &[Channel],
    given: Option<&Given>,
    friction: Option<Friction>,
) -> Result<Judged, CliError> {
    let machine = &bench.machine;
    let uses = motion.usage(machine, channels);
    let (information, rows) = information(machine, motion, bench.rate_hz, bench.args.seconds)?;
    let foresight = foresee(machine, &information, rows, None)?;
    let together = match given {
        Some(given) => {
            let weights: Vec<f64> = machine.noise.iter().map(|s| 1.0 / s).collect();
            let before = given.weighted(&weights);
            Some(foresee(machine, &information, rows, Some(&before))?)
        }
        None => None,
    };
    let (spectrum, band, periods) = match motion {
        Motion::Periodic { series, blend } => (
            Some(spectrum(series)),
            Some(torque_band(machine, series, BAND)?),
            blend.periods,
        ),
        Motion::Path { .. } => (None, None, None),
    };
    let mut warnings = Vec::new();
    // a one-joint move is not meant to tell the inertias apart
    let whole = friction.is_none();
    if let Some(pair) = &foresight.confounded
        && pair.correlation.abs() > ALIKE
        && whole
    {
        warnings.push(format!(
            "this motion hardly tells {} from {}: their errors correlate by {:.3}",
            pair.first, pair.second, pair.correlation
        ));
    }
    if whole && foresight.rank < machine.unknowns() {
        warnings.push(format!(
            "this motion excites {} of {} directions of the parameters",
            foresight.rank,
            machine.unknowns()
        ));
    }
    Ok(Judged {
        foresight,
        together,
        uses,
        spectrum,
        band,
        seconds: motion.seconds(),
        periods,
        friction,
        evaluations: None,
        warnings,
    })
}

impl Judged {
    /// One sentence for each limit that the motion breaks.
    pub fn broken(&self) -> Vec<String> {
        let beyond = self.uses.iter().filter(|u| u.share > 1.0);
        beyond
            .map(|u| {
                let channel = &u.channel;
                let what = format!("{} of {}", channel.quantity.name(), channel.name);
                let unit = match channel.unit.as_str() {
                    "" => String::new(),
                    unit => format!(" {unit}"),
                };
                if u.share.is_infinite() && !u.range[1].is_finite() {
                    return format!(
                        "the robot cannot follow at t = {:.4} s, where {what} would be needed",
                        u.t
                    );
                }
                let value = |v: f64| number::significant(v, 5);
                let allowed = if channel.upper.is_finite() {
                    format!("[{}, {}]", value(channel.lower), value(channel.upper))
                } else {
                    format!("at least {}", value(channel.lower))
                };
                format!(
                    "{what} runs from {} to {}{unit}, allowed is {allowed}; farthest at t = {:.4} s",
                    value(u.range[0]),
                    value(u.range[1]),
                    u.t
                )
            })
            .collect()
    }

    /// A design that breaks a limit is never written.
    pub fn refuse_broken(&self) -> Result<(), CliError> {
        match self.broken().into_iter().next() {
            None => Ok(()),
            Some(first) => Err(CliError::input(format!(
                "the motion found breaks a limit, nothing was written: {first}"
            ))
            .hint("leave more of the limits free with --margin")),
        }
    }

    /// The comment at the head of the trajectory file.
    pub fn head(&self, bench: &Bench) -> String {
        let version = env!("CARGO_PKG_VERSION");
        if let Some(friction) = &self.friction {
            return format!(
                "One-joint experiment for the friction of {}, designed by cft-ident {version} for {} s.",
                friction.joint,
                number::significant(self.seconds, 4)
            );
        }
        let shown = |value: Option<f64>| value.map_or("-".into(), |v| number::significant(v, 4));
        let condition = &self.foresight.condition;
        format!(
            "Excitation trajectory, designed by cft-ident {version} (criterion {}, seed {}).\n\
             Condition number of the regressor along the period: {} raw, {} with its columns scaled.\n\
             x_i(t) = offset + sum over l of a_l/(l w) sin(l w t) - b_l/(l w) cos(l w t), w = 2 pi fundamental_hz.",
            criterion_name(bench),
            bench.args.seed,
            shown(condition.raw),
            shown(condition.normalised)
        )
    }

    /// The JSON fields of the command.
    pub fn json(&self, bench: &Bench) -> Value {
        let machine = &bench.machine;
        let names = machine.coordinate_names();
        let joints = machine.model.robot.joint_names();
        let share = |quantity: Quantity, i: usize| {
            let mut all = self.uses.iter();
            all.find(|u| u.channel.quantity == quantity && u.channel.index == i)
                .map(|u| u.share)
        };
        let used: Vec<Value> = names
            .iter()
            .enumerate()
            .map(|(i, name)| {
                json!({
                    "coordinate": name,
                    "position": share(Quantity::Position, i),
                    "speed": share(Quantity::Speed, i),
                    "acceleration": share(Quantity::Acceleration, i),
                    "volts": share(Quantity::Drive, i),
                })
            })
            .collect();
        let limits: Vec<Value> = self
            .uses
            .iter()
            .map(|u| {
                let c = &u.channel;
                json!({
                    "name": c.name, "quantity": c.quantity, "unit": c.unit,
                    "lower": c.lower, "upper": c.upper,
                    "least": u.range[0], "most": u.range[1],
                    "used": u.share, "t": u.t, "broken": u.share > 1.0,
                })
            })
            .collect();
        let spectrum = self.spectrum.as_ref().map(|rows| {
            let rows = names.iter().zip(rows);
            let row = |(name, row): (&String, &Vec<f64>)| {
                json!({"coordinate": name, "speed_amplitudes": row})
            };
            rows.map(row).collect::<Vec<Value>>()
        });
        let band = self.band.as_ref().map(|band| {
            let rows = joints.iter().zip(band);
            let row = |(joint, hz): (&String, &f64)| {
                json!({"joint": joint, "torque_power_99_below_hz": hz})
            };
            rows.map(row).collect::<Vec<Value>>()
        });
        let noise: Vec<Value> = joints
            .iter()
            .zip(&machine.noise)
            .map(|(joint, std)| json!({"joint": joint, "torque_std": std}))
            .collect();
        let f = &self.foresight;
        json!({
            "condition": f.condition,
            "log_det": f.log_det,
            "rank": f.rank,
            "samples_per_period": f.samples,
            "limits_used": used,
            "limits": limits,
            "parameters": f.parameters,
            "weakest_direction": f.weakest_direction,
            "confounded": f.confounded,
            "together": self.together.as_ref().map(|t| json!({
                "parameters": t.parameters, "confounded": t.confounded,
            })),
            "friction": self.friction.as_ref().map(|f| json!({
                "joint": f.joint, "parameters": f.expected, "usual_relative_std": f.usual,
            })),
            "noise": noise,
            "rows": f.rows,
            "rate_hz": bench.rate_hz,
            "spectrum": spectrum,
            "band": band,
            "seconds": self.seconds,
            "periods": self.periods,
            "criterion": criterion_name(bench),
            "seed": bench.args.seed,
            "evaluations": self.evaluations,
        })
    }

    /// Tables for a person.
    pub fn text(&self, bench: &Bench, name: &str) -> String {
        let mut text = self.limits_table(bench, name).to_string();
        text.push('\n');
        if let Some(friction) = &self.friction {
            text += &friction.table(self.foresight.rows).to_string();
            return text;
        }
        text += &self.parameters_table().to_string();
        text.push('\n');
        let f = &self.foresight;
        let parts: Vec<String> = f
            .weakest_direction
            .iter()
            .take(PARTS)
            .map(|part| format!("{:+.2} {}", part.weight, part.parameter))
            .collect();
        text += &format!("weakest direction: {}\n", parts.join(" "));
        if let Some(pair) = &f.confounded {
            text += &format!(
                "errors most alike: {} and {}, correlation {:.2}\n",
                pair.first, pair.second, pair.correlation
            );
        }
        if let Some(band) = &self.band {
            let joints = bench.machine.model.robot.joint_names();
            let bands: Vec<String> = joints
                .iter()
                .zip(band)
                .map(|(joint, hz)| unbroken(&format!("{joint} {} Hz", number::significant(*hz, 2))))
                .collect();
            let told = format!(
                "99 % of the torque's power lies below: {}",
                bands.join(", ")
            );
            text += &hanging("", &told, 2);
        }
        text
    }

    pub fn limits_table(&self, bench: &Bench, name: &str) -> Table {
        let shown = |value: Option<f64>, digits| {
            value.map_or(number::ABSENT.into(), |v| number::significant(v, digits))
        };
        let condition = &self.foresight.condition;
        let periods = match self.periods {
            Some(periods) => format!(", {periods} periods"),
            None => String::new(),
        };
        let caption = format!(
            "{name}: condition {} ({} with columns scaled), {} s{periods}",
            shown(condition.raw, 4),
            shown(condition.normalised, 4),
            number::significant(self.seconds, 4),
        );
        let mut table = Table::new(&[
            ("limit", Align::Left),
            ("from", Align::Decimal),
            ("to", Align::Decimal),
            ("allowed", Align::Left),
            ("unit", Align::Left),
            ("used", Align::Decimal),
        ])
        .caption(&caption);
        for u in &self.uses {
            let c = &u.channel;
            let quantity = match c.quantity {
                Quantity::Drive if bench.machine.drive_unit(c.index) != "V" => "torque",
                quantity => quantity.name(),
            };
            let value = |v: f64| number::significant(v, 4);
            let allowed = if c.upper.is_finite() {
                format!("{} .. {}", value(c.lower), value(c.upper))
            } else {
                format!("{} ..", value(c.lower))
            };
            let mark = if u.share > 1.0 { "  BROKEN" } else { "" };
            table.row([
                &format!("{} {quantity}", c.name),
                &value(u.range[0]),
                &value(u.range[1]),
                &allowed,
                &c.unit,
                &format!("{}{mark}", number::percent(u.share)),
            ]);
        }
        table
    }

    pub fn parameters_table(&self) -> Table {
        let rows = self.foresight.rows;
        let caption = format!(
            "expected from {} samples, friction known:",
            number::significant(rows, 5)
        );
        let mut columns = vec![
            ("parameter", Align::Left),
            ("value", Align::Decimal),
            ("std", Align::Decimal),
            ("relative", Align::Decimal),
            ("unit", Align::Left),
        ];
        if self.together.is_some() {
            columns.insert(4, ("with given", Align::Decimal));
        }
        let mut table = Table::new(&columns).caption(&caption);
        for (k, p) in self.foresight.parameters.iter().enumerate() {
            let relative = |std: Option<f64>| std.map_or(number::ABSENT.into(), number::percent);
            let mut row = vec![
                p.name.clone(),
                number::significant(p.value, 5),
                p.std
                    .map_or(number::ABSENT.into(), |s| number::significant(s, 2)),
                relative(p.relative_std),
            ];
            if let Some(together) = &self.together {
                row.push(relative(together.parameters[k].relative_std));
            }
            row.push(p.unit.clone());
            table.row(row);
        }
        table
    }
}

impl Friction {
    pub fn table(&self, rows: f64) -> Table {
        let caption = format!(
            "friction of {} expected from {} samples:",
            self.joint,
            number::significant(rows, 5)
        );
        let mut columns = vec![
            ("parameter", Align::Left),
            ("value", Align::Decimal),
            ("std", Align::Decimal),
            ("relative", Align::Decimal),
            ("unit", Align::Left),
        ];
        if self.usual.is_some() {
            columns.insert(4, ("usual ladder", Align::Decimal));
        }
        let relative = |std: Option<f64>| std.map_or(number::ABSENT.into(), number::percent);
        let mut table = Table::new(&columns).caption(&caption);
        for (k, p) in self.expected.iter().enumerate() {
            let std = p.std.map(|s| number::significant(s, 2));
            let mut row = vec![
                p.name.clone(),
                number::significant(p.value, 5),
                std.unwrap_or(number::ABSENT.into()),
                relative(p.relative_std),
            ];
            if let Some(usual) = &self.usual {
                row.push(relative(usual.get(k).copied().flatten()));
            }
            row.push(p.unit.clone());
            table.row(row);
        }
        table
    }
}

fn criterion_name(bench: &Bench) -> String {
    use clap::ValueEnum;
    let value = bench.args.criterion.to_possible_value();
    value.map_or(String::new(), |value| value.get_name().to_owned())
}

/// Samples of a line of the picture.
const POINTS: usize = 1500;

/// The picture of a motion.
pub(super) fn figure(bench: &Bench, motion: &Motion, judged: &Judged, title: &str) -> MotionFigure {
    let machine = &bench.machine;
    let seconds = motion.seconds();
    let t: Vec<f64> = (0..=POINTS)
        .map(|k| seconds * k as f64 / POINTS as f64)
        .collect();
    let states: Vec<_> = t
        .iter()
        .map(|t| machine.state(&motion.at(*t)).ok())
        .collect();
    let names = machine.coordinate_names();
    let panel = |quantity: Quantity, i: usize, unit: String| {
        let found = judged
            .uses
            .iter()
            .find(|u| u.channel.quantity == quantity && u.channel.index == i);
        let of = Channel::symmetric(quantity, i, "", "", 1.0);
        let value = |state| machine.quantity(&of, state);
        MotionPanel {
            quantity: match quantity {
                Quantity::Drive if unit != "V" => "torque".into(),
                quantity => quantity.name().into(),
            },
            unit,
            values: states
                .iter()
                .map(|state| state.as_ref().map_or(f64::NAN, value))
                .collect(),
            limits: found
                .map(|u| [u.channel.lower, u.channel.upper])
                .filter(|[lower, upper]| lower.is_finite() && upper.is_finite()),
            used: found.map(|u| u.share).filter(|share| share.is_finite()),
        }
    };
    let rows = names
        .into_iter()
        .enumerate()
        .map(|(i, name)| {
            let unit = machine.coordinate_unit(i);
            let panels = vec![
                panel(Quantity::Position, i, unit.to_owned()),
                panel(Quantity::Speed, i, format!("{unit}/s")),
                panel(Quantity::Drive, i, machine.drive_unit(i).to_owned()),
            ];
            (name, panels)
        })
        .collect();
    MotionFigure {
        title: title.to_owned(),
        t,
        rows,
    }
}

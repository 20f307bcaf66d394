//! Parameters with their standard deviations and verdicts.

use std::collections::BTreeMap;

use crate::report::Writer;
use crate::report::figure::{IntervalFigure, IntervalRow};
use crate::report::table::{CellAlignment, Columns, Table};
use crate::report::words::{first_of, of_joint};
use cft_ident_core::number;
use cft_ident_core::robot::standard::STANDARD;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Parameter;

/// Half of a 95 % interval in standard deviations.
const INTERVAL_95: f64 = 1.96;

/// The true value of a parameter, where it is known.
type TrueValue<'a> = &'a dyn Fn(&Parameter) -> Option<f64>;

fn is_open(p: &Parameter) -> bool {
    p.verdict == Some(Verdict::NotIdentifiable)
}

/// How many parameters have which verdict, in words, and whether all are identified or negligible.
pub fn tally(model: &ModelFile) -> (String, bool) {
    let parameters = model.estimated_parameters();
    let rated = || parameters.iter().filter(|p| p.verdict.is_some());
    let negligible = rated().filter(|p| p.is_negligible()).count();
    let count = |wanted| rated().filter(|p| p.verdict == Some(wanted)).count();
    let mut words = vec![format!(
        "{} of {} parameters are identified",
        count(Verdict::Identified) - negligible,
        rated().count()
    )];
    let others = [
        (Verdict::Weak, "weak"),
        (Verdict::LowerBound, "known to one side only"),
        (Verdict::NotIdentifiable, "not determined by these data"),
    ];
    let others = others.map(|(verdict, word)| (count(verdict), word));
    let there = others.iter().filter(|(count, _)| *count > 0);
    words.extend(there.map(|(count, word)| format!("{count} {word}")));
    let negative = rated().filter(|p| !is_open(p) && p.is_below_zero());
    let negative = negative.map(|p| match &p.joint {
        Some(joint) => format!("{} of {joint}", p.name),
        None => p.name.clone(),
    });
    let negative: Vec<String> = negative.collect();
    if !negative.is_empty() {
        words[0] += &format!(
            " ({} of the known negative, which no machine has: {})",
            negative.len(),
            first_of(&negative)
        );
    }
    let good = words.len() == 1 && negative.is_empty();
    if negligible > 0 {
        words.insert(1, format!("{negligible} negligible"));
    }
    (words.join(", "), good)
}

/// How many standard deviations a value is off its truth, where both are known.
fn off(value: f64, truth: Option<f64>, std: f64) -> Option<String> {
    let off = (value - truth?) / std;
    off.is_finite().then(|| format!("{off:+.1}"))
}

/// Whether torques are computed with other values than the estimates.
pub fn differs_in_use(parameters: &[Parameter]) -> bool {
    parameters.iter().any(|p| p.in_use() != p.value)
}

fn joint(p: &Parameter) -> &str {
    p.joint.as_deref().unwrap_or("")
}

/// Every parameter for a terminal, beside its truth; columns without an entry are left out.
pub fn beside_truth(all: &[Parameter], truth: TrueValue) -> Table {
    let any = |has: &dyn Fn(&Parameter) -> bool| all.iter().any(has);
    let known = |p: &Parameter, x: f64| if is_open(p) { f64::NAN } else { x };
    let std = |p: &Parameter| known(p, p.std.unwrap_or(f64::NAN));
    let theta = |p: &Parameter| p.theta.map_or(number::ABSENT.to_owned(), |t| t.to_string());
    let true_value = |p: &Parameter| truth(p).unwrap_or(f64::NAN);
    let off = |p: &Parameter| off(known(p, p.value), truth(p), std(p));
    Columns::new("identified parameters", all)
        .when(any(&|p| p.joint.is_some()), |t| t.words("joint", joint))
        .words("parameter", |p| &p.name)
        .when(any(&|p| p.theta.is_some()), |t| {
            t.column(CellAlignment::Right, "theta", theta)
        })
        .estimates(["value", "std"], |p| (known(p, p.value), std(p)))
        .when(any(&|p| truth(p).is_some()), |t| {
            t.numbers("truth", |p| number::value_and_std(true_value(p), std(p)).0)
                .numbers("off [std]", |p| off(p).unwrap_or(number::ABSENT.into()))
        })
        .words("unit", |p| &p.unit)
        .words("verdict", |p| p.verdict_word())
        .into()
}

/// The section of a page.
pub fn section(page: &mut Writer, model: &ModelFile, truth: TrueValue) {
    page.heading("Parameters");
    let all = &model.estimated_parameters();
    intervals(page, model, all);
    let std = |p: &Parameter| p.std.unwrap_or(f64::NAN);
    let below_zero = |p: &Parameter| p.is_below_zero() && !is_open(p);
    // theta_1 needs no column that says 1
    let named = |p: &Parameter| {
        p.theta
            .is_none_or(|theta| p.name == format!("theta_{theta}"))
    };
    let columns = Columns::new("value and standard deviation (std) in the unit named", all)
        .words("parameter", |p| &p.name)
        .words("joint", joint)
        .when(!all.iter().all(named), |t| {
            t.words("theta", |p| {
                p.theta.map_or(String::new(), |theta| theta.to_string())
            })
        })
        .estimates(["value", "std"], |p| match is_open(p) {
            true => (f64::NAN, f64::NAN),
            false => (p.value, std(p)),
        })
        .words("relative std", |p| match is_open(p) {
            true => number::ABSENT.to_owned(),
            false => number::percent(std(p) / p.value.abs()),
        })
        .when(differs_in_use(all), |t| {
            t.numbers("in use", |p| number::value_and_std(p.in_use(), std(p)).0)
        })
        .when(all.iter().any(|p| truth(p).is_some()), |t| {
            t.words("truth", |p| {
                number::value_and_std(truth(p).unwrap_or(f64::NAN), std(p)).0
            })
            .words("off by", |p| match off(p.value, truth(p), std(p)) {
                Some(off) => off + " std",
                None => number::ABSENT.to_owned(),
            })
        })
        .words("unit", |p| &p.unit)
        .words("verdict", |p| match below_zero(p) {
            true => format!("{}, below zero", p.verdict_word()),
            false => p.verdict_word().to_owned(),
        })
        .words("meaning", |p| &p.meaning);
    page.table(columns);
    if all.iter().any(below_zero) {
        page.paragraph(
            "Below zero: friction and inertia are positive in every machine. The cause may be a torque that \
             the model lacks, or a motion that does not separate these parameters from others. Torques are \
             computed with the nearest numbers that can exist, where the model holds them.",
        );
    }
    page.table_if_any(effects_table(model));
}

/// Values of the parameters before the fit: by the masses of the robot file or its URDF, and where friction began.
fn before(model: &ModelFile) -> BTreeMap<String, f64> {
    let mut found = BTreeMap::new();
    let links = &model.robot.robot.link;
    if links.iter().any(|link| link.inertial.is_some()) {
        let robot = model.robot.robot();
        let mut standard = vec![0.0; robot.standard_parameters()];
        let bodies = standard.chunks_mut(STANDARD).zip(links);
        for (own, link) in bodies {
            if let Some(given) = &link.inertial {
                own.copy_from_slice(&given.body().standard());
            }
        }
        let names = robot.parameters().iter().map(|info| info.name.to_string());
        found.extend(names.zip(robot.base_of(&standard)));
    }
    for (joint, start) in &model.robot.friction.joint {
        let known = [
            ("viscous", start.viscous),
            ("coulomb", start.coulomb),
            ("coulomb_1", start.coulomb_1),
            ("coulomb_2", start.coulomb_2),
            ("slope_1", start.slope_1),
            ("slope_2", start.slope_2),
        ];
        let known = known.into_iter().filter_map(|(key, x)| Some((key, x?)));
        found.extend(known.map(|(key, x)| (format!("{key}:{joint}"), x)));
    }
    found
}

/// The intervals of all that the data show something of, beside the values before the fit.
fn intervals(page: &mut Writer, model: &ModelFile, parameters: &[Parameter]) {
    let before = before(model);
    let shown = parameters.iter().filter(|p| !is_open(p));
    let rows = shown.filter_map(|p| {
        let std = p.std.filter(|std| *std > 0.0)?;
        Some(IntervalRow {
            name: of_joint(&p.name, p.joint.as_deref()),
            words: format!("{} {}", number::plus_minus(p.value, std), p.unit),
            value: p.value,
            half: INTERVAL_95 * std,
            before: before.get(&p.key()).copied(),
            // where the two are one dot, one is drawn
            in_use: p.consistent.filter(|x| (x - p.value).abs() > 0.2 * std),
        })
    });
    let rows: Vec<IntervalRow> = rows.collect();
    if rows.is_empty() {
        return;
    }
    let figure = IntervalFigure {
        title: "parameters with their 95 % intervals, each scaled to its largest number".to_owned(),
        before: "robot file or URDF".to_owned(),
        rows,
    };
    page.figures(figure.cells());
}

/// A number of an effect as a table shows it.
struct EffectNumber<'a> {
    effect: &'a str,
    joint: Option<&'a str>,
    key: &'a str,
    /// What the data estimate, in `unit`.
    estimate: f64,
    std: Option<f64>,
    /// What torques are computed with, in `unit`.
    in_use: f64,
    unit: &'a str,
}

/// Effects that the model has beyond the declared structure: what the data estimate, and what torques are computed with.
pub fn effects_table(model: &ModelFile) -> Table {
    let numbers = model.effects.iter().flat_map(|effect| {
        let joint = effect.joint.as_deref();
        effect.parameters.iter().map(move |(key, number)| {
            let estimate = model.estimate(&format!("{} {key}", effect.name), joint);
            EffectNumber {
                effect: &effect.name,
                joint,
                key,
                estimate: estimate.map_or(number.value, |estimate| estimate.value),
                std: estimate.map_or(number.std, |estimate| estimate.std),
                in_use: number.value,
                unit: &number.unit,
            }
        })
    });
    let numbers: Vec<EffectNumber> = numbers.collect();
    let differs = numbers.iter().any(|n| n.in_use != n.estimate);
    let std = |n: &EffectNumber| n.std.unwrap_or(f64::NAN);
    Columns::new("effects that were added to the declared model", &numbers)
        .words("effect", |n| n.effect)
        .words("joint", |n| n.joint.unwrap_or(""))
        .words("parameter", |n| n.key)
        .estimates(["value", "std"], |n| (n.estimate, n.std))
        .when(differs, |t| {
            t.numbers("in use", |n| number::value_and_std(n.in_use, std(n)).0)
        })
        .words("unit", |n| n.unit)
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_stand_beside_their_truth_in_80_columns() {
        let viscous = "name = 'viscous'\njoint = 'q1'\ntheta = 13\nvalue = 52.4127\nstd = 0.31\nunit = 'N s/m'\n\
            verdict = 'identified'";
        let slope = "name = 'slope_1'\njoint = 'q1'\ntheta = 16\nvalue = 812.0\nunit = 's/m'\nverdict = 'lower-bound'";
        let mut both = [viscous, slope].map(|text| toml::from_str::<Parameter>(text).unwrap());
        let truth = |p: &Parameter| p.std.map(|_| 52.1);
        let expected = "\
identified parameters
joint  parameter  theta   value   std  truth  off [std]  unit   verdict
-----  ---------  -----  ------  ----  -----  ---------  -----  -----------
q1     viscous       13   52.41  0.31  52.10       +1.0  N s/m  identified
q1     slope_1       16  812.00     -      -          -  s/m    lower-bound
";
        assert_eq!(beside_truth(&both, &truth).to_string(), expected);
        for p in &mut both {
            (p.joint, p.theta) = (None, None);
        }
        let text = beside_truth(&both, &|_| None).to_string();
        assert!(!text.contains("truth") && !text.contains("joint") && !text.contains("theta"));
    }
}

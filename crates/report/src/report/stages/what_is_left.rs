//! The residual that no effect explains: on which signals it depends, in sentences and as pictures.

use crate::report::Writer;
use crate::report::figure::MapFigure;
use crate::report::words::{listed, scaled};
use cft_ident_core::diagnose::{ResidualMap, Signal};
use cft_ident_core::number;
use cft_ident_stages::identify::{Diagnosed, RobotSetup, signal_words};

/// The signals on which the residual that is left depends, a sentence for each joint.
pub(super) fn sentences(setup: &RobotSetup, found: &Diagnosed) -> Vec<String> {
    let names = setup.robot.joint_names();
    let all = &found.diagnosis.left.dependence;
    let of_joint = |(j, name): (usize, &String)| {
        let signals = all.iter().filter(|d| d.joint == j).map(|d| {
            let signals = d.signals.iter().map(|s| signal_words(names, j, *s));
            let signals = signals.collect::<Vec<String>>().join(" with ");
            let share = number::percent(d.share);
            format!("{signals} ({share} of its square, p = {:.3})", d.p_value)
        });
        let signals = listed(signals);
        (!signals.is_empty()).then(|| format!("the residual of {name} still depends on {signals}"))
    };
    names.iter().enumerate().filter_map(of_joint).collect()
}

/// The residual over the two signals on which it depends most, a map and a curve for each joint.
pub(super) fn section(page: &mut Writer, setup: &RobotSetup, found: &Diagnosed) {
    let all = found.diagnosis.left.dependence.iter();
    let drawn = all.filter_map(|d| d.map.as_ref().map(|map| figure(setup, d.joint, map)));
    let drawn: Vec<MapFigure> = drawn.collect();
    if drawn.is_empty() {
        return;
    }
    page.heading("What is left");
    page.paragraph(
        "Mean residual on the fitted logs over the two signals on which it depends most, and over the first of them. \
         Where a pattern stands in these, physics is missing; --candidates takes a formula for it.",
    );
    for figure in drawn {
        page.figures(figure.cells(Vec::new()));
    }
}

fn figure(setup: &RobotSetup, joint: usize, map: &ResidualMap) -> MapFigure {
    let names = setup.robot.joint_names();
    let torque = setup.file.torque_unit(joint);
    let over = map.signals.map(|signal| axis_of(setup, joint, signal));
    let [across, up] = [0, 1].map(|s: usize| scaled(&over[s].1, map.ends[s]));
    let means = map.curve.iter().map(|[_, mean, _]| *mean);
    let low = means.clone().fold(0.0, f64::min);
    let high = means.fold(0.0, f64::max);
    MapFigure {
        title: format!("what is left of {}", names[joint]),
        description: format!(
            "Over {} the mean residual goes from {} to {} {torque}",
            over[0].0,
            number::significant(low, 2),
            number::significant(high, 2)
        ),
        unit: torque.to_owned(),
        over: [
            (over[0].0.clone(), across.1.to_owned()),
            (over[1].0.clone(), up.1.to_owned()),
        ],
        ends: [
            map.ends[0].map(|end| across.0 * end),
            map.ends[1].map(|end| up.0 * end),
        ],
        cells: map.cells.clone(),
        curve: (map.curve.iter())
            .map(|[x, mean, std]| [across.0 * x, *mean, *std])
            .collect(),
    }
}

/// Name and unit of a signal of a joint.
pub(super) fn axis_of(setup: &RobotSetup, joint: usize, signal: Signal) -> (String, String) {
    let position = |j: usize| setup.robot.joint_kind(j).position_unit();
    let unit = match signal {
        Signal::Position(j) => position(j).to_owned(),
        Signal::Speed(j) => format!("{}/s", position(j)),
        Signal::Acceleration => format!("{}/s\u{b2}", position(joint)),
        Signal::Load => setup.file.torque_unit(joint).to_owned(),
        Signal::Direction => "1".to_owned(),
        Signal::SinceReversal | Signal::Time => "s".to_owned(),
        Signal::Temperature(_) => "degC".to_owned(),
    };
    (signal_words(setup.robot.joint_names(), joint, signal), unit)
}

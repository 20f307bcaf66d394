//! Signals on which a residual may depend.

use crate::effect::StretchTorques;
use crate::motion::Stretch;

/// What a residual may depend on; positions, speeds and temperatures of any joint, all else of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    Position(usize),
    Speed(usize),
    Acceleration,
    Load,
    Direction,
    SinceReversal,
    /// Of any joint that has one.
    Temperature(usize),
    Time,
}

/// A signal of joint `j` at rows, each of a stretch and a sample.
pub(in crate::diagnose) fn values(
    signal: Signal,
    j: usize,
    rows: &[(usize, usize)],
    stretches: &[Stretch],
    torques: &[StretchTorques],
) -> Vec<f64> {
    let since: Vec<Vec<f64>> = match signal {
        Signal::SinceReversal => stretches.iter().map(|s| since_reversal(s, j)).collect(),
        _ => Vec::new(),
    };
    let value = |(i, k): &(usize, usize)| {
        let s = &stretches[*i];
        match signal {
            Signal::Position(of) => s.q[of][*k],
            Signal::Speed(of) => s.v[of][*k],
            Signal::Acceleration => s.a[j][*k],
            Signal::Load => torques[*i].load.get(j).map_or(0.0, |load| load[*k]),
            Signal::Direction => s.v[j][*k].signum(),
            Signal::SinceReversal => since[*i][*k],
            Signal::Temperature(of) => s.temperature[of][*k],
            Signal::Time => s.began + s.dt * *k as f64,
        }
    };
    rows.iter().map(value).collect()
}

/// Time since a joint last turned [s].
fn since_reversal(stretch: &Stretch, j: usize) -> Vec<f64> {
    let (mut since, mut before) = (0.0, 0.0);
    let step = |v: &f64| {
        since = match v * before < 0.0 {
            true => 0.0,
            false => since + stretch.dt,
        };
        if *v != 0.0 {
            before = *v;
        }
        since
    };
    stretch.v[j].iter().map(step).collect()
}

//! The terms that are searched: functions of every signal, and products of two that mean something together.
//!
//! What carries a torque (speed, direction, load, a state that remembers, ..) is multiplied by what sets its size
//! (positions, load, temperature, what another joint does, ..).

use super::term::{Factor, FormulaTerm, Function, Source, TermNames};
use crate::effect::LogCoverage;
use crate::robot::FormulaSignal as Of;

/// Scales of a function over the spread of its signal, and of a state over the travel: refinement finds those between.
const SCALES: [f64; 3] = [0.1, 0.3, 1.0];
const WAYS: [f64; 4] = [0.01, 0.03, 0.1, 0.3];
/// Waves a turn that are tried of every position beside those of the residual's spectrum.
const TURNS: [f64; 4] = [1.0, 2.0, 3.0, 4.0];
/// Waves of the spectrum that are tried.
const PEAKS: usize = 4;
/// Carriers, the first ones, whose size another joint may set.
const BY_OTHERS: usize = 6;
/// A wave goes round at least so often over the travel, or it is a slope.
const LEAST_WAVES: f64 = 0.25;

/// What formulas at one joint may use: what that joint and the others did, and their names.
pub struct FormulaContext<'a> {
    pub cover: &'a LogCoverage,
    pub names: &'a TermNames<'a>,
    /// Joints that move in some log.
    pub moving: Vec<usize>,
    /// Joints whose temperature every log has, with its spread.
    pub warm: Vec<(usize, f64)>,
}

/// All terms whose units one constant makes right.
pub fn library(around: &FormulaContext) -> Vec<FormulaTerm> {
    let j = around.names.joint;
    let (carriers, own) = (around.carriers(), around.sizes());
    let others: Vec<FormulaTerm> = around.others().flat_map(|k| around.sizes_of(k)).collect();
    let mut all: Vec<FormulaTerm> = Vec::new();
    all.extend(carriers.iter().map(|f| FormulaTerm::of(&[*f])));
    all.extend(own.iter().chain(&others).cloned());
    for (i, carrier) in carriers.iter().enumerate() {
        all.extend(own.iter().map(|size| size.times(*carrier)));
        if i < BY_OTHERS {
            all.extend(others.iter().map(|size| size.times(*carrier)));
        }
    }
    // of the other joints what they do by themselves, and that times what this one does
    for k in around.others() {
        let speed = Factor::plain(Of::Speed, k);
        let drag = Factor::of(Function::Signed, speed.source);
        let [direction, acceleration] =
            [Of::Direction, Of::Acceleration].map(|of| Factor::plain(of, k));
        all.extend([speed, drag, direction, acceleration].map(|f| FormulaTerm::of(&[f])));
        let own = [
            Factor::plain(Of::Speed, j),
            Factor::plain(Of::Position, j),
            Factor::plain(Of::Direction, j),
            Factor::of(Function::Abs, Source::Signal(Of::Speed, j)),
        ];
        all.extend(own.map(|f| FormulaTerm::of(&[f, speed])));
        all.extend(around.waves(k).into_iter().map(|wave| wave.times(speed)));
    }
    all.retain(|term| term.unit(around.names).is_some());
    let mut kept: Vec<FormulaTerm> = Vec::new();
    for term in all {
        if !kept.contains(&term) {
            kept.push(term);
        }
    }
    kept
}

impl FormulaContext<'_> {
    fn others(&self) -> impl Iterator<Item = usize> + '_ {
        self.moving
            .iter()
            .copied()
            .filter(|k| *k != self.names.joint)
    }

    fn range(&self, j: usize) -> f64 {
        self.cover.joints[j].range()
    }

    /// What carries a torque by itself.
    fn carriers(&self) -> Vec<Factor> {
        let j = self.names.joint;
        let plain = |of| Factor::plain(of, j);
        let speed = Source::Signal(Of::Speed, j);
        let middle = 0.1 * self.range(j);
        let mut all = vec![
            plain(Of::Direction),
            plain(Of::Speed),
            Factor::of(Function::Signed, speed),
            plain(Of::Load),
            plain(Of::Acceleration),
            Factor::of(Function::Plain, Source::State(Of::Play, j, middle)),
            Factor::of(Function::Abs, speed),
            plain(Of::Position),
        ];
        let fast = self.cover.joints[j].speed_rms;
        all.extend(SCALES.map(|s| Factor::of(Function::Tanh(s * fast), speed)));
        for way in WAYS.map(|s| s * self.range(j)) {
            let state = |of| Factor::of(Function::Plain, Source::State(of, j, way));
            all.extend([Of::Play, Of::Dahl].map(state));
        }
        all
    }

    /// What sets the size of a torque.
    fn sizes(&self) -> Vec<FormulaTerm> {
        let j = self.names.joint;
        let of = |function, signal| single(function, Source::Signal(signal, j));
        let mut all = vec![
            of(Function::Plain, Of::Load),
            of(Function::Abs, Of::Load),
            of(Function::Square, Of::Load),
            of(Function::Abs, Of::Acceleration),
            of(Function::Square, Of::Speed),
            of(Function::Abs, Of::Speed),
        ];
        let joint = &self.cover.joints[j];
        let turn = self.cover.duration_s / joint.reversals.max(1) as f64;
        all.extend(SCALES.map(|s| of(Function::Decay(s * joint.speed_rms), Of::Speed)));
        all.extend(SCALES.map(|s| of(Function::Bell(s * joint.speed_rms), Of::Speed)));
        all.extend(SCALES.map(|s| of(Function::Decay(s * turn), Of::SinceReversal)));
        for (warm, spread) in &self.warm {
            let source = Source::Signal(Of::Temperature, *warm);
            all.push(single(Function::Plain, source));
            all.extend([0.3, 1.0, 3.0].map(|s| single(Function::Decay(s * spread), source)));
        }
        all.extend(of_position(Source::Signal(Of::Position, j)));
        all.extend(self.waves(j));
        all
    }

    /// What another joint sets.
    fn sizes_of(&self, k: usize) -> Vec<FormulaTerm> {
        let mut all = of_position(Source::Signal(Of::Position, k)).to_vec();
        all.extend(self.waves(k));
        let speed = Source::Signal(Of::Speed, k);
        all.extend([Function::Abs, Function::Square].map(|f| single(f, speed)));
        let both = Source::Sum(self.names.joint, k);
        all.extend(of_position(both));
        all.extend(TURNS[..2].iter().map(|n| wave(both, *n)));
        all
    }

    /// Waves over the position of a joint: whole ones a turn, and those of the residual's spectrum at the joint itself.
    fn waves(&self, k: usize) -> Vec<FormulaTerm> {
        let source = Source::Signal(Of::Position, k);
        let turns = std::f64::consts::TAU / self.range(k).max(f64::MIN_POSITIVE);
        let angle = self.names.positions[k] == "rad";
        let mut all: Vec<f64> = Vec::new();
        if angle {
            all.extend(TURNS.iter().filter(|n| **n >= LEAST_WAVES * turns));
        }
        if k == self.names.joint {
            let joint = &self.cover.joints[k];
            let spectra = [&joint.ripple_orders, &joint.friction_orders];
            let peaks = spectra.iter().flat_map(|orders| orders.iter().take(PEAKS));
            let unit = if angle { 1.0 } else { std::f64::consts::TAU };
            let near = |n: f64| match angle && (n - n.round()).abs() < 0.1 * turns {
                true => n.round(),
                false => n,
            };
            all.extend(peaks.map(|order| near(order * unit)).filter(|n| *n > 0.0));
        }
        all.sort_by(f64::total_cmp);
        all.dedup();
        all.into_iter().map(|n| wave(source, n)).collect()
    }
}

fn single(function: Function, source: Source) -> FormulaTerm {
    FormulaTerm::of(&[Factor::of(function, source)])
}

fn of_position(source: Source) -> [FormulaTerm; 4] {
    use Function::{Abs, Cube, Plain, Square};
    [Plain, Square, Cube, Abs].map(|f| single(f, source))
}

pub(super) fn wave(source: Source, n: f64) -> FormulaTerm {
    FormulaTerm {
        factors: Vec::new(),
        wave: Some((source, n)),
    }
}

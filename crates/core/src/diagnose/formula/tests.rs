//! The search on motions of its own: what is there is found with its signals, noise gives nothing, units are carried.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::columns::{Columns, RowsOfJoint};
use super::library::wave;
use super::select::{SelectedTerms, TermProducts, gram};
use super::term::{Factor, FormulaTerm, Function, Source, TermNames, named};
use crate::diagnose::problem::formula_numbers::FORMULA_NUMBERS;
use crate::effect::EffectScene;
use crate::judge::NUMBERS;
use crate::motion::Stretch;
use crate::robot::model::JointFriction;
use crate::robot::{FormulaSignal, JointKind, Robot};

const ROWS: usize = 2400;
const BLOCKS: usize = 24;

fn with_names<T>(of: impl FnOnce(&TermNames) -> T) -> T {
    of(&TermNames {
        joint: 0,
        joints: &["q1".to_owned(), "arm 2".to_owned()],
        positions: vec!["rad", "m"],
        torques: &["Nm".to_owned(), "N".to_owned()],
    })
}

fn stretch() -> Stretch {
    let t: Vec<f64> = (0..ROWS).map(|k| 0.02 * k as f64).collect();
    let of = |f: &dyn Fn(f64) -> f64| vec![t.iter().map(|t| f(*t)).collect::<Vec<f64>>()];
    Stretch {
        dt: 0.02,
        q: of(&|t| (0.9 * t).sin() + 0.6 * (2.3 * t).sin()),
        v: of(&|t| 0.9 * (0.9 * t).cos() + 1.38 * (2.3 * t).cos()),
        a: of(&|t| -0.81 * (0.9 * t).sin() - 3.174 * (2.3 * t).sin()),
        tau: of(&|_| 0.0),
        t,
        ..Stretch::default()
    }
}

fn terms() -> Vec<FormulaTerm> {
    use FormulaSignal::{Acceleration, Direction, Position, Speed};
    let plain = [Direction, Speed, Acceleration, Position].map(|s| Factor::plain(s, 0));
    let (q, v) = (Source::Signal(Position, 0), Source::Signal(Speed, 0));
    let sizes = [
        Factor::of(Function::Square, q),
        Factor::of(Function::Cube, q),
        Factor::of(Function::Abs, v),
        Factor::of(Function::Decay(0.3), v),
    ];
    let single = plain.iter().chain(&sizes).map(|f| FormulaTerm::of(&[*f]));
    let products = plain
        .iter()
        .flat_map(|a| sizes.map(|b| FormulaTerm::of(&[*a, b])));
    single.chain(products).collect()
}

/// Searches in noise with a torque made of columns of the terms.
fn search(seed: u64, torque: &dyn Fn(&[Vec<f64>], usize) -> f64) -> Option<SelectedTerms> {
    let (stretch, terms) = (stretch(), terms());
    let robot = Robot::single_joint("q1", JointKind::Revolute);
    let load = vec![vec![0.0; ROWS]];
    let scene = EffectScene {
        robot: &robot,
        theta: &[1.0],
        laws: &[JointFriction::None],
        stretch: &stretch,
        hat: &load,
        load: &load,
        direction: &[stretch.v[0].iter().map(|v| v.signum()).collect()],
        tilt: None,
    };
    let columns = Columns::of(&terms);
    let series = columns.series(&scene);
    let all: Vec<Vec<f64>> = (0..columns.count())
        .map(|i| columns.column(&series, i))
        .collect();
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || -> f64 { chance.sample(rand_distr::StandardNormal) };
    let left: Vec<f64> = (0..ROWS).map(|k| noise() + torque(&all, k)).collect();
    let declared = [&all[0], &all[1], &all[2], &vec![1.0; ROWS], &left];
    let rows = RowsOfJoint {
        declared: DMatrix::from_fn(ROWS, 5, |i, c| declared[c][i]),
        more: DMatrix::from_fn(ROWS, all.len(), |i, c| all[c][i]),
        blocks: (0..BLOCKS)
            .map(|b| b * ROWS / BLOCKS..(b + 1) * ROWS / BLOCKS)
            .collect(),
    };
    let gram = gram(&rows.more);
    let rows = (&rows, &gram, &[0, 1, 2, 3][..]);
    let products = with_names(|names| TermProducts::of(&terms, rows, names, NUMBERS.ridge))?;
    products.select(&[1.0; BLOCKS], (&FORMULA_NUMBERS, &NUMBERS))
}

#[test]
fn a_product_that_is_there_is_the_formula() {
    let place = terms().iter().position(|t| {
        t.factors.len() == 2
            && t.factors[0].source == Source::Signal(FormulaSignal::Speed, 0)
            && t.factors[1].function == Function::Square
    });
    let place = place.unwrap();
    for seed in 0..5 {
        let found = search(seed, &|columns, k| 0.5 * columns[place][k]).unwrap();
        assert_eq!(found.terms, [place], "{seed}: {:?}", found.terms);
        assert!(found.gain.is_beyond(NUMBERS.screen, None));
    }
}

#[test]
fn noise_has_no_formula_whose_term_takes_two_percent_off() {
    let found = (0..20).filter(|seed| search(100 + seed, &|_, _| 0.0).is_some());
    assert!(found.count() <= 2);
}

#[test]
fn units_that_no_constant_makes_right_are_out_and_others_are_written() {
    with_names(|names| {
        let unit = |term: &FormulaTerm| term.unit(names);
        let speed = Source::Signal(FormulaSignal::Speed, 0);
        assert_eq!(unit(&wave(speed, 2.0)), None);
        assert_eq!(unit(&wave(Source::Sum(0, 1), 2.0)), None);
        let other = Source::Signal(FormulaSignal::Position, 1);
        assert_eq!(unit(&wave(other, 2.0)), None);
        assert_eq!(unit(&wave(other, 2.5)).as_deref(), Some("Nm"));
        let factors = [(FormulaSignal::Speed, 0), (FormulaSignal::Load, 1)];
        let product = FormulaTerm::of(&factors.map(|(signal, j)| Factor::plain(signal, j)));
        assert_eq!(unit(&product).as_deref(), Some("Nm s/(N rad)"));
        assert_eq!(product.texts(names, &[]), ["v*{load_arm 2}"]);
        let decay = FormulaTerm::of(&[Factor::of(Function::Decay(0.5), speed)]);
        let shapes = named(&[decay.clone(), decay.clone()], names);
        assert_eq!((shapes.len(), shapes[0].unit.as_str()), (1, "rad/s"));
        assert_eq!(decay.texts(names, &shapes), ["exp(-abs(v)/w)"]);
    });
}

//! The parameters of a tree as a fit can determine them, and what they multiply.
//!
//! tau = Y(q, v, a) theta + F(v) + offset, with theta the base parameters, and beside them the
//! inertias, viscous and Coulomb friction that coupled gear trains share.

use std::borrow::Cow;

use super::base::{self, ParameterGroup};
use super::links::Tree;
use super::newton_euler::{torques, walk};
use crate::robot::friction::sign;
use crate::robot::joint::{JointKind, ParameterInfo};
use crate::robot::standard::{STANDARD, STANDARD_NAMES};

/// Two joints whose gear trains are coupled: the motor of joint `motor` turns by
/// q_motor + ratio q_other, as in a wrist, a differential or an H-bot. Its inertia a, viscous v and Coulomb s act as
/// tau_motor += a ratio a_other + v ratio v_other + s sgn(v_motor + ratio v_other) and
/// tau_other += ratio (a a_motor + v v_motor + s sgn(v_motor + ratio v_other)); what either joint
/// does to itself is in its own drive inertia and friction. The wrist of the TX40 is so, with ratio 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointCoupling {
    /// Joint whose motor it is.
    pub motor: usize,
    /// Joint that turns this motor too.
    pub other: usize,
    /// Turns of the motor per turn of the other joint, in units of the motor's own joint.
    pub ratio: f64,
}

/// Parameters of a coupling; a second one of the same two joints shares all but the last with the first.
const OF_COUPLING: [&str; 3] = ["inertia", "viscous", "coulomb"];

/// A coupling, where its parameters begin, and which of [`OF_COUPLING`] is the first of them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct GearTrain {
    coupling: JointCoupling,
    at: usize,
    from: usize,
}

/// Base parameters of links and drives, then those of the couplings.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Names, units and meanings, in the order of the regressor's columns.
    infos: Vec<ParameterInfo>,
    groupings: Vec<ParameterGroup>,
    trains: Vec<GearTrain>,
    /// Per link, which of its ten columns are kept and where they stand.
    kept: Vec<Vec<(usize, usize)>>,
    /// Kept drive inertias: joint, and where the column stands.
    drives: Vec<(usize, usize)>,
}

impl Parameters {
    /// The parameters of a tree whose joints have these names, with or without a drive inertia per joint.
    pub fn new(
        tree: &Tree,
        names: &[String],
        drive_inertia: bool,
        couplings: &[JointCoupling],
    ) -> Self {
        let links = tree.links().len();
        let groupings = base::groupings(tree, drive_inertia);
        let mut kept = vec![Vec::new(); links];
        let mut drives = Vec::new();
        let mut infos = Vec::new();
        for (at, grouping) in groupings.iter().enumerate() {
            match grouping.kept.checked_sub(links * STANDARD) {
                Some(joint) => drives.push((joint, at)),
                None => kept[grouping.kept / STANDARD].push((grouping.kept % STANDARD, at)),
            }
            infos.push(ParameterInfo {
                name: standard_name(links, grouping.kept).into(),
                theta: None,
                unit: standard_unit(tree, grouping.kept).into(),
                meaning: in_words(links, grouping).into(),
            });
        }
        let mut trains: Vec<GearTrain> = Vec::new();
        for c in couplings {
            let pair = |c: &JointCoupling| (c.motor.min(c.other), c.motor.max(c.other));
            let second = trains.iter().any(|t| pair(&t.coupling) == pair(c));
            let from = if second { 2 } else { 0 };
            trains.push(GearTrain {
                coupling: *c,
                at: infos.len(),
                from,
            });
            let of = |joint: usize| names.get(joint).map_or("", String::as_str);
            let (motor, other) = (of(c.motor), of(c.other));
            for name in &OF_COUPLING[from..] {
                infos.push(ParameterInfo {
                    name: format!("{name}_{motor}_{other}").into(),
                    theta: None,
                    unit: coupling_unit(tree, c, name),
                    meaning: format!("{name} of the motor of {motor} that {other} turns too")
                        .into(),
                });
            }
        }
        Self {
            infos,
            groupings,
            trains,
            kept,
            drives,
        }
    }

    /// Names, units and meanings, in the order of the regressor's columns.
    pub fn infos(&self) -> &[ParameterInfo] {
        &self.infos
    }

    /// How the base parameters are grouped.
    pub fn groupings(&self) -> &[ParameterGroup] {
        &self.groupings
    }

    /// Inertia, viscous and Coulomb of every coupling; 0 where another has it.
    pub fn of_couplings(&self, theta: &[f64]) -> Vec<[f64; 3]> {
        let of = |train: &GearTrain| {
            let mut numbers = [0.0; 3];
            for (k, x) in numbers[train.from..].iter_mut().enumerate() {
                *x = theta.get(train.at + k).copied().unwrap_or_default();
            }
            numbers
        };
        self.trains.iter().map(of).collect()
    }

    /// Writes Y(q, v, a), n x p row-major.
    #[inline]
    pub fn regressor(&self, tree: &Tree, q: &[f64], v: &[f64], a: &[f64], y: &mut [f64]) {
        let p = self.infos.len();
        assert_eq!(y.len(), tree.joints() * p, "n rows of p");
        y.fill(0.0);
        walk(tree, q, v, a, |link, joint, row| {
            let y = &mut y[joint * p..(joint + 1) * p];
            for &(c, at) in &self.kept[link] {
                y[at] = row[c];
            }
        });
        self.of_drives(v, a, |joint, at, x| y[joint * p + at] = x);
    }

    /// Writes Y(q, v, a) theta without the matrix.
    #[inline]
    pub fn torque(&self, tree: &Tree, theta: &[f64], [q, v, a]: [&[f64]; 3], tau: &mut [f64]) {
        tau.fill(0.0);
        let body = |link: usize| {
            let mut body = [0.0; STANDARD];
            for &(c, at) in &self.kept[link] {
                body[c] = theta[at];
            }
            body
        };
        torques(tree, [q, v, a], body, tau);
        self.of_drives(v, a, |joint, at, x| tau[joint] += x * theta[at]);
    }

    /// Calls `set(joint, column, entry)` for what drives and couplings have in the regressor.
    #[inline(always)]
    fn of_drives(&self, v: &[f64], a: &[f64], mut set: impl FnMut(usize, usize, f64)) {
        for &(joint, at) in &self.drives {
            set(joint, at, a[joint]);
        }
        for GearTrain {
            coupling: c,
            at,
            from,
        } in &self.trains
        {
            let (m, o) = (c.motor, c.other);
            let turning = v[m] + c.ratio * v[o];
            let sign = sign(turning);
            for (row, inertia, viscous, coulomb) in [
                (m, c.ratio * a[o], c.ratio * v[o], sign),
                (o, c.ratio * a[m], c.ratio * v[m], c.ratio * sign),
            ] {
                let entries = [inertia, viscous, coulomb];
                for (k, x) in entries[*from..].iter().copied().enumerate() {
                    set(row, at + k, x);
                }
            }
        }
    }
}

/// Ixx3, mx3, m3 of link 3 (counted from 1); Ia3 of joint 3's drive.
pub(crate) fn standard_name(links: usize, index: usize) -> String {
    match index.checked_sub(links * STANDARD) {
        Some(joint) => format!("Ia{}", joint + 1),
        None => format!(
            "{}{}",
            STANDARD_NAMES[index % STANDARD],
            index / STANDARD + 1
        ),
    }
}

fn standard_unit(tree: &Tree, index: usize) -> &'static str {
    match index.checked_sub(tree.links().len() * STANDARD) {
        Some(joint) => tree.joint_kind(joint).inertia_unit(),
        None => match index % STANDARD {
            0..=5 => "kg m^2",
            6..=8 => "kg m",
            _ => "kg",
        },
    }
}

fn coupling_unit(tree: &Tree, coupling: &JointCoupling, name: &str) -> Cow<'static, str> {
    let kind = tree.joint_kind(coupling.motor);
    match (name, kind) {
        ("inertia", kind) => kind.inertia_unit().into(),
        ("viscous", JointKind::Revolute) => "Nm s/rad".into(),
        ("viscous", JointKind::Prismatic) => "N s/m".into(),
        (_, kind) => kind.torque_unit().into(),
    }
}

/// `mx2 + 0.316 m3 - Iyy2`: the grouping as an engineer writes it.
fn in_words(links: usize, grouping: &ParameterGroup) -> String {
    let mut out = standard_name(links, grouping.kept);
    for (index, c) in &grouping.terms {
        out += if *c < 0.0 { " - " } else { " + " };
        let size = c.abs();
        if (size - 1.0).abs() > 1e-12 {
            out += &format!("{} ", rounded(size));
        }
        out += &standard_name(links, *index);
    }
    out
}

/// Six significant digits, without zeros at the end.
fn rounded(x: f64) -> String {
    let digits = (5 - x.log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{x:.digits$}");
    if !text.contains('.') {
        return text;
    }
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

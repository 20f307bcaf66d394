//! Any serial robot: a chain of links, its regressor in base parameters.
//!
//! | file | what |
//! |---|---|
//! | [`space`] | vectors and rotations |
//! | [`chain`] | links, joints, dependent coordinates |
//! | [`newton_euler`] | the regressor of the standard parameters, one recursion |
//! | [`base`] | which combinations of them torques can tell |
//!
//! tau = Y(q, v, a) theta + F(v) + offset, with theta the base parameters, and beside them the
//! inertias, viscous and Coulomb friction that coupled gear trains share.

pub mod base;
pub mod chain;
pub mod newton_euler;
pub mod space;

use std::borrow::Cow;

pub use base::Grouping;
pub use chain::{Chain, ChainError, Coordinate, Dependence, Link, Sine};
use newton_euler::walk;

use super::friction::sign;
use super::standard::STANDARD;
use super::{JointKind, ParameterInfo};

/// Names of a link's standard parameters, in the order of [`STANDARD`].
pub const STANDARD_NAMES: [&str; STANDARD] = [
    "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz", "mx", "my", "mz", "m",
];

/// Most entries of the regressor: what its users keep on the stack.
pub const MOST_ENTRIES: usize = 832;

/// Two joints whose gear trains are coupled: the motor of joint `motor` turns by
/// q_motor + ratio q_other. Its inertia a, viscous v and Coulomb s act as
/// tau_motor += a ratio a_other + v ratio v_other + s sgn(v_motor + ratio v_other) and
/// tau_other += ratio (a a_motor + v v_motor + s sgn(v_motor + ratio v_other)); what either joint
/// does to itself is in its own drive inertia and friction. The wrist of the TX40 is so, with ratio 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Joint whose motor it is.
    pub motor: usize,
    /// Joint that turns this motor too.
    pub other: usize,
    /// Turns of the motor per turn of the other joint, in units of the motor's own joint.
    pub ratio: f64,
}

/// Parameters of a coupling.
const OF_COUPLING: [&str; 3] = ["inertia", "viscous", "coulomb"];

/// A serial robot: its chain, and its parameters as a fit can tell them.
#[derive(Debug, Clone, PartialEq)]
pub struct SerialRobot {
    chain: Chain,
    names: Vec<String>,
    drive_inertia: bool,
    couplings: Vec<Coupling>,
    groupings: Vec<Grouping>,
    parameters: Vec<ParameterInfo>,
    /// Per link, which of its ten columns are kept and where they stand.
    kept: Vec<Vec<(usize, usize)>>,
    /// Kept drive inertias: joint, and where the column stands.
    drives: Vec<(usize, usize)>,
    /// Where the couplings' columns begin.
    coupled: usize,
}

impl SerialRobot {
    /// A robot of a chain with joint names, with or without a drive inertia per joint.
    ///
    /// # Errors
    /// [`ChainError::TooWide`] where the regressor does not fit.
    pub fn new(
        chain: Chain,
        names: Vec<String>,
        drive_inertia: bool,
        couplings: Vec<Coupling>,
    ) -> Result<Self, ChainError> {
        let n = chain.joints();
        let links = chain.links().len();
        let groupings = base::groupings(&chain, drive_inertia);
        let mut kept = vec![Vec::new(); links];
        let mut drives = Vec::new();
        let mut parameters = Vec::new();
        for (at, grouping) in groupings.iter().enumerate() {
            match grouping.kept.checked_sub(links * STANDARD) {
                Some(joint) => drives.push((joint, at)),
                None => kept[grouping.kept / STANDARD].push((grouping.kept % STANDARD, at)),
            }
            parameters.push(ParameterInfo {
                name: standard_name(links, grouping.kept).into(),
                theta: None,
                unit: standard_unit(&chain, grouping.kept).into(),
                meaning: in_words(links, grouping).into(),
            });
        }
        let coupled = parameters.len();
        for c in &couplings {
            let of = |joint: usize| names.get(joint).map_or("", String::as_str);
            for name in OF_COUPLING {
                parameters.push(ParameterInfo {
                    name: format!("{name}_{}_{}", of(c.motor), of(c.other)).into(),
                    theta: None,
                    unit: coupling_unit(&chain, c, name),
                    meaning: format!(
                        "{name} of the motor of {} that {} turns too",
                        of(c.motor),
                        of(c.other)
                    )
                    .into(),
                });
            }
        }
        let entries = n * parameters.len();
        if entries > MOST_ENTRIES {
            return Err(ChainError::TooWide {
                joints: n,
                parameters: parameters.len(),
                entries,
                most: MOST_ENTRIES,
            });
        }
        Ok(Self {
            chain,
            names,
            drive_inertia,
            couplings,
            groupings,
            parameters,
            kept,
            drives,
            coupled,
        })
    }

    /// The chain.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }

    /// Names of the independent joints.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Whether each joint's drive has an inertia of its own.
    pub fn drive_inertia(&self) -> bool {
        self.drive_inertia
    }

    /// Coupled gear trains.
    pub fn couplings(&self) -> &[Coupling] {
        &self.couplings
    }

    /// Base parameters, then those of the couplings, in the order of the regressor's columns.
    pub fn parameters(&self) -> &[ParameterInfo] {
        &self.parameters
    }

    /// How the base parameters are grouped.
    pub fn groupings(&self) -> &[Grouping] {
        &self.groupings
    }

    /// Kind of independent joint j: that of the link that it drives itself.
    pub fn joint_kind(&self, j: usize) -> JointKind {
        kind_of(&self.chain, j)
    }

    /// Number of standard parameters: ten a link, then the drive inertias.
    pub fn standard_parameters(&self) -> usize {
        base::standard_parameters(&self.chain, self.drive_inertia)
    }

    /// Name of a standard parameter, as groupings call it.
    pub fn standard_name(&self, index: usize) -> String {
        standard_name(self.chain.links().len(), index)
    }

    /// Base parameters of standard ones, ten a link (inertia about the origin of the link's frame,
    /// first moments, mass), then the drive inertias. The couplings' are not among them.
    ///
    /// # Panics
    /// Where there are fewer than [`Self::standard_parameters`] numbers.
    pub fn base_of(&self, standard: &[f64]) -> Vec<f64> {
        let sum = |g: &Grouping| {
            let rest: f64 = g.terms.iter().map(|(i, c)| c * standard[*i]).sum();
            standard[g.kept] + rest
        };
        self.groupings.iter().map(sum).collect()
    }

    /// Writes Y(q, v, a), n x p row-major.
    #[inline]
    pub(super) fn regressor(&self, q: &[f64], v: &[f64], a: &[f64], y: &mut [f64]) {
        let p = self.parameters.len();
        assert_eq!(y.len(), self.chain.joints() * p, "n rows of p");
        y.fill(0.0);
        walk(&self.chain, q, v, a, |link, joint, row| {
            let y = &mut y[joint * p..(joint + 1) * p];
            for &(c, at) in &self.kept[link] {
                y[at] = row[c];
            }
        });
        for &(joint, at) in &self.drives {
            y[joint * p + at] = a[joint];
        }
        for (k, c) in self.couplings.iter().enumerate() {
            let at = self.coupled + OF_COUPLING.len() * k;
            let (m, o) = (c.motor, c.other);
            let turning = v[m] + c.ratio * v[o];
            let sign = sign(turning);
            for (row, inertia, viscous, coulomb) in [
                (m, c.ratio * a[o], c.ratio * v[o], sign),
                (o, c.ratio * a[m], c.ratio * v[m], c.ratio * sign),
            ] {
                let y = &mut y[row * p + at..row * p + at + OF_COUPLING.len()];
                y[0] = inertia;
                y[1] = viscous;
                y[2] = coulomb;
            }
        }
    }

    /// Writes the regressor of all standard parameters, n x [`Self::standard_parameters`]
    /// row-major: the drive inertias last, without the couplings.
    pub fn standard_regressor(&self, q: &[f64], v: &[f64], a: &[f64], y: &mut [f64]) {
        let p = self.standard_parameters();
        y.fill(0.0);
        walk(&self.chain, q, v, a, |link, joint, row| {
            let at = joint * p + link * STANDARD;
            y[at..at + STANDARD].copy_from_slice(row);
        });
        if self.drive_inertia {
            let first = self.chain.links().len() * STANDARD;
            for (j, a) in a.iter().enumerate().take(self.chain.joints()) {
                y[j * p + first + j] = *a;
            }
        }
    }
}

fn kind_of(chain: &Chain, j: usize) -> JointKind {
    let own = |l: &&Link| l.coordinate == Coordinate::Joint(j);
    let link = chain.links().iter().find(own);
    link.map_or(JointKind::Revolute, |l| l.kind)
}

/// Ixx3, mx3, m3 of link 3 (counted from 1); Ia3 of joint 3's drive.
fn standard_name(links: usize, index: usize) -> String {
    match index.checked_sub(links * STANDARD) {
        Some(joint) => format!("Ia{}", joint + 1),
        None => format!(
            "{}{}",
            STANDARD_NAMES[index % STANDARD],
            index / STANDARD + 1
        ),
    }
}

fn standard_unit(chain: &Chain, index: usize) -> &'static str {
    match index.checked_sub(chain.links().len() * STANDARD) {
        Some(joint) => inertia_unit(kind_of(chain, joint)),
        None => match index % STANDARD {
            0..=5 => "kg m^2",
            6..=8 => "kg m",
            _ => "kg",
        },
    }
}

const fn inertia_unit(kind: JointKind) -> &'static str {
    match kind {
        JointKind::Revolute => "kg m^2",
        JointKind::Prismatic => "kg",
    }
}

fn coupling_unit(chain: &Chain, coupling: &Coupling, name: &str) -> Cow<'static, str> {
    let kind = kind_of(chain, coupling.motor);
    match (name, kind) {
        ("inertia", kind) => inertia_unit(kind).into(),
        ("viscous", JointKind::Revolute) => "Nm s/rad".into(),
        ("viscous", JointKind::Prismatic) => "N s/m".into(),
        (_, kind) => kind.torque_unit().into(),
    }
}

/// `mx2 + 0.316 m3 - Iyy2`: the grouping as an engineer writes it.
fn in_words(links: usize, grouping: &Grouping) -> String {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two links in a vertical plane, both about z, l = 0.4 m between the axes.
    fn double_pendulum(drive_inertia: bool) -> SerialRobot {
        let link = |name: &str, parent, origin, joint| Link {
            name: name.to_owned(),
            parent,
            rotation: space::UNTURNED,
            origin,
            axis: [0.0, 0.0, 1.0],
            kind: JointKind::Revolute,
            coordinate: Coordinate::Joint(joint),
        };
        let links = vec![
            link("upper", None, [0.0; 3], 0),
            link("lower", Some(0), [0.4, 0.0, 0.0], 1),
        ];
        let chain = Chain::new(links, 2, [0.0, -9.81, 0.0]).unwrap();
        let names = vec!["q1".to_owned(), "q2".to_owned()];
        SerialRobot::new(chain, names, drive_inertia, Vec::new()).unwrap()
    }

    #[test]
    fn a_double_pendulum_has_the_base_parameters_of_the_textbook() {
        let robot = double_pendulum(false);
        let meanings: Vec<&str> = robot.parameters().iter().map(|p| &*p.meaning).collect();
        // Khalil and Dombre: the second mass goes into the first link
        assert_eq!(
            meanings,
            [
                "Izz1 + 0.16 m2",
                "mx1 + 0.4 m2",
                "my1",
                "Izz2",
                "mx2",
                "my2"
            ]
        );
    }

    #[test]
    fn a_drive_inertia_goes_into_the_link_that_turns_with_it() {
        let robot = double_pendulum(true);
        let names: Vec<&str> = robot.parameters().iter().map(|p| &*p.name).collect();
        assert_eq!(names, ["Izz1", "mx1", "my1", "Izz2", "mx2", "my2", "Ia2"]);
        assert_eq!(robot.parameters()[0].meaning, "Izz1 + 0.16 m2 + Ia1");
    }

    #[test]
    fn torques_of_a_double_pendulum_are_those_of_its_closed_form() {
        let robot = double_pendulum(false);
        let (m2, c2, i2, i1, s1) = (1.7, 0.23, 0.05, 0.4, 0.9);
        let theta = robot.base_of(&{
            let mut standard = [0.0; 20];
            (standard[5], standard[6]) = (i1, s1);
            (standard[15], standard[16], standard[19]) = (i2 + m2 * c2 * c2, m2 * c2, m2);
            standard
        });
        let (q, v, a) = ([0.4, -1.1], [0.7, 1.3], [-2.0, 3.0]);
        let mut y = [0.0; 12];
        robot.regressor(&q, &v, &a, &mut y);
        let tau: Vec<f64> = y
            .chunks(6)
            .map(|y| y.iter().zip(&theta).map(|(y, t)| y * t).sum())
            .collect();
        let (l, g) = (0.4, 9.81);
        let (s, c) = f64::sin_cos(q[1]);
        let h = m2 * l * c2;
        let j2 = i2 + m2 * c2 * c2;
        let lower = g * m2 * c2 * (q[0] + q[1]).cos();
        let first = (i1 + m2 * l * l + j2 + 2.0 * h * c) * a[0] + (j2 + h * c) * a[1]
            - h * s * (2.0 * v[0] * v[1] + v[1] * v[1])
            + g * (s1 + m2 * l) * q[0].cos()
            + lower;
        let second = (j2 + h * c) * a[0] + j2 * a[1] + h * s * v[0] * v[0] + lower;
        assert!((tau[0] - first).abs() < 1e-12, "{} {first}", tau[0]);
        assert!((tau[1] - second).abs() < 1e-12, "{} {second}", tau[1]);
    }
}

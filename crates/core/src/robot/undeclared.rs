//! Torques of what a declared model leaves out: gravity along the base's x and y, a body at the tool,
//! parameters that the declared structure drops.

use std::sync::LazyLock;

use super::cft::dynamics::ReportCoefficients;
use super::cft::links::{PseudoInertia, base_parameters};
use super::cft::regressor::regressor22;
use super::cft::{PRINTED, ParameterStructure, UNPRINTED};
use super::standard::{Body, STANDARD};
use super::tree::newton_euler::{torques, walk};
use super::tree::{MOST_JOINTS, Tree};
use super::{DynamicsForm, Robot, four};

/// Torques of a gravity of one along the x and the y of the base. Masses m_i at p_i have the potential
/// -sum m_i (gx p_x + gy p_y); the first moments of the CFT robot's chain are those of its kinetic energy
/// (eq. (60)), those of other links are their base parameters. First moments that are no parameter, as those
/// about a vertical first axis, count as none.
#[derive(Debug, Clone)]
pub struct BaseTilt(GravityMoments);

/// What the moments of a tilted base are computed from; `Unknown` where nothing is known of the links.
#[derive(Debug, Clone)]
enum GravityMoments {
    Unknown,
    Report(Box<ReportCoefficients>),
    /// The tree in each of the two gravities, and standard parameters of its links.
    Links(Box<[Tree; 2]>, Vec<[f64; STANDARD]>),
}

impl Robot {
    /// What a base that stands askew adds, for inertial parameters `theta`.
    pub fn tilt(&self, theta: &[f64]) -> BaseTilt {
        BaseTilt(match &self.0.form {
            DynamicsForm::Inertia => GravityMoments::Unknown,
            DynamicsForm::Report(_) => (self.coefficients(theta))
                .map_or(GravityMoments::Unknown, |closed| {
                    GravityMoments::Report(Box::new(closed))
                }),
            DynamicsForm::Recursion(_) => {
                let along = |gravity| self.tree().in_gravity(gravity);
                let trees = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(along);
                GravityMoments::Links(Box::new(trees), self.link_parameters(theta))
            }
        })
    }

    /// Link that carries the tool: the last one.
    pub(crate) fn tool_link(&self) -> usize {
        self.tree().links().len() - 1
    }

    /// Whether the last link turns about the vertical alone, as the tool of the CFT robot and what a single
    /// joint carries do: a body on it then has one moment of inertia that shows.
    pub fn tool_stays_level(&self) -> bool {
        !matches!(self.0.form, DynamicsForm::Recursion(_))
    }

    /// Torque of joint `joint` by mass, first moments and moment of inertia about the vertical of a body on a
    /// tool that stays level, in the frame of the last link. A single joint's link has no place: all that a
    /// body adds to it is in the first number.
    pub fn level_tool_row(&self, joint: usize, q: &[f64], v: &[f64], a: &[f64]) -> [f64; 5] {
        match &self.0.form {
            DynamicsForm::Inertia => [a[joint], 0.0, 0.0, 0.0, 0.0],
            DynamicsForm::Report(_) => {
                let mut y = [[0.0; 22]; 4];
                regressor22(four(q), four(v), four(a), &mut y);
                BODIES.map(|body| y[joint].iter().zip(&body).map(|(y, b)| y * b).sum())
            }
            DynamicsForm::Recursion(_) => {
                let row = self.tool_row(joint, q, v, a);
                [row[9], row[6], row[7], row[8], row[0] + row[3] + row[5]]
            }
        }
    }

    /// Torque of joint `joint` by the ten standard parameters of a body on the last link.
    pub fn tool_row(&self, joint: usize, q: &[f64], v: &[f64], a: &[f64]) -> [f64; STANDARD] {
        let (last, mut out) = (self.tool_link(), [0.0; STANDARD]);
        walk(self.tree(), q, v, a, |link, on, row| {
            if link == last && on == joint {
                out = *row;
            }
        });
        out
    }

    /// Standard parameters of links of which only the last is there: a ball with a mass and a moment of inertia.
    pub(crate) fn tool_links(
        &self,
        [mass, ball]: [f64; 2],
        centre: [f64; 3],
    ) -> Vec<[f64; STANDARD]> {
        let mut links = vec![[0.0; STANDARD]; self.tree().links().len()];
        let inertia = [ball, 0.0, 0.0, ball, 0.0, ball];
        links[self.tool_link()] = Body {
            mass,
            centre,
            inertia,
        }
        .standard();
        links
    }

    /// Likewise for the five numbers of [`Self::level_tool_row`].
    pub(crate) fn level_tool_links(&self, numbers: [f64; 5]) -> Vec<[f64; STANDARD]> {
        match &self.0.form {
            DynamicsForm::Inertia => self.link_parameters(&numbers[..1]),
            DynamicsForm::Report(_) => {
                let mut theta = [0.0; 22];
                for (body, x) in BODIES.iter().zip(numbers) {
                    for (sum, y) in theta.iter_mut().zip(body) {
                        *sum += x * y;
                    }
                }
                self.link_parameters(&theta)
            }
            DynamicsForm::Recursion(_) => {
                let [mass, mx, my, mz, second] = numbers;
                let mut links = vec![[0.0; STANDARD]; self.tree().links().len()];
                links[self.tool_link()] = [second, 0.0, 0.0, second, 0.0, second, mx, my, mz, mass];
                links
            }
        }
    }

    /// Likewise for the dropped parameters.
    pub(crate) fn dropped_links(&self, values: &[f64]) -> Vec<[f64; STANDARD]> {
        let mut theta = [0.0; 22];
        for (theta, value) in theta[PRINTED..].iter_mut().zip(values) {
            *theta = *value;
        }
        self.link_parameters(&theta)
    }

    /// Names of the base parameters of the full chain that the declared structure drops.
    pub fn dropped_parameters(&self) -> &'static [&'static str] {
        match self.0.form {
            DynamicsForm::Report(ParameterStructure::Printed12) => &UNPRINTED,
            _ => &[],
        }
    }

    /// Torque of joint `joint` by each of the dropped parameters.
    pub fn dropped_row(&self, joint: usize, q: &[f64], v: &[f64], a: &[f64], out: &mut [f64]) {
        if !self.dropped_parameters().is_empty() {
            let mut y = [[0.0; 22]; 4];
            regressor22(four(q), four(v), four(a), &mut y);
            out.copy_from_slice(&y[joint][PRINTED..]);
        }
    }
}

impl BaseTilt {
    /// Torques at the pose q, those of each joint by the two gravities \[N or N m per m/s^2\].
    pub fn torques(&self, q: &[f64], out: &mut [[f64; 2]]) {
        out.fill([0.0; 2]);
        match &self.0 {
            GravityMoments::Unknown => {}
            GravityMoments::Report(chain) => {
                for (joint, out) in out.iter_mut().enumerate() {
                    *out = of_report(chain, joint, four(q));
                }
            }
            GravityMoments::Links(trees, bodies) => {
                let still = [0.0; MOST_JOINTS];
                for (direction, tree) in trees.iter().enumerate() {
                    let mut of_joints = [0.0; MOST_JOINTS];
                    let state = [q, &still[..], &still[..]];
                    torques(tree, state, |link| bodies[link], &mut of_joints);
                    for (out, torque) in out.iter_mut().zip(of_joints) {
                        out[direction] = torque;
                    }
                }
            }
        }
    }
}

fn of_report(chain: &ReportCoefficients, joint: usize, q: &[f64; 4]) -> [f64; 2] {
    let [a, b, cc, e] = chain.h;
    let (s2, c2) = q[1].sin_cos();
    let (s4, c4) = q[2].sin_cos();
    let (sum_s, sum_c) = (q[2] + q[3]).sin_cos();
    // slopes of the radial first moment
    let by_psi = b * sum_c - e * sum_s;
    let by_q4 = a * c4 - cc * s4 + by_psi;
    let radial = chain.h0 + a * s4 + b * sum_s + cc * c4 + e * sum_c;
    match joint {
        0 => [0.0, -(chain.t1 + chain.mr)],
        1 => [chain.o * s2 + radial * c2, radial * s2 - chain.o * c2],
        2 => [by_q4 * s2, -by_q4 * c2],
        _ => [by_psi * s2, -by_psi * c2],
    }
}

/// Base parameters of a unit mass, unit first moments and a unit second moment along x of the CFT robot's last link.
static BODIES: LazyLock<[[f64; 22]; 5]> = LazyLock::new(|| {
    let place = [(3, 3), (0, 3), (1, 3), (2, 3), (0, 0)];
    place.map(|(r, c)| {
        let mut links = [PseudoInertia([[0.0; 4]; 4]); 8];
        links[7].0[r][c] = 1.0;
        links[7].0[c][r] = 1.0;
        base_parameters(&links)
    })
});

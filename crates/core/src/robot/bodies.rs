//! Between the parameters of a robot and those of its links and drives.

use nalgebra::DMatrix;

use super::cft::linkage;
use super::cft::links::{PseudoInertia, base_parameters};
use super::joint::JointKind;
use super::standard::{STANDARD, pseudo_inertia};
use super::tree::base;
use super::tree::newton_euler::walk;
use super::{DynamicsForm, Robot};

/// How a robot's inertial parameters follow from links and drives.
#[derive(Debug, Clone, PartialEq)]
pub struct StandardMap {
    pub links: Vec<String>,
    /// Joints whose drives have an inertia of their own.
    pub drives: Vec<usize>,
    /// Parameters x (ten a link, then the drives). Rows of zeros belong to parameters that no link
    /// and no drive has a part in: couplings of gear trains.
    pub matrix: DMatrix<f64>,
}

impl StandardMap {
    pub fn columns(&self) -> usize {
        self.matrix.ncols()
    }
}

impl Robot {
    /// Number of standard parameters: ten a link, then the drive inertias.
    pub fn standard_parameters(&self) -> usize {
        base::standard_parameters(self.tree(), self.drive_inertia())
    }

    /// How the inertial parameters follow from the standard parameters of links and drives.
    pub fn standard_map(&self) -> StandardMap {
        let links = self.tree().links();
        let (first, count) = (STANDARD * links.len(), self.standard_parameters());
        let mut matrix = DMatrix::zeros(self.parameters().len(), count);
        match &self.0.form {
            DynamicsForm::Recursion(parameters) => {
                for (row, grouping) in parameters.groupings().iter().enumerate() {
                    matrix[(row, grouping.kept)] = 1.0;
                    for (index, c) in &grouping.terms {
                        matrix[(row, *index)] = *c;
                    }
                }
            }
            DynamicsForm::Report(_) => {
                for column in 0..count {
                    let mut unit = [0.0; STANDARD];
                    unit[column % STANDARD] = 1.0;
                    let mut links = [PseudoInertia([[0.0; 4]; 4]); linkage::LINKS];
                    // symmetric: rows are columns
                    links[column / STANDARD] = PseudoInertia(pseudo_inertia(&unit).into());
                    let base = base_parameters(&links);
                    let rows = matrix.nrows();
                    matrix.column_mut(column).copy_from_slice(&base[..rows]);
                }
            }
            // one moving body: all that shows is its mass, or its moment about the axis
            DynamicsForm::Inertia => matrix[(0, self.shown())] = 1.0,
        }
        StandardMap {
            links: links.iter().map(|l| l.name.clone()).collect(),
            drives: (0..count - first).collect(),
            matrix,
        }
    }

    /// The standard parameter of its link that a single joint shows: Izz or the mass.
    fn shown(&self) -> usize {
        match self.joint_kind(0) {
            JointKind::Revolute => 5,
            JointKind::Prismatic => 9,
        }
    }

    /// Inertial parameters of standard ones, ten a link (inertia about the origin of the link's frame,
    /// first moments, mass), then the drive inertias. The couplings' are not among them.
    ///
    /// # Panics
    /// Where there are fewer than [`Self::standard_parameters`] numbers.
    pub fn base_of(&self, standard: &[f64]) -> Vec<f64> {
        if let DynamicsForm::Recursion(parameters) = &self.0.form {
            let sum = |g: &base::ParameterGroup| {
                let rest: f64 = g.terms.iter().map(|(i, c)| c * standard[*i]).sum();
                standard[g.kept] + rest
            };
            return parameters.groupings().iter().map(sum).collect();
        }
        let rows = self.standard_map().matrix;
        let rows = rows.row_iter();
        rows.map(|row| row.iter().zip(standard).map(|(m, x)| m * x).sum())
            .collect()
    }

    /// Standard parameters of each link that give these inertial ones: those that base parameters are
    /// named after, and 0 for what is grouped into them. No picture of the links.
    pub fn link_parameters(&self, theta: &[f64]) -> Vec<[f64; STANDARD]> {
        let mut bodies = vec![[0.0; STANDARD]; self.tree().links().len()];
        match &self.0.form {
            DynamicsForm::Inertia => {
                bodies[0][self.shown()] = theta.first().copied().unwrap_or_default();
            }
            DynamicsForm::Report(_) => {
                let mut full = [0.0; 22];
                // the report's structure is the full one with the last ten at 0
                for (out, theta) in full.iter_mut().zip(theta) {
                    *out = *theta;
                }
                let links = linkage::links_of(&full);
                return links.iter().map(PseudoInertia::standard).collect();
            }
            DynamicsForm::Recursion(parameters) => {
                for (grouping, value) in parameters.groupings().iter().zip(theta) {
                    if let Some(body) = bodies.get_mut(grouping.kept / STANDARD) {
                        body[grouping.kept % STANDARD] = *value;
                    }
                }
            }
        }
        bodies
    }

    /// Drive inertia of each joint by these inertial parameters [kg or kg m^2]; 0 where it is grouped
    /// into a link, or not modelled.
    pub fn drive_parameters(&self, theta: &[f64]) -> Vec<f64> {
        let first = STANDARD * self.tree().links().len();
        let mut drives = vec![0.0; self.joints()];
        for (grouping, value) in self.groupings().iter().zip(theta) {
            if let Some(joint) = grouping.kept.checked_sub(first) {
                drives[joint] = *value;
            }
        }
        drives
    }

    /// Inertia, viscous and Coulomb part of each coupling by these inertial parameters.
    pub fn coupling_parameters(&self, theta: &[f64]) -> Vec<[f64; 3]> {
        match &self.0.form {
            DynamicsForm::Recursion(parameters) => parameters.of_couplings(theta),
            DynamicsForm::Inertia | DynamicsForm::Report(_) => Vec::new(),
        }
    }

    /// Writes the regressor of all standard parameters, n x [`Self::standard_parameters`]
    /// row-major: the drive inertias last, without the couplings.
    pub fn standard_regressor(&self, q: &[f64], v: &[f64], a: &[f64], y: &mut [f64]) {
        let p = self.standard_parameters();
        y.fill(0.0);
        walk(self.tree(), q, v, a, |link, joint, row| {
            let at = joint * p + link * STANDARD;
            y[at..at + STANDARD].copy_from_slice(row);
        });
        if self.drive_inertia() {
            let first = self.tree().links().len() * STANDARD;
            for (j, a) in a.iter().enumerate().take(self.joints()) {
                y[j * p + first + j] = *a;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::cft::{LaboratorySetup, ParameterStructure};
    use crate::robot::standard::Body;

    /// In a vertical plane.
    fn double_pendulum(drive_inertia: bool) -> Robot {
        crate::robot::double_pendulum::double_pendulum([0.0, -9.81, 0.0], drive_inertia)
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

    #[test]
    fn the_map_of_the_cft_robot_gives_its_base_parameters() {
        let link = |i: f64| Body {
            mass: 2.0 + i,
            centre: [0.1 * i, -0.03, 0.02 * i],
            inertia: [0.2 + 0.01 * i, -0.01, 0.02 * i, 0.3, -0.004, 0.25],
        };
        let links: [[f64; STANDARD]; linkage::LINKS] =
            std::array::from_fn(|i| link(i as f64).standard());
        let pseudo = links.map(|link| PseudoInertia(pseudo_inertia(&link).into()));
        let robot = Robot::cft(LaboratorySetup::default(), ParameterStructure::Full22);
        let standard = nalgebra::DVector::from_column_slice(links.as_flattened());
        let found = robot.standard_map().matrix * standard;
        for (a, b) in found.iter().zip(base_parameters(&pseudo)) {
            assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{a} {b}");
        }
    }
}

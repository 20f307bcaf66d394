//! Temperatures of the simulated drives: of first order, towards a warmer end while the robot works and back in its
//! pauses. Nothing in the motion changes them.

use std::collections::BTreeMap;

use cft_ident_files::config::robot_file::TemperatureCourse;

/// How warm each joint's drive is; none where the robot file declares nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PlantTemperatures(Vec<Option<TemperatureCourse>>);

impl PlantTemperatures {
    /// Those that a robot file declares.
    pub fn of(declared: &BTreeMap<String, TemperatureCourse>, joints: &[String]) -> Self {
        Self(joints.iter().map(|j| declared.get(j).copied()).collect())
    }

    /// Temperature of a joint at time `t` \[degC\].
    pub fn at(&self, joint: usize, t: f64) -> Option<f64> {
        let course = self.0.get(joint)?.as_ref()?;
        Some(course.start + course.rise * share(course, t.max(0.0)))
    }
}

/// Part of the rise that is reached at time `t`.
fn share(course: &TemperatureCourse, t: f64) -> f64 {
    let left = |t: f64| (-t / course.time_constant_s).exp();
    let Some(cycle) = course.cycle_s else {
        return 1.0 - left(t);
    };
    let half = 0.5 * cycle;
    let (before, since) = ((t / cycle).floor(), t % cycle);
    // what is left of the rise at the begin of each cycle tends to a constant
    let decay = left(half);
    let begun = decay / (1.0 + decay) * (1.0 - left(before * cycle));
    let warm = |t: f64| 1.0 - (1.0 - begun) * left(t);
    match since < half {
        true => warm(since),
        false => warm(half) * left(since - half),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_is_that_of_its_differential_equation() {
        for cycle_s in [None, Some(6.0)] {
            let course = TemperatureCourse {
                start: 20.0,
                rise: 30.0,
                time_constant_s: 2.5,
                cycle_s,
            };
            let all = PlantTemperatures(vec![Some(course)]);
            let (mut x, dt) = (20.0, 1e-4);
            for k in 0..200_000 {
                let t = f64::from(k) * dt;
                if k % 5000 == 0 {
                    let found = all.at(0, t).unwrap();
                    assert!((found - x).abs() < 5e-3, "{cycle_s:?} {t}: {found} {x}");
                }
                let works = cycle_s.is_none_or(|cycle| t % cycle < 0.5 * cycle);
                let towards = if works { 50.0 } else { 20.0 };
                x += dt * (towards - x) / 2.5;
            }
            assert_eq!(all.at(1, 0.0), None);
        }
    }
}

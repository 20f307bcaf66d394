//! Which robot of a fleet differs from the others in what.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::walk::median;

/// The last level of one parameter of one robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterLevel {
    /// Number of the robot.
    pub robot: usize,
    /// Number of the parameter.
    pub parameter: usize,
    /// \[unit\]
    pub value: f64,
    pub std: f64,
}

/// A robot that differs from the others in one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotApart {
    pub level: ParameterLevel,
    /// Median over all robots \[unit\].
    pub usual: f64,
    /// Standard deviation with which robots differ from each other, that of the level included.
    pub std: f64,
    /// Probability of one that differs so much among robots that are alike, corrected for all comparisons (Holm 1979).
    pub p_value: f64,
}

/// Least number of robots that are compared: of fewer nobody can say which one differs.
const MIN_ROBOTS: usize = 5;

/// Robots that differ from the others at `level`, all comparisons together; the clearest first. Robots that are alike
/// differ by what their own parameters vary, which is taken from the middle of the fleet.
pub fn apart(levels: &[ParameterLevel], level: f64) -> Vec<RobotApart> {
    let mut all: Vec<RobotApart> = Vec::new();
    let mut parameters: Vec<usize> = levels.iter().map(|l| l.parameter).collect();
    parameters.sort_unstable();
    parameters.dedup();
    for parameter in parameters {
        let of_parameter = levels.iter().filter(|l| l.parameter == parameter);
        let known: Vec<&ParameterLevel> = of_parameter.filter(|l| l.std.is_finite()).collect();
        let Some(usual) =
            median(known.iter().map(|l| l.value)).filter(|_| known.len() >= MIN_ROBOTS)
        else {
            continue;
        };
        let spread = median(known.iter().map(|l| (l.value - usual).abs())).unwrap_or_default();
        // a median deviation is worth 0.37 of the robots (Rousseeuw and Croux 1993)
        let Ok(law) = StudentsT::new(0.0, 1.0, 0.37 * (known.len() - 1) as f64) else {
            continue;
        };
        for own in known {
            let std = (1.4826 * spread).max(own.std);
            let clear = ((own.value - usual) / std).abs();
            all.push(RobotApart {
                level: *own,
                usual,
                std,
                p_value: 2.0 * law.sf(clear),
            });
        }
    }
    all.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    let (count, mut least) = (all.len(), 0.0_f64);
    for (k, one) in all.iter_mut().enumerate() {
        least = least.max((one.p_value * (count - k) as f64).min(1.0));
        one.p_value = least;
    }
    all.retain(|one| one.p_value < level);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_robot_that_differs_is_found_and_equal_ones_are_not() {
        let (mut found, mut false_alarms) = (0, 0);
        for seed in 0..100 {
            let mut chance = ChaCha8Rng::seed_from_u64(seed);
            let mut draw = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
            let mut levels = Vec::new();
            for robot in 0..20 {
                for parameter in 0..10 {
                    let other = (robot, parameter) == (7, 3);
                    levels.push(ParameterLevel {
                        robot,
                        parameter,
                        value: 5.0 + 0.2 * draw() + if other { 4.0 } else { 0.0 },
                        std: 0.1,
                    });
                }
            }
            for one in apart(&levels, 0.05) {
                match (one.level.robot, one.level.parameter) {
                    (7, 3) => found += 1,
                    _ => false_alarms += 1,
                }
            }
        }
        assert!(found >= 98 && false_alarms <= 14, "{found} {false_alarms}");
        let few: Vec<ParameterLevel> = (0..4)
            .map(|robot| ParameterLevel {
                robot,
                parameter: 0,
                value: if robot == 0 { 100.0 } else { 1.0 },
                std: 0.1,
            })
            .collect();
        assert!(apart(&few, 0.05).is_empty());
    }
}
